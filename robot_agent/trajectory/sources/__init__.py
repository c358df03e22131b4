"""Set points that are made as they are needed: a jog, a path with corrections (`docs/motion.md`).

In go a motion or an operator's wish, and what is measured; out come `States` of the joints, tick by tick, and the ramp
to rest after them. A source knows nothing of how a motion is planned, nor of blocks, messages and drives.
"""

from robot_agent.trajectory.sources.axes import Axes, JointAxes, ToolAxes, WayAxes
from robot_agent.trajectory.sources.corrected import CorrectedSource, CorrectionFrame, CorrectionLimits
from robot_agent.trajectory.sources.corrected_block import CorrectedBlock
from robot_agent.trajectory.sources.jog import JOG_SPEED_M_S, JogSource, JogWish
from robot_agent.trajectory.sources.sampled import sampled, states_from
from robot_agent.trajectory.sources.states import JointState, States
from robot_agent.trajectory.sources.target import Conveyor, SensorOffset, Stale, Target

__all__ = [
    "JOG_SPEED_M_S",
    "Axes",
    "Conveyor",
    "CorrectedBlock",
    "CorrectedSource",
    "CorrectionFrame",
    "CorrectionLimits",
    "JogSource",
    "JogWish",
    "JointAxes",
    "JointState",
    "SensorOffset",
    "Stale",
    "States",
    "Target",
    "ToolAxes",
    "WayAxes",
    "sampled",
    "states_from",
]
