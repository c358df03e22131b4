"""Where a step of a program leads, from where the robot is: what is not named keeps its value."""

import numpy as np
from numpy.typing import NDArray

from cell.geometry import from_xyz_abc
from robot_agent.language import JointStep


def joint_target(step: JointStep, start: NDArray[np.float64], home: NDArray[np.float64]) -> NDArray[np.float64]:
    """Joints `(n,)` at the end of a joint move from `start` `(n,)`."""
    return home if step.joints is None else _keep(step.joints, start)


def pose_target(
    position_m: tuple[float | None, ...],
    orientation_abc: tuple[float, float, float] | None,
    present: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Pose `(4, 4)` of the TCP at named coordinates, from the pose `present` `(4, 4)`."""
    position = _keep(position_m, present[:3, 3])
    target = present.copy()
    if orientation_abc is not None:
        target = from_xyz_abc(np.concatenate([position, orientation_abc]))
    target[:3, 3] = position
    return target


def _keep(named: tuple[float | None, ...], present: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.array([now if value is None else value for value, now in zip(named, present, strict=True)])
