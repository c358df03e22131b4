"""The exact distance between line segments, and so between capsules."""

import math
from collections.abc import Callable

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.errors import WrongShape

_AT_ONCE = 2048
"""So many pairs fit into the nearest memory of a processor with all that is computed from them."""

_THIRDINGS = 80
"""Of the part of a segment in which a least value lies: enough for the bits of a float."""


def least_along(segments: Array, value: Callable[[Array], Array]) -> Array:
    """The least `value` `(m,)` of the points `(m, 3)` of each segment `(m, 2, 3)`; it must be convex along them."""
    start, way = segments[:, 0], segments[:, 1] - segments[:, 0]
    low, high = np.zeros(len(segments)), np.ones(len(segments))
    for _ in range(_THIRDINGS):
        third = (high - low) / 3.0
        left, right = low + third, high - third
        falls = value(start + left[:, None] * way) > value(start + right[:, None] * way)
        low, high = np.where(falls, left, low), np.where(falls, high, right)
    return np.minimum(value(start + low[:, None] * way), np.minimum(value(start), value(segments[:, 1])))


def segment_distance(first: Array, second: Array) -> Array:
    """Distance `(...)` [m] between segments `(..., 2, 3)`, start and end point each; both broadcast.

    Exact to rounding, also where segments are parallel or nearly so, in one line, touching, or points. The place on
    the line of the first that is closest comes from cross products, which small angles do not spoil, and is brought
    into its segment; then the closest place of the second is found for that one, and once more the first for the second
    (Ericson, Real-Time Collision Detection, 5.1.9). To bring both places into their segments at once, or to leave one
    of parallel lines at its start, gives too long a distance.

    Raises:
        WrongShape: one of them is no array of segments.
    """
    first, second = _segments(first, "first"), _segments(second, "second")
    shape = np.broadcast_shapes(first.shape, second.shape)
    pairs = math.prod(shape[:-2])
    if pairs <= _AT_ONCE:
        return _distance(*(each.reshape((1,) * (len(shape) - each.ndim) + each.shape) for each in (first, second)))
    one, other = (np.broadcast_to(each, shape).reshape(-1, 2, 3) for each in (first, second))
    parts = [slice(start, start + _AT_ONCE) for start in range(0, pairs, _AT_ONCE)]
    return np.concatenate([_distance(one[part], other[part]) for part in parts]).reshape(shape[:-2])


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


def _distance(first: Array, second: Array) -> Array:
    pairs = first.ndim - 2
    order = pairs, pairs + 1, *range(pairs)
    a, b = (np.ascontiguousarray(each.transpose(order)) for each in (first, second))
    u, v, w = a[1] - a[0], b[1] - b[0], b[0] - a[0]
    uu, vv, uv, uw, vw = _dot(u, u), _dot(v, v), _dot(u, v), _dot(u, w), _dot(v, w)
    normal = _cross(u, v)
    with np.errstate(over="ignore"):
        s = _share(_dot(_cross(w, v), normal), _dot(normal, normal))
        t = _share(uv * s - vw, vv)
        s = _share(uv * t + uw, uu)
    away = w + t * v - s * u
    return np.asarray(np.sqrt(_dot(away, away)))


def _share(way: Array, whole: Array) -> Array:
    """`way / whole` in 0 to 1; 0 where there is no whole."""
    share = np.zeros(way.shape)
    np.divide(way, whole, out=share, where=whole > 0.0)
    return np.asarray(np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share))


Parts = Array | tuple[Array, Array, Array]


def _dot(a: Parts, b: Parts) -> Array:
    """Of vectors `(3, ...)`."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def _cross(a: Array, b: Array) -> Parts:
    """Of vectors `(3, ...)`."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
