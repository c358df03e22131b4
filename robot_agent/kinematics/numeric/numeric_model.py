"""Any open chain: forward kinematics from its steps, inverse by iteration from several starts.

For robots without a closed form, such as painting arms whose wrist axes do not meet ("elephant nose").
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT
from cell.geometry import check_poses, transform_points
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.choice import joint_violation, reach_violation
from robot_agent.kinematics.errors import BadInput, NotInUrdf, Reason, Violation
from robot_agent.kinematics.model import moved
from robot_agent.kinematics.numeric import tracking
from robot_agent.kinematics.numeric.least_squares import ITERATIONS, Found, least_squares
from robot_agent.kinematics.problems import apart_problems, body_problems, coupling_problems
from robot_agent.kinematics.reach import Places, farthest
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.solutions import Solutions
from robot_agent.kinematics.turns import TURN, nearest_turn
from robot_agent.kinematics.urdf.bare_urdf import UrdfDescription
from robot_agent.kinematics.urdf.urdf_chain import UrdfChain, urdf_problems
from robot_agent.model.description import CapsuleBody, LinkMass, RobotDescription, UrdfSource
from robot_agent.model.families import family
from robot_agent.model.robot_file import RobotFile

SLOTS = 8
ROUNDS = (8, 24, 64)
"""Starts per pose; the later rounds are only for poses without a solution."""
ROWS = 8192
"""Most starts in one batch."""
SAME_RAD = 1e-5
"""Solutions that differ by less are one."""


class UrdfGeometry(BaseModel):
    """Where the chain of joints of any other robot is."""

    model_config = STRICT
    file: str = Field(min_length=1, description="the URDF file, relative to this one")
    flange: str | None = Field(None, description="the link that is the flange; left out: the one link without a child")


class UrdfFile(RobotFile):
    """The joints from a URDF, everything that URDF lacks from here."""

    geometry: UrdfGeometry = Field(description="where the chain is: {file: NAME.urdf, flange: LINK}")

    @classmethod
    def stand_in_geometry(cls) -> dict[str, Any]:
        return {"file": "unnamed.urdf"}

    def urdf(self) -> UrdfSource:
        return UrdfSource(Path(self.geometry.file), self.geometry.flange)


@family(
    "urdf",
    "Any other open chain: its joints from a URDF, everything that URDF lacks from here.",
    UrdfFile,
    no_masses="none here: the masses of such a robot are in its URDF",
)
class NumericModel(SerialModel):
    """See the module. The slots of `Solutions` are sorted by distance from `near`; they are no lasting branches."""

    branches: ClassVar[tuple[str, ...]] = tuple(f"S{i + 1}" for i in range(SLOTS))
    closed_form: ClassVar[bool] = False
    near_singular: ClassVar[float] = 0.005
    """Its measure is a ratio of speeds, which is 0.1 where nothing is singular."""

    def __init__(self, description: RobotDescription) -> None:
        if description.urdf is None:
            raise BadInput("robot description", "no URDF", "one that names the URDF of its chain")
        self._urdf: UrdfChain = _read(description.urdf)
        super().__init__(description, self._urdf.chain)
        self._tcp_reach_m = float(farthest(self._places(self.n, description.pose_flange_tcp[None, :3, 3]))[0])
        self._length_m = max(self._tcp_reach_m, 1e-3)
        self._starts = _spread(self.limits.position, sum(ROUNDS))

    @property
    def link_frames(self) -> Array:
        return self._urdf.link_frames

    @property
    def masses(self) -> tuple[LinkMass, ...]:
        return self._urdf.masses

    def links(self, q: Array) -> Array:
        return np.asarray(self._frames(q) @ self._urdf.link_frames)

    def singularity(self, q: Array) -> SingularityDistance:
        jacobian = self.flange_jacobian(q)
        jacobian[..., :3, :] /= self._length_m
        values = np.linalg.svd(jacobian, compute_uv=False)
        return SingularityDistance(("dependent axes",), values[..., -1:] / values[..., :1])

    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        poses = check_poses(poses, "poses")
        leading = poses.shape[:-2]
        flat, count = poses.reshape(-1, 4, 4), int(np.prod(leading, dtype=int))
        held = np.broadcast_to(self.held(near, leading), (self.n, count)).T
        joints = np.full((count, SLOTS, self.n), np.nan)
        away = np.full((count, 2), np.inf)
        open_rows, used = np.arange(count), 0
        for number in ROUNDS:
            for part in np.array_split(open_rows, max(1, -(-len(open_rows) * number // ROWS))):
                starts = np.tile(self._starts[used : used + number], (len(part), 1, 1))
                if used == 0:
                    starts[:, 0] = held[part]
                joints[part], away[part] = self._round(flat[part], held[part], starts)
            used += number
            open_rows = open_rows[np.isnan(joints[open_rows, 0, 0])]
            if not open_rows.size:
                break
        valid = ~np.isnan(joints[..., 0])
        missed = ~valid[:, :1]
        return Solutions(
            joints=joints.reshape(*leading, SLOTS, self.n),
            valid=valid.reshape(*leading, SLOTS),
            in_limits=valid.reshape(*leading, SLOTS),
            singular=np.zeros((*leading, SLOTS), dtype=bool),
            excess_m=np.where(missed, np.broadcast_to(away[:, :1], valid.shape), 0.0).reshape(*leading, SLOTS),
            branches=self.branches,
            complete=False,
            tilt_rad=np.where(missed[:, 0], away[:, 1], 0.0).reshape(leading),
        )

    def explain(self, pose: Array, solutions: Solutions, allowed: Flags | None = None) -> Violation:
        """The reach of the whole chain, a limit without which a solution was found, or the nearest miss."""
        excess = float(np.linalg.norm(pose[:3, 3])) - self._tcp_reach_m
        if excess > 0:
            return reach_violation(excess)
        turns = self.limits.position.mean(axis=1)[:, None] + [-TURN, TURN]
        free = np.where(self.linear[:, None], self.limits.position, turns)
        starts = self._starts[: ROUNDS[1]]
        found = self.iterate(np.tile(pose, (len(starts), 1, 1)), starts, free)
        if found.solved.any():
            joints, _ = self._turned(found.joints[found.solved], self.limits.position.mean(axis=1))
            lower, upper = self.limits.position.T
            beyond = np.maximum(np.maximum(lower - joints, joints - upper), 0).sum(axis=1)
            return self.limit_on_the_way(joints[int(beyond.argmin())])
        missed = solutions.excess_m if allowed is None else solutions.excess_m[allowed]
        return Violation(Reason.NOT_FOUND, excess_m=float(missed.min()), tilt_rad=float(solutions.tilt_rad))

    def limit_on_the_way(self, joints: Array) -> Violation:
        """The limit that joints `(n,)` on a continuous path leave."""
        lower, upper = self.limits.position.T
        joint = int(np.maximum(lower - joints, joints - upper).argmax())
        return joint_violation(self, joint, float(joints[joint]))

    def track(self, poses: Array, start: Array) -> Array:
        poses = check_poses(poses)
        if poses.ndim != 3 or len(poses) == 0:
            raise BadInput("path", f"shape {poses.shape}", "(m, 4, 4) with m > 0")
        return tracking.track(self, poses, self.check_joints(start, "start"))

    def follow(self, poses: Array, start: Array) -> Array:
        """As `track` for poses `(m, 4, 4)` next to joints `start` `(n,)`, with no search all over the robot's reach."""
        return tracking.follow(self, check_poses(poses), self.check_joints(start, "start"))

    def iterate(
        self, targets: Array, starts: Array, limits: Array | None = None, iterations: int = ITERATIONS
    ) -> Found:
        """Where the starts `(p, n)` lead for the targets `(p, 4, 4)`, within the limits `(n, 2)`: the robot's."""
        bounds = self.limits.position if limits is None else limits
        return least_squares(self._pose_and_jacobian, targets, starts, bounds, self._length_m, iterations)

    def _pose_and_jacobian(self, q: Array) -> tuple[Array, Array]:
        frames = self._urdf.chain.frames(q)
        flange = self._urdf.chain.flange(frames)
        arm = flange[..., :3, :3] @ self._tcp
        return self.tcp_at(flange), moved(self._urdf.chain.jacobian(frames), arm)

    def _round(self, targets: Array, held: Array, starts: Array) -> tuple[Array, Array]:
        """Distinct solutions `(p, SLOTS, n)`, nearest to `held` `(p, n)` first, and the nearest miss `(p, 2)`."""
        count, number = starts.shape[:2]
        found = self.iterate(np.repeat(targets, number, axis=0), starts.reshape(-1, self.n))
        joints, _ = self._turned(found.joints.reshape(count, number, self.n), held[:, None])
        solved = found.solved.reshape(count, number)
        distance = np.where(solved, ((joints - held[:, None]) ** 2).sum(axis=-1), np.inf)
        order = np.argsort(distance, axis=1, kind="stable")
        joints = np.take_along_axis(joints, order[..., None], axis=1)
        solved = np.take_along_axis(solved, order, axis=1)
        twins = np.abs(joints[:, :, None] - joints[:, None]).max(axis=-1) < SAME_RAD
        again = (twins & np.tri(number, k=-1, dtype=bool) & solved[:, None]).any(axis=-1)
        joints[~solved | again] = np.nan
        kept = np.argsort(np.isnan(joints[..., 0]), axis=1, kind="stable")[:, :SLOTS]
        away = np.stack([found.away_m, found.away_rad], axis=-1).reshape(count, number, 2)
        best = (away / [self._length_m, 1.0]).sum(axis=-1).argmin(axis=1)
        return np.take_along_axis(joints, kept[..., None], axis=1), away[np.arange(count), best]

    def _turned(self, joints: Array, near: Array) -> tuple[Array, Flags]:
        lower, upper = self.limits.position.T
        turned, inside = nearest_turn(joints, near, lower, upper)
        return np.where(self.linear, joints, turned), inside | self.linear

    def _places(self, link: int, at: Array) -> Places:
        if link == self.n:  # the chain itself ends at the flange
            return super()._places(link, at)
        return super()._places(link, transform_points(self._urdf.link_frames[link], at))

    def _link_names(self) -> tuple[str, ...]:
        return self._urdf.link_names

    def _problems(self) -> Iterator[str]:
        yield from urdf_problems(self.description, self._urdf)
        yield from body_problems(self.body, len(self.link_names))
        yield from apart_problems(self.description.apart, self.link_names, self.description.parts)
        yield from coupling_problems(self.description)


