"""The exact distance between line segments, and so between capsules."""

import math

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.errors import WrongShape

_AT_ONCE = 2048
"""So many pairs fit into the nearest memory of a processor with all that is computed from them."""

_NARROW, _NOTHING, _BACK = np.array(1e-6), np.array(np.finfo(float).tiny), np.array(-1.0)
"""Squared sine of an angle: from wider ones on, products of lengths tell lines that cross as exactly as vectors do.

As arrays, which numpy takes sooner than numbers.
"""
_NONE = np.zeros(_AT_ONCE)
"""For each pair, which numpy compares sooner than with one number for all."""


def least_height(heights: Array) -> Array:
    """How far segments `(m,)` reach into what lies below planes, from `heights` `(m, 2, k)` of both ends above each.

    It is the least, along a segment, of what is highest there, which is convex. Where a line that falls and one that
    rises meet, no place is lower than that; the line that is highest there takes the place of one of both, until it is
    one of them.
    """
    start, rise = heights[:, 0], heights[:, 1] - heights[:, 0]
    rows, left, right = np.arange(len(heights)), start.argmax(axis=1), heights[:, 1].argmax(axis=1)
    least = heights.max(axis=2).min(axis=1)
    for _ in range(heights.shape[2]):
        falls, rises = rise[rows, left], rise[rows, right]
        meet = (falls < 0.0) & (rises > 0.0)
        share = (start[rows, left] - start[rows, right]) / np.where(meet, rises - falls, 1.0)
        here = start + np.where(meet, share, 0.0)[:, None] * rise
        highest = here.argmax(axis=1)
        np.minimum(least, here[rows, highest], out=least)
        if (~meet | (highest == left) | (highest == right)).all():
            break
        down = rise[rows, highest] < 0.0
        left, right = np.where(down, highest, left), np.where(down, right, highest)
    return np.asarray(least)


def segment_distance(first: Array, second: Array) -> Array:
    """Distance `(...)` [m] between segments `(..., 2, 3)`, start and end point each; both broadcast.

    Exact to rounding, also where segments are parallel or nearly so, in one line, touching, or points. The place on
    the line of the first that is closest comes from the parts across the second where an angle is small, and is brought
    into its segment; then the closest place of the second is found for that one, and once more the first for the second
    (Ericson, Real-Time Collision Detection, 5.1.9). To bring both places into their segments at once, or to leave one
    of parallel lines at its start, gives too long a distance.

    Raises:
        WrongShape: one of them is no array of segments.
    """
    first, second = _segments(first, "first"), _segments(second, "second")
    shape = first.shape if first.shape == second.shape else np.broadcast_shapes(first.shape, second.shape)
    pairs = math.prod(shape[:-2])
    if pairs <= _AT_ONCE:
        return _distance(first, second, shape[:-2]).reshape(shape[:-2])
    one, other = (np.broadcast_to(each, shape).reshape(-1, 2, 3) for each in (first, second))
    parts = [slice(start, min(start + _AT_ONCE, pairs)) for start in range(0, pairs, _AT_ONCE)]
    found = [_distance(one[part], other[part], (part.stop - part.start,)) for part in parts]
    return np.concatenate(found).reshape(shape[:-2])


def capsule_distance(first: Array, first_radii: Array, second: Array, second_radii: Array) -> Array:
    """Distance `(...)` [m] between capsules; they touch exactly where it is at most 0.

    Args:
        first: end points `(..., 2, 3)` [m]; all four arguments broadcast.
        first_radii: `(...)` [m].
        second: as `first`.
        second_radii: as `first_radii`.

    Below zero it is the depth only where the axes are apart; axes that cross have minus both radii.

    Raises:
        WrongShape: end points of another shape.
    """
    return np.asarray(segment_distance(first, second) - first_radii - second_radii)


def _segments(points: Array, which: str) -> Array:
    points = np.asarray(points, dtype=float)
    if points.shape[-2:] != (2, 3):
        raise WrongShape(f"{which} segments", points.shape, "(..., 2, 3)")
    return points


def _distance(first: Array, second: Array, batch: tuple[int, ...]) -> Array:
    """Of segments that broadcast to `(*batch, 2, 3)`, `(n,)` pair by pair.

    All four ends in one row, that of the first segment before its start, differ by `u`, along the first, `w`, to the
    start of the second, and `v`, along the second. So the way from a place on the first to one on the second is
    w - s u - t v, both `s` and `t` between -1 and 0.

    No quotient overflows for lengths below 1e77 m: each divisor is a square of what its dividend is a multiple of.
    """
    ends = np.empty((2, 2, 3, *batch))
    in_order = *range(2, 2 + len(batch)), 0, 1
    ends[0].transpose(in_order)[...] = first[..., ::-1, :]
    ends[1].transpose(in_order)[...] = second
    ends = ends.reshape(4, 3, -1)
    ways = ends[1:] - ends[:-1]
    with_u, with_v = np.einsum("ikn,jkn->ijn", ways[::2], ways)
    uu, uv, vv = with_u[0], with_u[2], with_v[2]
    crossing = with_u[:2] * vv
    narrow = _NARROW * crossing[0]
    crossing -= uv * with_v[:2]
    if (crossing[0] <= narrow).nonzero()[0].size:
        for whole in (uu, vv):
            np.maximum(whole, _NOTHING, out=whole)
        across = ways[:2] - (with_v[:2] / vv)[:, None] * ways[2]
        crossing = np.einsum("ikn,kn->in", across, across[0])
        np.maximum(crossing[0], _NOTHING, out=crossing[0])
    places = np.empty((3, len(uu)))
    s, back, t = places
    back[...] = _BACK
    np.divide(crossing[1], crossing[0], out=s)
    _bring_in(s, back)
    np.multiply(uv, s, out=t)
    np.subtract(with_v[1], t, out=t)
    t /= vv
    _bring_in(t, back)
    np.multiply(uv, t, out=s)
    np.subtract(with_u[1], s, out=s)
    s /= uu
    _bring_in(s, back)
    apart = np.einsum("ikn,in->kn", ways, places)
    apart *= apart
    square = apart[0]
    square += apart[1]
    square += apart[2]
    return np.asarray(np.sqrt(square, out=square))


def _bring_in(share: Array, back: Array) -> None:
    """Shares below -1 to `back`, and those above 0 to that."""
    np.maximum(share, back, out=share)
    np.minimum(share, _NONE[: len(share)], out=share)
