"""What the agent sends while the drives of its robot are disabled."""

import numpy as np

from cell.messages import DriveFeedback, SetpointBlock
from robot_agent.agent.axes import samples_in_axes
from robot_agent.agent.planning import Planner
from robot_agent.dynamics import AxisTorques

_AHEAD_TICKS = 5
_SAMPLES = 3


def sign_of_life(number: int, feedback: DriveFeedback, planner: Planner, torques: AxisTorques | None) -> SetpointBlock:
    """Block `number`, which holds: without enabled drives the gateway plays none, but hears that its owner lives.

    It tells the torques that carry the robot, where the gateway asks for them and the robot knows where it is.
    """
    joints = np.repeat(feedback.commanded[None, :], _SAMPLES, axis=0)
    position, velocity = samples_in_axes(planner.model.coupling, joints, np.zeros_like(joints))
    torque = torques.standing(joints) if torques is not None and feedback.referenced else None
    return SetpointBlock(
        feedback.robot, feedback.owner, number, 0, feedback.tick + _AHEAD_TICKS, planner.cycle_s, _SAMPLES,
        position, velocity, torque,
    )  # fmt: skip
