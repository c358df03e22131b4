"""The exact distance between line segments, and so between capsules."""

from collections.abc import Callable

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.errors import WrongShape

_PARALLEL = 1e-12
"""Below this squared sine two directions count as parallel; the ends of the segments then decide."""

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

    The squared distance is convex in the places on both segments, so its least value is where both lines are closest,
    if that lies inside both segments, or else at an end of one of them.
    """
    first, second = np.asarray(first, dtype=float), np.asarray(second, dtype=float)
    for what, points in (("first", first), ("second", second)):
        if points.shape[-2:] != (2, 3):
            raise WrongShape(f"{what} segments", points.shape, "(..., 2, 3)")
    first, second = np.broadcast_arrays(first, second)
    ends = [_point_distance(first[..., i, :], second) for i in (0, 1)]
    ends += [_point_distance(second[..., i, :], first) for i in (0, 1)]
    return np.minimum(np.minimum.reduce(ends), _inner_distance(first, second))


def _point_distance(point: Array, segment: Array) -> Array:
    start, way = segment[..., 0, :], segment[..., 1, :] - segment[..., 0, :]
    square = (way**2).sum(axis=-1)
    share = ((point - start) * way).sum(axis=-1) / np.where(square > 0, square, 1.0)
    away = point - start - np.clip(share, 0, 1)[..., None] * way
    return np.asarray(np.linalg.norm(away, axis=-1))


def _inner_distance(first: Array, second: Array) -> Array:
    """Distance of the lines where their closest points lie inside both segments; infinite elsewhere."""
    u, v = first[..., 1, :] - first[..., 0, :], second[..., 1, :] - second[..., 0, :]
    w = first[..., 0, :] - second[..., 0, :]
    uu, uv, vv = (u * u).sum(-1), (u * v).sum(-1), (v * v).sum(-1)
    uw, vw = (u * w).sum(-1), (v * w).sum(-1)
    determinant = uu * vv - uv * uv
    crossing = determinant > _PARALLEL * uu * vv
    divisor = np.where(crossing, determinant, 1.0)
    s, t = (uv * vw - vv * uw) / divisor, (uu * vw - uv * uw) / divisor
    inside = crossing & (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    away = np.linalg.norm(w + s[..., None] * u - t[..., None] * v, axis=-1)
    return np.asarray(np.where(inside, away, np.inf))
