"""What every robot family answers, and what follows for all of them from its links and its inverse."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from cell.geometry import check_poses
from cell.geometry.arrays import Array
from robot_agent.kinematics import choice, tracking
from robot_agent.kinematics.errors import BadInput
from robot_agent.kinematics.solutions import Solutions
from robot_agent.model.description import JointLimits, RobotDescription


class Model(ABC):
    """Kinematics of one robot. Link 0 is the base, link `i` the frame behind joint `i`, the last one the flange."""

    branches: ClassVar[tuple[str, ...]]
    """Names of the solution branches, in the order of the slots of `Solutions`."""

    def __init__(self, description: RobotDescription) -> None:
        self.description = description
        self.n = len(description.joint_names)
        self.joint_names: tuple[str, ...] = description.joint_names
        self.limits: JointLimits = description.limits
        self.home: Array = np.asarray(description.home, dtype=float)
        self.capsule_radii: Array = np.array([c.radius_m for c in description.capsules], dtype=float)
        """`(c,)` [m]."""
        self._capsule_links = np.array([c.link for c in description.capsules], dtype=int)
        self._capsule_ends = np.array([(c.start_m, c.end_m) for c in description.capsules], dtype=float).reshape(
            -1, 2, 3
        )

    @property
    @abstractmethod
    def reach_m(self) -> float:
        """A bound [m]: no point of any capsule is ever farther from the base origin."""

    @abstractmethod
    def links(self, q: Array) -> Array:
        """Joints `(..., n)` -> poses of all links in base `(..., n + 1, 4, 4)`."""

    @abstractmethod
    def jacobian(self, q: Array) -> Array:
        """Joints `(..., n)` -> `(..., 6, n)`: flange velocity per joint velocity, linear then angular, base axes."""

    @abstractmethod
    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        """All joints that bring the flange to `poses` `(..., 4, 4)`.

        `near`: `(n,)` or `(..., n)`, the joints that free joints keep and to whose turn the rest is brought; zeros when
        not given.

        Raises:
            cell.geometry.GeometryError: `poses` are not poses.
            BadInput: `near` has another shape, or a value that is not finite.
        """

    def forward(self, q: Array) -> Array:
        """Joints `(..., n)` [rad or m] -> pose of the flange in base `(..., 4, 4)`."""
        flange: Array = self.links(q)[..., -1, :, :]
        return flange

    def capsules(self, q: Array) -> Array:
        """Joints `(..., n)` -> end points of all capsules in base `(..., c, 2, 3)` [m]; radii: `capsule_radii`."""
        frames = self.links(q)[..., self._capsule_links, None, :3, :]
        ends = self._capsule_ends
        points: Array = frames[..., 3] + frames[..., 0] * ends[..., 0, None]
        points += frames[..., 1] * ends[..., 1, None]
        points += frames[..., 2] * ends[..., 2, None]
        return points

    def solve(
        self,
        pose: Array,
        near: Array | None = None,
        branch: str | None = None,
        prefer: Mapping[str, float] | None = None,
    ) -> Array:
        """The one solution `(n,)` inside the limits to use for `pose` `(4, 4)`.

        It is the nearest to `near` (sum of squares over the joints). `branch` forces a branch, by its full name or by
        some of its parts ("BACK", "FRONT/DOWN"). `prefer` gives reference values [rad or m] for named joints: these
        decide first, the other joints break ties.

        Raises:
            Unreachable: no such solution; with reason and, for a limit, joint, value and limits.
            UnknownName: no such branch or joint.
            BadInput, cell.geometry.GeometryError: as `inverse`.
        """
        pose = check_poses(pose)
        if pose.ndim != 2:
            raise BadInput("pose", f"shape {pose.shape}", "(4, 4)")
        return choice.solve(self, pose, near, branch, prefer or {})

    def track(self, poses: Array, start: Array) -> Array:
        """Joints `(m, n)` along a path of poses `(m, 4, 4)`: one branch, continuous, inside the limits.

        The branch is the one whose solution of the first pose is nearest to `start` `(n,)`; the first row continues
        from the turn of `start`. Take the poses dense: a joint step above `tracking.LARGEST_STEP_RAD` counts as a jump.

        Raises:
            TrackError: out of reach, a joint limit, or a branch change, with the index of the pose.
            BadInput, cell.geometry.GeometryError: as `inverse`.
        """
        poses = check_poses(poses)
        if poses.ndim != 3 or len(poses) == 0:
            raise BadInput("path", f"shape {poses.shape}", "(m, 4, 4) with m > 0")
        return tracking.track(self, poses, self.check_joints(start, "start"))

    def check_joints(self, q: Array, what: str = "joints") -> Array:
        """Return `q` as an array `(..., n)` of finite values, or raise `BadInput`."""
        q = np.asarray(q, dtype=float)
        if q.shape[-1:] != (self.n,):
            raise BadInput(what, f"shape {q.shape}", f"(..., {self.n})")
        if not np.isfinite(q).all():
            raise BadInput(what, "a value that is not finite", "finite values")
        return q