class BareUrdf(NumericModel):
    """A URDF without a robot file: kinematics only."""

    def __init__(self, source: UrdfSource) -> None:
        super().__init__(UrdfDescription(source, _read(source)))

    @property
    def capsule_radii(self) -> Array:
        raise NotInUrdf(f"{self.description.name}.urdf", "capsules")

    def capsules(self, q: Array) -> Array:
        self.check_joints(q)
        raise NotInUrdf(f"{self.description.name}.urdf", "capsules")

    def _whole_body(self) -> tuple[CapsuleBody, ...]:
        return ()

    def _problems(self) -> Iterator[str]:
        yield from ()


def _read(source: UrdfSource) -> UrdfChain:
    from robot_agent.kinematics.urdf.urdf_reader import read_urdf  # Pinocchio takes 0.4 s, which only a URDF waits for

    return read_urdf(source)


def _spread(limits: Array, count: int) -> Array:
    """Starts `(count, n)` all over the joints' ranges, the same ones each time; the first is the middle.

    Roberts' low-discrepancy sequence: multiples of the powers of the generalised golden ratio. A joint that can turn
    farther than once starts within one turn.
    """
    n, ratio = len(limits), 2.0
    for _ in range(50):
        ratio = (1 + ratio) ** (1 / (n + 1))
    shares = (0.5 + np.arange(count)[:, None] * ratio ** -np.arange(1.0, n + 1)) % 1.0
    middle, half = limits.mean(axis=1), np.minimum(np.diff(limits, axis=1)[:, 0] / 2, np.pi)
    return np.asarray(middle + half * (2 * shares - 1))
