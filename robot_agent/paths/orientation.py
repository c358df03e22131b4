"""Orientation along a path: turns at a constant rate, one after the other, blended so that the rate never jumps."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cell.geometry.quaternion import from_matrix

Numbers = NDArray[np.float64]

_STEP_M, _STEP_SHARE = 2e-5, 1e-3
"""Of the differences that give the angular velocity: at most so far, and so much of the window."""
_HALF_TURN_RAD = 2e-5
"""A turn that is half a turn to within this, 0.001 deg, has no shorter way: rounding would choose one."""
_SAME = 1e-4
"""Cosines and sines of A, B, C that differ by less are equal, and a cosine of B below it is zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Turn:
    """`rotation` `(3, 3)` at distance `anchor_m`, turning about `axis` `(3,)` of the base by `rate_rad_m`."""

    rotation: Numbers
    axis: Numbers
    rate_rad_m: float
    anchor_m: float

    def at(self, distance_m: Numbers) -> Numbers:
        """Rotations `(..., 3, 3)` at `distance_m` `(...)`; the turn goes on outside its own part of the path."""
        return turned(self.axis, self.rate_rad_m * (np.asarray(distance_m) - self.anchor_m)) @ self.rotation

    @property
    def velocity(self) -> Numbers:
        """`(3,)` [rad/m]"""
        return self.rate_rad_m * self.axis


@dataclass(frozen=True, slots=True)
class Window:
    """Where one turn passes into the next."""

    first_m: float
    last_m: float


