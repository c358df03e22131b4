"""Where a robot may still come to that brakes off its path: each drive by itself, and nobody knows how hard.

The gateway's last means is the drives' own quick stop. Its deceleration (6085h) stands in the drives file, which an
agent does not read: the gateway tells it with the claim. `cell check` and the gateway's own check make it more than the
robot's braking ramps need. A loaded axis may take twice as long, as the gateway's deadline for rest has it. So each
axis brakes with at least half of what its ramps need, and it ends up somewhere between where it is now and where that
leads.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from cell.geometry import transform_points
from cell.geometry.arrays import Array
from cell.messages import Body
from robot_agent.kinematics import Model, OpenMechanism, SerialModel
from robot_agent.trajectory import Limits
from robot_agent.workspace.body import BODY_GROWTH_M, body_of, unknown_body

BRAKING_RESERVE = 2.0
"""A loaded axis may need so many times the braking way that its speed and its deceleration give."""
_REACTION_CYCLES = 3
"""From a measurement to the first cycle in which the drives brake: until then they follow what was sent."""
_MOST_POSES = 64
_STEP = 1e-5


@dataclass(frozen=True, slots=True, eq=False)
class Braking:
    """How a robot's axes brake at the worst."""

    model: Model
    deceleration: Array
    """`(n,)` [rad/s^2 or m/s^2] of each axis, at least."""
    acceleration: Array
    """`(n,)` what was sent may change the speed of each axis by at most."""
    reaction_s: float
    quick_stop: Array
    """`(n,)` [rad/s^2 or m/s^2] with which the drive of each axis brakes where nothing hinders it."""

    @classmethod
    def of(cls, model: Model, limits: Limits, cycle_s: float, quick_stop: Sequence[float] = ()) -> Self:
        """From what a robot's ramps need of its drives (`cell check` demands it of the drives file).

        `quick_stop` is what the drives are told, for each axis; what the ramps need of it where that is more, and where
        there is not one for each axis.
        """
        ramp = np.abs(limits.ramp_acceleration_bounds).max(axis=0)
        axes = np.abs(model.coupling.axes_per_joint) @ ramp
        told = np.maximum(axes, quick_stop) if len(quick_stop) == len(axes) else axes
        return cls(model, axes / BRAKING_RESERVE, axes, _REACTION_CYCLES * cycle_s, told)

    def time_s(self, qd: Array) -> float:
        """Until rest [s] from joint speeds `qd` `(n,)`, at the longest."""
        speed = np.abs(self.model.coupling.axes(qd)) + self.acceleration * self.reaction_s
        return self.reaction_s + float((speed / self.deceleration).max())

    def ways(self, qd: Array) -> Array:
        """How far down and up each axis may still go `(2, n)` [rad or m] from joint speeds `qd` `(n,)`."""
        axes, gained = self.model.coupling.axes(qd), self.acceleration * self.reaction_s
        speeds = np.stack([np.maximum(-axes, 0.0), np.maximum(axes, 0.0)]) + gained
        ways = speeds * self.reaction_s + speeds**2 / (2.0 * self.deceleration)
        return np.asarray(ways * np.array([[-1.0], [1.0]]))

    def body(self, pose_world_base: Array, q: Array, qd: Array) -> Body:
        """Everything between measured joints `q` `(n,)` [rad or m] at speeds `qd` and rest; the present pose first.

        The whole reach, when the mechanism cannot be there or the way is too long for a bound.
        """
        try:
            points, growth = poses_within(self.model, q, self.ways(qd))
            present = self.model.body_and_tcp(q)[None]
        except OpenMechanism:
            return unknown_body(self.model, pose_world_base)
        if growth.max() > self.model.reach_m:
            return unknown_body(self.model, pose_world_base)
        world = transform_points(pose_world_base, np.concatenate([present, points]))
        return body_of(self.model, pose_world_base, world, [0.0, *growth.tolist()])


