"""From geometry to time: jerk-limited motions and the governor of path time.

`plan` makes a `Motion` out of moves of geometry, a source answers with the samples that are sent of it. On top:
planner, assembly and splice make motions, inputs, limits and errors are what they are made from and refused for. Below:
joints/ what the joints do along a path; timing/ when; governor/ how fast it is played; sources/ where set points come
from. Nothing here knows of programs, zones, messages or the clock.
"""

from robot_agent.trajectory.errors import PlanError
from robot_agent.trajectory.governor.governor import Governor, Hold, RateRequest
from robot_agent.trajectory.governor.one_way import AT_HOLD_S
from robot_agent.trajectory.governor.segment import PathState, Segment
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion, move_lengths, tau_before
from robot_agent.trajectory.planner import plan
from robot_agent.trajectory.splice import spliced
from robot_agent.trajectory.timing.continuation import Continuation
from robot_agent.trajectory.timing.s_curve import SCurve, s_curve

__all__ = [
    "AT_HOLD_S",
    "Continuation",
    "Governor",
    "Hold",
    "Limits",
    "Motion",
    "PathState",
    "PlanError",
    "RateRequest",
    "SCurve",
    "Segment",
    "move_lengths",
    "plan",
    "s_curve",
    "spliced",
    "tau_before",
]