@dataclass(frozen=True, eq=False)
class Orientation:
    """Turns in order; `windows[k]` leads from turn k to turn k + 1 and they do not overlap.

    Inside a window the orientation is the way from one turn to the other, by a share that rises smoothly. Where both
    turns meet inside the window the orientation is exactly theirs there: blending costs no deviation at a via point.
    """

    turns: tuple[Turn, ...]
    windows: tuple[Window, ...]

    def at(self, distance_m: Numbers) -> Numbers:
        """Rotations `(..., 3, 3)` at `distance_m` `(...)`."""
        at = np.asarray(distance_m, dtype=np.float64)
        rotations = self._turned(self._turn_at(at), at)
        inside, window = self._inside(at)
        if inside.any():
            rotations[inside] = self._blended(window, at[inside])
        return rotations

    def states(self, distance_m: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Rotations, angular velocity per distance `(k, 3)` and its derivative, at distances `(k,)`."""
        _, axes, rates, _ = self._stacked
        turn = self._turn_at(distance_m)
        rotations, spin = self._turned(turn, distance_m), rates[turn, None] * axes[turn]
        change = np.zeros_like(spin)
        inside, window = self._inside(distance_m)
        if inside.any():
            step = np.minimum(_STEP_M, _STEP_SHARE * np.diff(self._borders[:, window], axis=0)[0])
            around = distance_m[inside] + np.stack([0.0 * step, step, -step])
            here, *near = self._blended(window, around)
            forth, back = _small_rotation_vectors(np.stack(near) @ np.swapaxes(here, -1, -2))
            rotations[inside] = here
            step = step[:, None]
            spin[inside], change[inside] = (forth - back) / (2.0 * step), (forth + back) / step**2
        return rotations, spin, change

    def _turn_at(self, at: Numbers) -> NDArray[np.intp]:
        """The number of the turn that counts at distances `(...)`."""
        return np.searchsorted(self._borders.mean(axis=0), at, side="right")

    def _inside(self, at: Numbers) -> tuple[NDArray[np.bool_], NDArray[np.intp]]:
        """Which distances `(...)` are inside a window, and the number of that of each of these."""
        if not self.windows:
            return np.zeros(at.shape, dtype=np.bool_), np.zeros(0, dtype=np.intp)
        first, last = self._borders
        window = np.maximum(np.searchsorted(first, at) - 1, 0)
        inside = (at > first[window]) & (at < last[window])
        return inside, window[inside]

    def _blended(self, window: NDArray[np.intp], at: Numbers) -> Numbers:
        """Rotations `(..., k, 3, 3)` at distances `(..., k)` inside windows `(k,)`."""
        first, last = self._borders[:, window]
        share = smooth((at - first) / (last - first))
        before, after = (self._turned(np.broadcast_to(k, at.shape), at) for k in (window, window + 1))
        return between(before, after, share)

    def _turned(self, turn: NDArray[np.intp], at: Numbers) -> Numbers:
        """Rotations `(..., 3, 3)` of the turns with these numbers `(...)` at distances `(...)`."""
        rotations, axes, rates, anchors = self._stacked
        return turned(axes[turn], rates[turn] * (at - anchors[turn])) @ rotations[turn]

    @cached_property
    def _stacked(self) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Rotation, axis, rate and anchor of all turns."""
        each = [(turn.rotation, turn.axis, turn.rate_rad_m, turn.anchor_m) for turn in self.turns]
        rotations, axes, rates, anchors = zip(*each, strict=True)
        return np.array(rotations), np.array(axes), np.array(rates), np.array(anchors)

    @cached_property
    def _borders(self) -> Numbers:
        """`(2, windows)` where each window begins and ends."""
        return np.array([(window.first_m, window.last_m) for window in self.windows]).reshape(-1, 2).T


def smooth(x: Numbers) -> Numbers:
    """From 0 to 1 with four derivatives that vanish at both ends.

    A window ends far from the border of two turns, where the robot is fast: there the third derivative of the
    orientation, which costs jerk, has to be small. Two derivatives would do to be continuous, but take longer.
    """
    return x**5 * (126.0 + x * (-420.0 + x * (540.0 + x * (-315.0 + x * 70.0))))


_SHARES = np.linspace(0.0, 1.0, 1001)
_SYMMETRIC = float((smooth(_SHARES) * np.abs(0.5 - _SHARES))[:501].max())
_ONE_SIDED = float((smooth(_SHARES) * (1.0 - _SHARES)).max())


def swing(before: Turn, after: Turn, width_m: float, one_sided: bool = False) -> float:
    """How far [rad] a window takes the orientation from the turn that counts there, for small angles.

    Before the middle that is `before`, after it `after`; in a one-sided window it is `after` from the first place on.
    """
    step = float(np.linalg.norm(after.velocity - before.velocity))
    return (_ONE_SIDED if one_sided else _SYMMETRIC) * step * width_m


def between(before: Numbers, after: Numbers, share: Numbers) -> Numbers:
    """Rotations `(..., 3, 3)`, `share` `(...)` of the shortest way from `before` to `after`."""
    way = rotation_vectors(after @ np.swapaxes(before, -1, -2)) * share[..., None]
    angle = np.linalg.norm(way, axis=-1)
    step = turned(way / np.where(angle > 0.0, angle, 1.0)[..., None], angle)
    return np.asarray(step @ before)


def rotation_vectors(rotations: Numbers) -> Numbers:
    """Axis times angle [rad] `(..., 3)` of rotations `(..., 3, 3)`, the angle at most pi."""
    quaternion = from_matrix(rotations)
    sine = np.linalg.norm(quaternion[..., :3], axis=-1)
    angle = 2.0 * np.arctan2(sine, quaternion[..., 3])
    angle = np.where(angle > np.pi, angle - 2.0 * np.pi, angle)
    return np.asarray(quaternion[..., :3] * (angle / np.where(sine > 0.0, sine, 1.0))[..., None])


def _small_rotation_vectors(rotations: Numbers) -> Numbers:
    """The same for angles far below 1 rad: what is not symmetric of a rotation is its axis times the sine."""
    sines = np.stack([rotations[..., i, j] - rotations[..., j, i] for i, j in ((2, 1), (0, 2), (1, 0))], axis=-1) / 2.0
    return np.asarray(sines * (1.0 + (sines * sines).sum(axis=-1, keepdims=True) / 6.0))


def axis_angle(rotation: Numbers) -> tuple[Numbers, float]:
    """Unit axis `(3,)` and angle [rad] in 0 to pi of a rotation `(3, 3)`."""
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = rotation.tolist()
    sines, cosine = ((zy - yz) / 2.0, (xz - zx) / 2.0, (yx - xy) / 2.0), (xx + yy + zz - 1.0) / 2.0
    sine = math.hypot(*sines)
    if cosine > 0.0:
        return (np.array(sines) / sine, math.atan2(sine, cosine)) if sine > 0.0 else (np.array([0.0, 0.0, 1.0]), 0.0)
    vector = rotation_vectors(rotation)  # beyond a right angle the sine says less and less
    angle = float(np.linalg.norm(vector))
    return vector / angle, angle


def turn_between(before: Numbers, after: Numbers) -> tuple[Numbers, float]:
    """Unit axis `(3,)` and angle [rad] of the way from orientation `before` to `after`, both `(3, 3)`.

    It is the shorter way. Of half a turn, where both are as long, it is the one on which C is half-way nearer to 0 than
    to 180 deg, and 90 rather than -90 deg; where both have the same C there the same holds for A, and then B is 90 deg.
    The way back is the way there, reversed, so a loop does not wind up. Angles slightly above pi come from that.
    """
    axis, angle = axis_angle(after @ before.T)
    if not _is_half(angle):
        return axis, angle
    half_way = (turned(axis, np.array(turn)) @ before for turn in (angle / 2.0, angle / 2.0 - math.pi))
    for this, other in zip(*(_order(rotation) for rotation in half_way), strict=True):
        if abs(this - other) > _SAME:
            return (axis, angle) if this > other else (-axis, math.tau - angle)
    return axis, angle


def is_half_turn(before: Numbers, after: Numbers) -> bool:
    """Whether both ways from orientation `before` to `after` `(3, 3)` are as long, as far as a person can tell."""
    return _is_half(axis_angle(after @ before.T)[1])


def _is_half(angle: float) -> bool:
    return abs(angle - math.pi) < _HALF_TURN_RAD


def _order(rotation: Numbers) -> tuple[float, ...]:
    """By what two orientations half-way are compared: cosine and sine of C, of A, and the sine of B."""
    (xx, xy, _), (yx, yy, _), (zx, zy, zz) = rotation.tolist()
    upright = math.hypot(xx, yx) < _SAME  # B is 90 or -90 deg: only A and C together are known, A counts as 0
    c, a = (math.atan2(-xy, yy), 0.0) if upright else (math.atan2(yx, xx), math.atan2(zy, zz))
    return math.cos(c), math.sin(c), math.cos(a), math.sin(a), -zx


def turned(axis: Numbers, angle: Numbers) -> Numbers:
    """Rotations `(..., 3, 3)` by `angle` `(...)` about unit axes `(..., 3)`, or one `(3,)` (Rodrigues)."""
    angle = np.asarray(angle)
    x, y, z = axis[..., 0], axis[..., 1], axis[..., 2]
    cosine, sine = np.cos(angle), np.sin(angle)
    # 2 sin^2(a/2) is 1 - cos(a) without its cancellation near zero
    rest = 2.0 * np.sin(angle / 2.0) ** 2
    rotation = np.empty((*angle.shape, 3, 3))
    rotation[..., 0, 0], rotation[..., 1, 1], rotation[..., 2, 2] = (cosine + rest * each * each for each in (x, y, z))
    for row, column, one, other, third in ((0, 1, x, y, z), (1, 2, y, z, x), (2, 0, z, x, y)):
        both, own = rest * one * other, sine * third
        rotation[..., row, column], rotation[..., column, row] = both - own, both + own
    return rotation
