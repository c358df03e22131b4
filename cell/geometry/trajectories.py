"""How near bodies come to each other along whole trajectories, without a look at every distance.

Boxes around stretches of samples leave out what is far away: whole bodies first, which often tell that nothing comes
near, then their capsules. Of the capsules that are left the distance in the middle of a stretch, less how far both go
from there, leaves out most of the rest. What remains is measured sample by sample. So what is found is the least of all
distances.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array
from cell.geometry.errors import WrongShape
from cell.geometry.segment import capsule_distance

_STRETCH = 20
"""Samples that are looked at as one."""
_AT_ONCE = 100
"""So many pairs of capsules are measured along their stretch before the least distance is looked at again."""
_BOXES = 2048
"""So many pairs of boxes are looked at together: more would leave the memory that is at hand."""
_ROUNDING_M = 1e-9
"""What only rounding leaves out is measured."""

Index = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class Nearest:
    """Two capsules of two bodies at one sample."""

    distance_m: float
    """Less their radii; at most 0 where they touch."""
    sample: int
    body: int
    capsule: int
    other_body: int
    other_capsule: int


def nearest_capsules(bodies: Sequence[Array], radii: Sequence[Array], within: float = np.inf) -> Nearest | None:
    """Where two of several bodies come nearest to each other at one sample; None where all stay beyond `within` [m].

    Args:
        bodies: for each its capsules `(m, c, 2, 3)` [m] at the same `m` samples in time; `c` may differ.
        radii: for each `(c,)` [m].
        within: farther apart is not looked for.

    It is the sooner known the less bodies move from sample to sample. Nothing is looked at between samples.

    Raises:
        WrongShape: fewer than two bodies, one of another shape, or one of other samples than the first.
    """
    _check(bodies, radii)
    if _apart(bodies, radii, within):
        return None
    sizes = [len(each) for each in radii]
    points = np.empty((len(bodies[0]), sum(sizes), 2, 3))
    np.concatenate(bodies, axis=1, out=points)
    way = _Way.of(points, np.concatenate([np.asarray(each, dtype=float) for each in radii]))
    starts = np.cumsum([0, *sizes[:-1]])
    low, high = np.minimum.reduceat(way.low, starts, axis=1), np.maximum.reduceat(way.high, starts, axis=1)
    one, other = np.triu_indices(len(sizes), 1)
    gaps = np.full((len(low), len(sizes), len(sizes)), np.inf)
    gaps[:, one, other] = _gaps(low[:, one], high[:, one], low[:, other], high[:, other])
    if gaps.min() > within:
        return None
    owner = np.repeat(np.arange(len(sizes)), sizes)
    first, second = np.triu_indices(len(owner), 1)
    others = owner[first] != owner[second]
    first, second = first[others], second[others]
    within = min(within, float(way.distance(np.array(len(points) // 2), first, second).min()) + _ROUNDING_M)
    stretch, pair = np.nonzero((gaps <= within)[:, owner[first], owner[second]])
    found = _least(way, stretch, first[pair], second[pair], within)
    if found is None:
        return None
    distance, sample, capsule, its = found
    body, other_body = int(owner[capsule]), int(owner[its])
    return Nearest(distance, sample, body, capsule - int(starts[body]), other_body, its - int(starts[other_body]))


def _check(bodies: Sequence[Array], radii: Sequence[Array]) -> None:
    if len(bodies) < 2 or len(bodies) != len(radii):
        raise WrongShape("bodies", (len(bodies),), f"two or more, as many as radii: {len(radii)}")
    for points, mine in zip(bodies, radii, strict=True):
        if np.shape(points) != (len(bodies[0]), len(mine), 2, 3) or np.size(points) == 0:
            raise WrongShape("body", np.shape(points), f"({len(bodies[0])}, {len(mine)}, 2, 3), neither number 0")


def _apart(bodies: Sequence[Array], radii: Sequence[Array], than: float) -> bool:
    """Whether boxes around bodies, each as thick all over as its thickest capsule, tell that all stay farther apart."""
    corners = np.empty((2, len(bodies), 3 * len(bodies[0])))
    for points, low, high in zip(bodies, *corners, strict=True):
        ends = points.transpose(1, 2, 0, 3).reshape(-1, corners.shape[-1])  # no copy of what a model gives
        ends.min(axis=0, out=low)
        ends.max(axis=0, out=high)
    by_axis = np.ascontiguousarray(corners.reshape(2, len(bodies), -1, 3).transpose(0, 3, 1, 2))
    starts, thick = np.arange(0, len(bodies[0]), _STRETCH), np.array([max(each) for each in radii])[:, None]
    low = np.minimum.reduceat(by_axis[0], starts, axis=-1) - thick
    high = np.maximum.reduceat(by_axis[1], starts, axis=-1) + thick
    one, other = np.array(list(combinations(range(len(bodies)), 2))).T
    gaps = _gaps(low[:, one].T, high[:, one].T, low[:, other].T, high[:, other].T)
    return bool(gaps.min() > than)


@dataclass(frozen=True, slots=True, eq=False)
class _Way:
    """Capsules, and the boxes around each in `b` stretches."""

    points: Array
    radii: Array
    lows: Array
    """`(b, c, 2, 3)` [m] least coordinates of each end."""
    highs: Array
    low: Array
    """`(b, c, 3)` [m] of the boxes around capsules, radii included."""
    high: Array

    @classmethod
    def of(cls, points: Array, radii: Array) -> Self:
        lows, highs = _stretches(np.minimum, points), _stretches(np.maximum, points)
        low, high = np.minimum(lows[:, :, 0], lows[:, :, 1]), np.maximum(highs[:, :, 0], highs[:, :, 1])
        return cls(points, radii, lows, highs, low - radii[:, None], high + radii[:, None])

    def middle(self, stretch: Index) -> Index:
        """The sample in the middle of each stretch."""
        return np.minimum(stretch * _STRETCH + _STRETCH // 2, len(self.points) - 1)

    def beyond(self) -> Array:
        """No end of a capsule is farther from where it is in the middle of a stretch: `(b, c)` [m]."""
        middle = self.points[self.middle(np.arange(len(self.lows)))]
        away = np.maximum(self.highs - middle, middle - self.lows)
        return np.asarray(np.sqrt(np.einsum("bcex,bcex->bce", away, away).max(axis=-1)))

    def distance(self, samples: Index, one: Index, other: Index) -> Array:
        """Of capsules at samples, which broadcast [m]."""
        radii = self.radii
        return capsule_distance(self.points[samples, one], radii[one], self.points[samples, other], radii[other])


def _stretches(least: np.ufunc, points: Array) -> Array:
    """`least` of each stretch; the last one may be shorter."""
    flat, whole = points.reshape(len(points), -1), len(points) // _STRETCH * _STRETCH
    found = least.reduce(flat[:whole].reshape(-1, _STRETCH, flat.shape[1]), axis=1)
    if whole < len(flat):
        found = np.concatenate([found, least.reduce(flat[whole:], axis=0)[None]])
    return np.asarray(found.reshape(-1, *points.shape[1:]))


def _least(way: _Way, stretch: Index, one: Index, other: Index, within: float) -> tuple[float, int, int, int] | None:
    """The least distance of capsules `one` and `other` in these stretches, at which sample and of which; None: none."""
    beyond, bounds = way.beyond(), np.full(len(stretch), np.inf)
    for start in range(0, len(stretch), _BOXES):
        part = slice(start, start + _BOXES)
        boxes = (side[stretch[part], each[part]] for each in (one, other) for side in (way.low, way.high))
        some = start + np.flatnonzero(_gaps(*boxes) <= within)
        middle = way.distance(way.middle(stretch[some]), one[some], other[some])
        within = min(within, float(middle.min(initial=np.inf)) + _ROUNDING_M)
        bounds[some] = middle - beyond[stretch[some], one[some]] - beyond[stretch[some], other[some]] - _ROUNDING_M
    order = np.argsort(bounds)[: int(np.count_nonzero(bounds <= within))]
    found = None
    for start in range(0, len(order), _AT_ONCE):
        some = order[start : start + _AT_ONCE]
        some = some[bounds[some] <= within]
        if not len(some):
            break
        samples = np.minimum(stretch[some, None] * _STRETCH + np.arange(_STRETCH), len(way.points) - 1)
        distances = way.distance(samples, one[some, None], other[some, None])
        row, column = np.unravel_index(int(distances.argmin()), distances.shape)
        if distances[row, column] <= within:
            within = float(distances[row, column])
            found = within, int(samples[row, column]), int(one[some[row]]), int(other[some[row]])
    return found


def _gaps(low: Array, high: Array, other_low: Array, other_high: Array) -> Array:
    """Distance `(...)` [m] of boxes from boxes, less for rounding; minus infinity if they overlap."""
    apart = np.maximum(low - other_high, other_low - high)
    np.maximum(apart, 0.0, out=apart)
    far = np.sqrt(np.einsum("...k,...k", apart, apart))
    return np.asarray(np.where(far > 0.0, far - _ROUNDING_M, -np.inf))
