"""Where a step of a program leads, from where the robot is: what is not named keeps its value."""

import numpy as np
from numpy.typing import NDArray

from cell.geometry import from_xyz_abc
from robot_agent.language import JointStep, LineStep


def joint_target(step: JointStep, start: NDArray[np.float64], home: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints `(n,)` at the end of a joint move from `start` `(n,)`."""
    return home if step.joints is None else _keep(step.joints, start)


def line_target(step: LineStep, present: NDArray[np.float64]) -> NDArray[np.float64]:
    """Pose `(4, 4)` of the flange at the end of a line from the pose `present` `(4, 4)`."""
    position = _keep(step.position_m, present[:3, 3])
    target = present.copy()
    if step.orientation_abc is not None:
        target = from_xyz_abc(np.concatenate([position, step.orientation_abc]))
    target[:3, 3] = position
    return target


def _keep(named: tuple[float | None, ...], present: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([now if value is None else value for value, now in zip(named, present, strict=True)])
