"""The exact distance between line segments, and so between capsules."""

import math
from collections.abc import Callable

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.errors import WrongShape

_AT_ONCE = 2048
"""So many pairs fit into the nearest memory of a processor with all that is computed from them."""

_NARROW = 1e-6
"""Squared sine of an angle; from wider ones on, products of lengths tell lines that cross as exactly as vectors do."""
_NONE, _ALL, _NOTHING = np.array(0.0), np.array(1.0), np.array(np.finfo(float).tiny)
"""As arrays, which numpy takes sooner than numbers."""

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
    the line of the first that is closest comes from cross products where an angle is small, and is brought into its
    segment; then the closest place of the second is found for that one, and once more the first for the second
    (Ericson, Real-Time Collision Detection, 5.1.9). To bring both places into their segments at once, or to leave one
    of parallel lines at its start, gives too long a distance.

    Raises:
        WrongShape: one of them is no array of segments.
    """
    first, second = _segments(first, "first"), _segments(second, "second")
    shape = np.broadcast_shapes(first.shape, second.shape)
    pairs = math.prod(shape[:-2])
    if pairs <= _AT_ONCE:
        ndim = max(len(shape), 3)
        alike = (each.reshape((1,) * (ndim - each.ndim) + each.shape) for each in (first, second))
        return _distance(*alike).reshape(shape[:-2])
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
    whole = uu * vv
    narrow = _NARROW * whole
    whole -= uv * uv
    if (whole >= narrow).all():
        s = uw * vv
        s -= uv * vw
    else:
        normal = _cross(u, v)
        s, whole = _dot(_cross(w, v), normal), _dot(normal, normal)
    with np.errstate(over="ignore"):
        s = _share(s, whole)
        t = uv * s
        t -= vw
        t = _share(t, vv)
        s = uv * t
        s += uw
        s = _share(s, uu)
    w += t * v
    w -= s * u
    square = _dot(w, w)
    return np.asarray(np.sqrt(square, out=square))


def _share(way: Array, whole: Array) -> Array:
    """`way / whole` in 0 to 1, in place of `way`; 0 where there is no whole, for then there is no way."""
    way /= np.maximum(whole, _NOTHING)
    np.maximum(way, _NONE, out=way)
    return np.asarray(np.minimum(way, _ALL, out=way))


def _dot(a: Array, b: Array) -> Array:
    """Of vectors `(3, ...)`."""
    products = a * b
    total: Array = products[0]
    total += products[1]
    total += products[2]
    return total


def _cross(a: Array, b: Array) -> Array:
    """Of vectors `(3, ...)`."""
    cross = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, i, j in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        np.multiply(a[i], b[j], out=cross[k])
        cross[k] -= a[j] * b[i]
    return cross
