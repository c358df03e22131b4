"""What every robot family answers, and what follows for all of them from its links and its inverse."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from functools import cached_property
from math import isfinite
from typing import ClassVar

import numpy as np

from cell.geometry import check_poses, transform_points
from cell.geometry import inverse as inverse_pose
from cell.geometry.arrays import Array, Flags, keep_freed_memory
from robot_agent.kinematics import choice, tracking
from robot_agent.kinematics.coupling import Coupling
from robot_agent.kinematics.errors import BadInput, BadModel, Violation
from robot_agent.kinematics.problems import apart_problems, body_problems, coupling_problems, family_problems
from robot_agent.kinematics.reach import Places, farthest
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.solutions import Solutions
from robot_agent.model.description import Capsule, CapsuleBody, JointLimits, RobotDescription
from robot_agent.model.families import shape_of


class Model(ABC):
    """Kinematics of one robot. Link 0 is the base, the last one the flange.

    Poses, velocities and Jacobians are those of the TCP of the mounted tool; without a tool the TCP is the flange.

    In families with one chain link `i` is the frame behind joint `i`; palletizer and delta have links of their own.
    """

    branches: ClassVar[tuple[str, ...]]
    """Names of the solution branches, in the order of the slots of `Solutions`."""
    closed_form: ClassVar[bool] = True
    """Whether `inverse` finds all solutions that there are."""
    near_singular: ClassVar[float] = 0.05
    """What is nearer to a singularity than this is worth a warning: 3 deg of a wrist."""

    def __init__(self, description: RobotDescription) -> None:
        keep_freed_memory()
        self.description = description
        self.link_names: tuple[str, ...] = self._link_names()
        self.body: tuple[CapsuleBody, ...] = self._whole_body()
        """All capsules, then those of the mounted tool, then those of the part that is held."""
        problems = tuple(self._problems())
        if problems:
            raise BadModel(description.name, problems)
        self.n = len(description.joint_names)
        self.joint_names: tuple[str, ...] = description.joint_names
        self.limits: JointLimits = description.limits
        self.linear: Flags = np.array(description.linear or (False,) * self.n)
        """`(n,)`: whether each joint slides."""
        self.linear_names = tuple(name for name, slides in zip(self.joint_names, self.linear, strict=True) if slides)
        self.coupling = Coupling.of(description.coupling, self.n)
        self._tcp = description.pose_flange_tcp[:3, 3]
        """`(3,)` [m] in the frame of the flange."""
        self._capsule_radii = np.array([c.radius_m for c in self.body], dtype=float)
        self._capsule_links = np.array([c.link for c in self.body], dtype=int)
        self._capsule_ends = np.array([(c.start_m, c.end_m) for c in self.body], dtype=float).reshape(-1, 2, 3)

    @property
    def home(self) -> Array:
        """`(n,)` joints of the home position."""
        return self.description.home

    @property
    def capsule_radii(self) -> Array:
        """`(c,)` [m]."""
        return self._capsule_radii

    @cached_property
    def reach_m(self) -> float:
        """A bound [m]: no point of any capsule, nor flange or TCP, is ever farther from the base origin.

        Joints that turn may have any angle, those that slide keep to their limits; less than 1 % too large for families
        with one chain (`robot_agent.kinematics.reach`).
        """
        flange = len(self.link_names) - 1
        reach = float(farthest(self._places(flange, np.stack([np.zeros(3), self._tcp]))).max())
        for link in sorted(set(self._capsule_links.tolist())):
            mine = self._capsule_links == link
            ends = farthest(self._places(link, self._capsule_ends[mine].reshape(-1, 3)))
            reach = max(reach, float((ends.reshape(-1, 2).max(axis=-1) + self._capsule_radii[mine]).max()))
        return reach

    @abstractmethod
    def _places(self, link: int, at: Array) -> Places:
        """Where points `(p, 3)` [m] of a link can be, in the base."""

    @abstractmethod
    def links(self, q: Array) -> Array:
        """Joints `(..., n)` -> poses of all links in base `(..., links, 4, 4)`; names: `link_names`."""

    @abstractmethod
    def flange_jacobian(self, q: Array) -> Array:
        """Joints `(..., n)` -> `(..., 6, n)`: flange velocity per joint velocity, linear then angular, base axes."""

    @abstractmethod
    def flange_jacobian_derivative(self, q: Array, qd: Array) -> Array:
        """Joints and their speeds `(..., n)` -> `(..., 6, n)`: how fast the Jacobian of the flange changes."""

    @abstractmethod
    def singularity(self, q: Array) -> SingularityDistance:
        """Joints `(..., n)` -> how far they are from each singularity of the family."""

    @abstractmethod
    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        """All joints that bring the TCP to `poses` `(..., 4, 4)`.

        `near`: `(n,)` or `(..., n)`, the joints that free joints keep and to whose turn the rest is brought; zeros when
        not given.

        Raises:
            cell.geometry.GeometryError: `poses` are not poses.
            BadInput: `near` has another shape, or a value that is not finite.
        """

    def manipulability(self, q: Array) -> Array:
        """Joints `(..., n)` -> `(...)`: product of the singular values of the Jacobian; 0 where it is singular.

        That of the flange: what the arm can do is no matter of its tool. Of six axes it is |det J|, in m^3 where all of
        them turn: what the volume of joint speeds becomes for the flange (Yoshikawa, Manipulability of
        Robotic Mechanisms, 1985).
        """
        return np.asarray(np.linalg.svd(self.flange_jacobian(q), compute_uv=False).prod(axis=-1))

    def from_limits(self, q: Array) -> Array:
        """Joints `(..., n)` -> how far each is from the nearer of its limits [rad or m]; below zero beyond it."""
        q, (lower, upper) = self.check_joints(q), self.limits.position.T
        return np.asarray(np.minimum(q - lower, upper - q))

    def forward(self, q: Array) -> Array:
        """Joints `(..., n)` [rad or m] -> pose of the TCP in base `(..., 4, 4)`."""
        return self.tcp_at(self.links(q)[..., -1, :, :])

    def jacobian(self, q: Array) -> Array:
        """Joints `(..., n)` -> `(..., 6, n)`: TCP velocity per joint velocity, linear then angular, base axes."""
        flange = self.flange_jacobian(q)
        return flange if self.description.tool is None else moved(flange, self._to_tcp(q))

    def jacobian_derivative(self, q: Array, qd: Array) -> Array:
        """Joints and their speeds `(..., n)` -> `(..., 6, n)`: how fast the Jacobian changes.

        The TCP's velocity is v + w x a, with a from flange to TCP; a changes by w x a.
        """
        change = self.flange_jacobian_derivative(q, qd)
        if self.description.tool is None:
            return change
        jacobian, arm = self.flange_jacobian(q), self._to_tcp(q)
        w = (jacobian[..., 3:, :] @ np.asarray(qd)[..., None])[..., 0]
        change = moved(change, arm)
        change[..., :3, :] += np.cross(jacobian[..., 3:, :], np.cross(w, arm)[..., None], axis=-2)
        return change

    def capsules(self, q: Array) -> Array:
        """Joints `(..., n)` -> end points of all capsules in base `(..., c, 2, 3)` [m]; radii: `capsule_radii`."""
        return self.capsules_of(self.links(q))

    def body_and_tcp(self, q: Array) -> Array:
        """`capsules`, and the TCP as one more of length 0: `(..., c + 1, 2, 3)` [m] in base."""
        links = self.links(q)
        tcp = self.tcp_at(links[..., -1, :, :])[..., None, None, :3, 3]
        return np.concatenate([self.capsules_of(links), np.repeat(tcp, 2, axis=-2)], axis=-3)

    def capsules_of(self, links: Array) -> Array:
        """The same from poses of all links in base `(..., links, 4, 4)`."""
        frames = links[..., self._capsule_links, None, :3, :]
        ends = self._capsule_ends
        points: Array = frames[..., 3] + frames[..., 0] * ends[..., 0, None]
        points += frames[..., 1] * ends[..., 1, None]
        points += frames[..., 2] * ends[..., 2, None]
        return points

    def joined_links(self) -> frozenset[tuple[int, int]]:
        """Pairs of links, the smaller number first, that a joint holds together: their bodies always touch."""
        return frozenset((link, link + 1) for link in range(len(self.link_names) - 1))

    def tcp_at(self, pose_base_flange: Array) -> Array:
        """Where the TCP is, `(..., 4, 4)`, when the flange is at these poses."""
        tool = self.description.tool
        return pose_base_flange if tool is None else np.asarray(pose_base_flange @ tool.pose_flange_tcp)

    def flange_at(self, pose_base_tcp: Array) -> Array:
        """Where the flange is, `(..., 4, 4)`, when the mounted tool's TCP is at these poses. Raises as `inverse`."""
        tool = self.description.tool
        if tool is None:
            return pose_base_tcp
        return np.asarray(check_poses(pose_base_tcp, "poses") @ inverse_pose(tool.pose_flange_tcp))

    def tool_speed(self, q: Array, qd: Array) -> Array:
        """Joints and their speeds `(..., n)` -> `(...)` [m/s]: of flange and TCP the faster one.

        Where any of several tools may be mounted it is that of the fastest TCP.
        """
        twist = (self.flange_jacobian(q) @ qd[..., None])[..., 0]
        v, w = twist[..., :3], twist[..., 3:]
        speed = np.sqrt(np.einsum("...k,...k", v, v))
        if not self.description.mounted.tools:
            return np.asarray(speed)
        flange = self.links(q)[..., -1, :3, :3]
        for pose in self.description.poses_flange_tcp:
            speed = np.maximum(speed, np.linalg.norm(v + np.cross(w, flange @ pose[:3, 3]), axis=-1))
        return np.asarray(speed)

    def reaches(self, poses: Array) -> Flags:
        """Poses `(..., 4, 4)` -> `(...)`: whether some joints inside the limits bring the TCP there."""
        return np.asarray(self.inverse(poses).in_limits.any(axis=-1))

    def why_unreachable(self, pose: Array) -> Violation | None:
        """What keeps the TCP from one pose `(4, 4)`; None when the robot reaches it."""
        solutions = self.inverse(self._one_pose(pose))
        return None if solutions.in_limits.any() else self.explain(pose, solutions)

    def explain(self, pose: Array, solutions: Solutions, allowed: Flags | None = None) -> Violation:
        """Why none of the allowed branches `(k,)` brings the TCP to one pose; all branches when not given."""
        self._one_pose(pose)
        return choice.why(self, solutions, allowed)

    def continuous(self, joints: Array) -> Array:
        """Joints along a path `(m, n)`, each at its own turn -> the same poses without jumps by whole turns."""
        return np.where(self.linear, joints, np.unwrap(joints, axis=0))

    def bulge_m(self, q: Array) -> Array:
        """How far, at most, an end of a capsule or the TCP leaves the chord of two samples of a path: `(m - 1,)` [m].

        `q` `(m, n)`, evenly apart in time or in way. Joints that move evenly carry a point on arcs: its second
        derivative is at most R (sum of joint steps)^2, with R the reach and sliding steps divided by R, so it leaves
        the chord by an eighth of that. And joints that accelerate leave their own chords by an eighth of their second
        difference, here taken twice for what the jerk adds, times R.
        """
        steps = np.diff(q, axis=0) / np.where(self.linear, self.reach_m, 1.0)
        bends = np.zeros(max(len(q) - 1, 0))
        if len(q) > 2:
            second = np.abs(np.diff(steps, axis=0)).sum(axis=-1)
            bends[:-1] = second
            bends[1:] = np.maximum(bends[1:], second)
        evenly = np.abs(steps).sum(axis=-1) ** 2
        return np.asarray(self.reach_m * (evenly / 8 + bends / 4))

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
        pose = np.asarray(pose, dtype=float)
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
        poses = np.asarray(poses, dtype=float)  # checked by the inverse
        if poses.ndim != 3 or len(poses) == 0:
            raise BadInput("path", f"shape {poses.shape}", "(m, 4, 4) with m > 0")
        return tracking.track(self, poses, self.check_joints(start, "start"))

    def check_joints(self, q: Array, what: str = "joints") -> Array:
        """Return `q` as an array `(..., n)` of finite values, or raise `BadInput`."""
        q = np.asarray(q, dtype=float)
        if q.shape[-1:] != (self.n,):
            raise BadInput(what, f"shape {q.shape}", f"(..., {self.n})")
        # For one joint set plain floats are faster.
        finite = all(map(isfinite, q.tolist())) if q.ndim == 1 else np.isfinite(q).all()
        if not finite:
            raise BadInput(what, "a value that is not finite", "finite values")
        return q

    def check_one(self, q: Array, what: str) -> list[float]:
        """Return one joint set `(n,)` as plain floats, or raise `BadInput`."""
        q = self.check_joints(q, what)
        if q.ndim != 1:
            raise BadInput(what, f"shape {q.shape}", f"({self.n},)")
        joints: list[float] = q.tolist()
        return joints

    def held(self, near: Array | None, leading: tuple[int, ...]) -> Array:
        """`near` as `(n, 1)` or `(n, poses)`; zeros when there is none."""
        if near is None:
            return np.zeros((self.n, 1))
        near = self.check_joints(near, "near")
        if near.ndim == 1:
            return near[:, None]
        if near.shape[:-1] != leading:
            raise BadInput("near", f"shape {near.shape}", f"({self.n},) or {(*leading, self.n)}")
        return np.ascontiguousarray(near.reshape(-1, self.n).T)

    def _to_tcp(self, q: Array) -> Array:
        """Joints `(..., n)` -> from the flange to the TCP `(..., 3)` [m], base axes."""
        return np.asarray(self.links(q)[..., -1, :3, :3] @ self._tcp)

    def _one_pose(self, pose: Array) -> Array:
        pose = check_poses(pose)
        if pose.ndim != 2:
            raise BadInput("pose", f"shape {pose.shape}", "(4, 4)")
        return pose

    def _link_names(self) -> tuple[str, ...]:
        return shape_of(self.description.family).links

    def _whole_body(self) -> tuple[CapsuleBody, ...]:
        described, flange = self.description, len(self.link_names) - 1
        mounted = [capsule for name in described.mounted.tools for capsule in described.tools[name].capsules]
        parts = (described.parts[name] for name in described.mounted.parts)
        held = (
            _in_flange(pose, each) for part in parts for pose in described.poses_flange_tcp for each in part.capsules
        )
        carried = (CapsuleBody(flange, c.start_m, c.end_m, c.radius_m) for c in (*mounted, *held))
        return (*described.capsules, *carried)

    def _problems(self) -> Iterator[str]:
        """Everything that makes the description no robot of its family."""
        yield from family_problems(self.description)
        yield from body_problems(self.body, len(self.link_names))
        yield from apart_problems(self.description.apart, self.link_names, self.description.parts)
        yield from coupling_problems(self.description)


def moved(jacobian: Array, arm: Array) -> Array:
    """A Jacobian `(..., 6, n)` for the point `arm` `(..., 3)` [m] away, base axes: its angular part is the same."""
    turning = np.cross(jacobian[..., 3:, :], arm[..., None], axis=-2)
    return np.concatenate([jacobian[..., :3, :] + turning, jacobian[..., 3:, :]], axis=-2)


def _in_flange(pose_flange_tcp: Array, capsule: Capsule) -> Capsule:
    """A capsule of the TCP's frame in that of the flange."""
    (x, y, z), (u, v, w) = transform_points(pose_flange_tcp, np.array([capsule.start_m, capsule.end_m])).tolist()
    return Capsule((x, y, z), (u, v, w), capsule.radius_m)
