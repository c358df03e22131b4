"""How often closed triangles go around a point: where that is not 0, the point is inside."""

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array, Flags

Indices = NDArray[np.int64]


def closed(vertices: Array, triangles: Indices) -> bool:
    """Whether triangles bound a solid, with one sense of rotation: each edge is gone along as often as back.

    Corners at one place are one, since an STL file has those of each triangle for itself.
    """
    _, number = np.unique(vertices + 0.0, axis=0, return_inverse=True)
    corner = number.reshape(-1)[triangles].astype(np.int64)
    begin, end, count = corner.reshape(-1), np.roll(corner, -1, axis=1).reshape(-1), len(vertices)
    return np.array_equal(np.sort(begin * count + end), np.sort(end * count + begin))


class Winding:
    """Winding numbers of points about closed triangles.

    A ray along Z from the point counts the triangles that it goes through, by the sense in which they go around it.
    Which side of an edge the ray is on is found for the edge alone, a corner belonging to what is above it in Y, so all
    triangles at an edge agree, also for round coordinates. Solids that overlap, and a cavity, are counted right.
    """

    def __init__(self, corners: Array) -> None:
        """Of triangles `(t, 3, 3)` [m] that are `closed`, in their own frame."""
        self._corners, self._ends = corners, np.roll(corners, -1, axis=1)
        self._normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        low, high = corners.min(axis=1), corners.max(axis=1)
        self._lows, self._highs = low, high
        self._low, self._high = low.min(axis=0), high.max(axis=0)
        self._side = max(1, int(np.sqrt(len(corners))))
        first, last = self._cell(low[:, :2]), self._cell(high[:, :2])
        wide = last - first + 1
        count = wide.prod(axis=1)
        owner = np.repeat(np.arange(len(corners)), count)
        within = np.arange(len(owner)) - np.repeat(count.cumsum() - count, count)
        x, y = first[owner, 0] + within // wide[owner, 1], first[owner, 1] + within % wide[owner, 1]
        cell = x * self._side + y
        self._triangles = owner[np.argsort(cell, kind="stable")]
        self._begins = np.concatenate([[0], np.bincount(cell, minlength=self._side**2).cumsum()])

    def inside(self, points: Array) -> Flags:
        """Which of the points `(p, 3)` are inside, `(p,)`; on the surface either."""
        inside = np.zeros(len(points), dtype=np.bool_)
        held = np.flatnonzero(((points >= self._low) & (points <= self._high)).all(axis=1))
        if len(held) == 0:
            return inside
        x, y = self._cell(points[held, :2]).T
        begin, end = (self._begins[x * self._side + y + step] for step in (0, 1))
        count = end - begin
        point = np.repeat(np.arange(len(held)), count)
        places = np.arange(len(point)) + np.repeat(begin - (count.cumsum() - count), count)
        triangle, (_, y, z) = self._triangles[places], points[held[point]].T
        may = (self._lows[triangle, 1] <= y) & (y < self._highs[triangle, 1]) & (z < self._highs[triangle, 2])
        point, triangle = point[may], triangle[may]
        around = self._around(points[held[point]], triangle)
        inside[held] = np.bincount(point, around, len(held)) != 0.0
        return inside

    def _cell(self, places: Array) -> Indices:
        """Of a grid of `_side` by `_side` over X and Y, `(p, 2)`."""
        width = np.maximum(self._high[:2] - self._low[:2], np.finfo(float).tiny)
        share = (places - self._low[:2]) / width * self._side
        return np.asarray(np.minimum(np.maximum(share.astype(np.int64), 0), self._side - 1))

    def _around(self, points: Array, triangles: Indices) -> Array:
        """How each triangle `(k,)` goes around the ray up from its point `(k, 3)`: 1, -1, or 0 for not at all."""
        corners, ends, x, y = self._corners[triangles], self._ends[triangles], points[:, None, 0], points[:, None, 1]
        up, down = (corners[..., 1] <= y) & (y < ends[..., 1]), (ends[..., 1] <= y) & (y < corners[..., 1])
        lower, upper = np.where(up[..., None], corners, ends), np.where(up[..., None], ends, corners)
        rise = np.where(up | down, upper[..., 1] - lower[..., 1], 1.0)
        right = lower[..., 0] + (y - lower[..., 1]) / rise * (upper[..., 0] - lower[..., 0]) > x
        turns = ((up & right).astype(float) - (down & right)).sum(axis=1)
        met = np.flatnonzero(turns)
        turns[met] *= self._height(points[met], triangles[met]) > points[met, 2]
        return np.asarray(turns)

    def _height(self, points: Array, triangles: Indices) -> Array:
        """Z of each triangle's plane at X and Y of its point, kept between its lowest and highest corner."""
        first, normal = self._corners[triangles, 0], self._normals[triangles]
        steep = normal[:, 2] == 0.0
        fall = ((points - first)[:, :2] * normal[:, :2]).sum(axis=1) / np.where(steep, 1.0, normal[:, 2])
        height = np.where(steep, first[:, 2], first[:, 2] - fall)
        return np.asarray(np.minimum(np.maximum(height, self._lows[triangles, 2]), self._highs[triangles, 2]))
