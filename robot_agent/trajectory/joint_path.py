"""What the joints do along a path, whatever block it comes from: the geometry that is timed.

The parameter is the length of the joints' own way, each joint weighted by its speed limit [s]: no joint moves faster
by it than its limit. It never stalls, not even where the flange turns on the spot or the wrist is nearly singular, and
two paths join smoothly exactly where tangent and curvature by it agree: that is what the joints feel.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.paths.curves import hermite
from robot_agent.paths.pose_path import BLEND_TOLERANCE_M, TANGENT_RAD, Blend
from robot_agent.trajectory.flange_way import with_flange
from robot_agent.trajectory.pieces import Pieces

Numbers = NDArray[np.float64]

_STEP_OF_CURVATURE = 1e-6
_FLANGE_SAMPLES = 65


@dataclass(frozen=True, slots=True)
class Stretch:
    """Up to parameter `end`: block `block`, its caps, and whether the limits of the flange's path hold."""

    end: float
    block: int
    joint_speed: float
    """Fraction of the joints' speed limits."""
    speed_m_s: float
    rotation_rad_s: float
    on_path: bool
    joint_rad_s: float = np.inf
    """Cap on the speed of the joints that turn, the root of the sum of their squares."""

    @property
    def capped(self) -> bool:
        """Whether the flange has a cap of its own."""
        return min(self.speed_m_s, self.rotation_rad_s) < np.inf


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """`pieces` over the parameter: `n` joints, then the flange's way [m] and turn [rad] (constant where unused)."""

    pieces: Pieces
    stretches: tuple[Stretch, ...]
    curvature: Numbers
    """`(k, 2)` parameter and curvature [1/m] of the flange's way, rising."""
    blends: tuple[Blend, ...]
    corner_lengths: tuple[float, float]
    """Parameters of the first block's end and the last block's start: a corner takes at most half of these blocks."""
    round_m: float | None
    """Of the corner behind this path, as in the block."""

    @property
    def length(self) -> float:
        return self.pieces.duration_s

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.pieces.coefficients.shape[2]) - 2

    def end(self) -> Numbers:
        """Joints `(n,)` at the end."""
        return self.pieces.position(np.array(self.length))[: self.joints]

    def state(self, at: float) -> Numbers:
        """Value, first and second derivative `(3, n)` of the joints."""
        return self.pieces.shape(np.array(at))[:3, : self.joints]

    def later(self, blocks: int) -> "JointPath":
        """The same with so many blocks before its own."""
        return replace(
            self,
            stretches=tuple(replace(each, block=each.block + blocks) for each in self.stretches),
            blends=tuple(replace(each, block=each.block + blocks) for each in self.blends),
        )

    def part(self, first: float, last: float) -> "JointPath":
        """The path from parameter `first` to `last`."""
        ends = [replace(each, end=min(each.end, last) - first) for each in self.stretches]
        kept = [each for k, each in enumerate(ends) if each.end > (0.0 if k == 0 else max(ends[k - 1].end, 0.0))]
        inside = (self.curvature[:, 0] >= first) & (self.curvature[:, 0] <= last)
        curvature = self.curvature[inside] - np.array([first, 0.0])
        head, tail = self.corner_lengths
        return replace(
            self,
            pieces=self.pieces.part(first, last),
            stretches=tuple(kept),
            curvature=curvature,
            corner_lengths=(head - first, tail - first),
        )


def joined(first: JointPath, second: JointPath) -> JointPath:
    """Both paths one after the other."""
    offset = first.length
    later = [replace(each, end=each.end + offset) for each in second.stretches]
    return JointPath(
        Pieces.joined([first.pieces, second.pieces]),
        (*first.stretches, *later),
        np.concatenate([first.curvature, second.curvature + np.array([offset, 0.0])]),
        (*first.blends, *second.blends),
        (first.corner_lengths[0], second.corner_lengths[1] + offset),
        second.round_m,
    )


def connected(model: Model, velocity: Numbers, first: JointPath, second: JointPath) -> JointPath | None:
    """One path out of two that meet without a stop: tangential, or with a round edge; None where the robot stops.

    `velocity` `(n,)` are the joints' speed limits.
    """
    if first.round_m == 0.0:
        return None
    before, after = first.state(first.length), second.state(0.0)
    kink, step = (float(np.linalg.norm((after[k] - before[k]) / velocity)) for k in (1, 2))
    if kink <= TANGENT_RAD:
        return _blended(model, first, second) if kink > 1e-9 or step > _STEP_OF_CURVATURE else joined(first, second)
    if first.round_m is None or kink > 1.99:
        return None
    return _rounded(model, first, second, first.round_m)