def poses_within(model: Model, q: Array, ways: Array) -> tuple[Array, Array]:
    """Poses of all capsules and the TCP in base `(m, c + 1, 2, 3)` [m] with a growth each `(m,)` [m].

    Together they cover the robot with its axes anywhere between `ways[0]` and `ways[1]` `(n,)` beside those at joints
    `q`. The ranges are cut into cells. A cell's pose is its middle; it is grown by the way of its farthest corner, and
    by how far a point may be from the interpolation between corners: the sum of that over the axes.

    Raises:
        OpenMechanism: not all of these joints are possible.
    """
    steps = model.coupling.joints(np.diag((ways[1] - ways[0]) / 2.0))
    middle = q + model.coupling.joints((ways[0] + ways[1]) / 2.0)
    slopes = _slopes(model, middle)
    bulges = _bulges(model, middle, steps, np.linalg.norm(slopes, axis=-1).max(axis=(1, 2)))
    halves = np.linalg.norm(np.tensordot(steps, slopes, axes=1), axis=-1).max(axis=(1, 2))
    cuts = _cuts(halves, bulges)

    def at(shares: list[Array]) -> Array:
        return model.body_and_tcp(middle + np.stack(np.meshgrid(*shares, indexing="ij"), axis=-1) @ steps)

    centres = at([(2.0 * np.arange(cut) + 1.0) / cut - 1.0 for cut in cuts])
    corners = at([2.0 * np.arange(cut + 1) / cut - 1.0 for cut in cuts])
    farthest = np.zeros(cuts)
    for corner in itertools.product((0, 1), repeat=len(cuts)):
        mine = corners[tuple(slice(first, first + cut) for first, cut in zip(corner, cuts, strict=True))]
        np.maximum(farthest, np.linalg.norm(mine - centres, axis=-1).max(axis=(-2, -1)), out=farthest)
    growth = farthest.reshape(-1) + float((bulges / np.square(cuts)).sum())
    return centres.reshape(-1, *centres.shape[-3:]), growth


def _slopes(model: Model, q: Array) -> Array:
    """How far each end of a capsule, and the TCP, goes per unit of each joint: `(n, c + 1, 2, 3)` [m/rad or 1]."""
    steps = _STEP * np.eye(model.n)
    ends = model.body_and_tcp(np.stack([q - steps, q + steps]))
    return np.asarray((ends[1] - ends[0]) / (2.0 * _STEP))


def _bulges(model: Model, middle: Array, steps: Array, levers: Array) -> Array:
    """How far a point may leave the chord over each axis' range, `middle` plus and minus a row of `steps`: `(n,)` [m].

    A chord twice as long as that of `Model.bulge_m` is left by four times as much. Where joints carry each other, a
    point that turns by an angle about an axis leaves the chord by half of its square times its distance from that axis:
    `levers` `(n,)` [m] at the middle, changed by what the other joints move.
    """
    lines = np.stack([middle - steps, np.broadcast_to(middle, steps.shape), middle + steps], axis=1)
    plain = np.array([4.0 * float(model.bulge_m(line).max()) for line in lines])
    if not isinstance(model, SerialModel):
        return plain
    moved = levers * np.abs(steps).sum(axis=0)
    farthest = levers + 2.0 * (moved.sum() - moved)
    turned = np.abs(steps) * ~model.linear
    return np.asarray(np.minimum(plain, turned.sum(axis=1) * (turned @ farthest) / 2.0))


def _cuts(halves: Array, bulges: Array) -> list[int]:
    """Into how many cells each axis' range is cut: always that which adds the most to a cell's growth."""
    cuts = [1] * len(halves)
    while True:
        growth = halves / np.array(cuts) + bulges / np.square(cuts)
        most = int(np.argmax(growth))
        more = [cut + (axis == most) for axis, cut in enumerate(cuts)]
        if growth[most] <= BODY_GROWTH_M / 2.0 or math.prod(more) > _MOST_POSES:
            return cuts
        cuts = more
