"""Line: the TCP on a straight line, its orientation turning the shortest way in step with the position."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.caps import TcpCaps
from robot_agent.paths.orientation import turn_between, turned

SAME_PLACE_M, _SAME_ORIENTATION_RAD = 1e-6, 1e-6
"""A way or a turn that is shorter is none: paths are kept to no more, and it has no direction but that of rounding."""


@dataclass(frozen=True, slots=True, eq=False)
class Line(TcpCaps):
    """Move the TCP on a straight line to `target_pose` `(4, 4)`, in the robot base.

    `speed_m_s` caps the speed along the line (`None`: the robot's path speed); `line` is the program line for messages.
    `wrist_may_flip` lets J5 change its sign where the line passes a singular pose of the wrist, J4 and J6 continuous.
    """

    target_pose: NDArray[np.float64]
    speed_m_s: float | None
    line: int
    wrist_may_flip: bool = False

    def __post_init__(self) -> None:
        self.check("line", self.line, self.speed_m_s)


@dataclass(frozen=True, slots=True, eq=False)
class LineGeometry:
    """A line between two poses. With u in 0..1 as if it were time, velocity and angular velocity are constant.

    Turning about one fixed axis at a constant rate is SLERP (Shoemake 1985), here through the axis and angle of the
    relative rotation, which is the shortest way; of half a turn the one that `turn_between` chooses.
    """

    pose_base_start: NDArray[np.float64]
    """`(4, 4)`"""
    displacement: NDArray[np.float64]
    """`(3,)` [m]"""
    axis: NDArray[np.float64]
    """`(3,)` unit axis of the turn, in the robot base."""
    angle: float
    """[rad], 0 to pi, apart from rounding."""

    @classmethod
    def between(cls, start: NDArray[np.float64], target: NDArray[np.float64]) -> Self:
        """The line from pose `start` to pose `target`, both `(4, 4)`."""
        axis, angle = turn_between(start[:3, :3], target[:3, :3])
        return cls(np.array(start), target[:3, 3] - start[:3, 3], axis, angle)

    @property
    def length_m(self) -> float:
        """Length of the straight line; 0 for a turn on the spot."""
        length = float(np.linalg.norm(self.displacement))
        return length if length > SAME_PLACE_M else 0.0

    @property
    def is_empty(self) -> bool:
        """Nothing to do: start and target are the same pose."""
        return self.length_m == 0.0 and self.angle <= _SAME_ORIENTATION_RAD

    def poses(self, u: NDArray[np.float64]) -> NDArray[np.float64]:
        """TCP poses `(..., 4, 4)` at path parameters `u` `(...)`."""
        u = np.asarray(u, dtype=np.float64)
        poses = np.zeros((*u.shape, 4, 4))
        poses[..., :3, :3] = turned(self.axis, self.angle * u) @ self.pose_base_start[:3, :3]
        poses[..., :3, 3] = self.pose_base_start[:3, 3] + u[..., None] * self.displacement
        poses[..., 3, 3] = 1.0
        return poses