def _rounded(model: Model, first: JointPath, second: JointPath, round_m: float) -> JointPath:
    """The corner cut where the flange is `round_m` away from it, or half of the shorter block.

    Between two joint moves this is the quartic round edge, in joint space; both sides are cut by the same length of the
    joints' way, the shorter one deciding.
    """
    back = _flange_way(model, first, first.length, (first.corner_lengths[1] + first.length) / 2.0)
    ahead = _flange_way(model, second, 0.0, second.corner_lengths[0] / 2.0)
    cut = min(float(np.interp(round_m, side[1], side[0])) for side in (back, ahead))
    return _bridge(model, first, second, cut)


def _blended(model: Model, first: JointPath, second: JointPath) -> JointPath:
    """The step of the curvature spread over as much of both paths as the tolerance allows."""
    wide = 0.45 * min(first.length - first.corner_lengths[1], second.corner_lengths[0])
    for _ in range(8):
        bridge = _bridge(model, first, second, wide)
        away = _deviation(model, first, second, bridge, wide)
        if away <= BLEND_TOLERANCE_M:
            break
        wide *= min(0.7, 0.95 * float(np.sqrt(BLEND_TOLERANCE_M / away)))
    return replace(bridge, blends=(*bridge.blends, Blend(second.stretches[0].block, away)))


def _bridge(model: Model, first: JointPath, second: JointPath, cut: float) -> JointPath:
    """The last `cut` of the first path and the first `cut` of the second replaced by a quintic with the same ends."""
    start, stop, length = first.length - cut, cut, 2.0 * cut
    scale = np.array([1.0, length, length**2])[:, None]
    shape = hermite(first.state(start) * scale, second.state(stop) * scale)
    joints = Pieces(np.array([0.0, length]), (shape / length ** np.arange(6.0)[:, None])[None])
    pieces, curvature = with_flange(model, joints)
    edge, after = first.stretches[-1], second.stretches[0]
    share, cap = min(edge.joint_speed, after.joint_speed), min(edge.joint_rad_s, after.joint_rad_s)
    middle = Stretch(length / 2.0, edge.block, share, np.inf, np.inf, on_path=False, joint_rad_s=cap)
    if edge.on_path and after.on_path:
        speed, rotation = min(edge.speed_m_s, after.speed_m_s), min(edge.rotation_rad_s, after.rotation_rad_s)
        middle = replace(middle, speed_m_s=speed, rotation_rad_s=rotation, on_path=True)
    stretches = (middle, replace(middle, end=length, block=after.block))
    path = JointPath(pieces, stretches, curvature, (), (length, 0.0), None)
    whole = joined(joined(first.part(0.0, start), path), second.part(stop, second.length))
    head = min(first.corner_lengths[0], start)
    return replace(whole, corner_lengths=(head, whole.corner_lengths[1]))


def _flange_way(model: Model, path: JointPath, corner: float, far: float) -> Numbers:
    """Distance by parameter and along the flange's way `(2, k)` from the corner, rising."""
    at = np.linspace(corner, far, _FLANGE_SAMPLES)
    places = model.forward(path.pieces.position(at)[:, : path.joints])[:, :3, 3]
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    return np.stack([np.abs(at - corner), np.append(0.0, np.cumsum(steps))])


def _deviation(model: Model, first: JointPath, second: JointPath, bridge: JointPath, wide: float) -> float:
    """Largest distance [m] of the flange from where it would be without the bridge, across its way."""
    along = np.linspace(-wide, wide, 33)
    start = first.length - wide
    cut = bridge.pieces.position(start + np.linspace(0.0, 2.0 * wide, 33))[:, : first.joints]
    before = first.pieces.position(first.length + np.minimum(along, 0.0))[:, : first.joints]
    after = second.pieces.position(np.maximum(along, 0.0))[:, : first.joints]
    nominal = np.where(along[:, None] < 0.0, before, after)
    way = model.forward(cut)[:, :3, 3] - model.forward(nominal)[:, :3, 3]
    along_way = np.gradient(model.forward(nominal)[:, :3, 3], axis=0)
    along_way /= np.maximum(np.linalg.norm(along_way, axis=1), 1e-12)[:, None]
    way = way - along_way * (way * along_way).sum(axis=1, keepdims=True)
    return float(np.linalg.norm(way, axis=1).max())
