"""Convex bodies between planes, and the exact distance of line segments from flat faces."""

from dataclasses import dataclass, field
from itertools import combinations
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array, Flags
from cell.geometry.box import Box
from cell.geometry.errors import GeometryError, WrongShape
from cell.geometry.pose import transform_points
from cell.geometry.segment import least_height, segment_distance

MOST_POINTS = 32
_FLAT_M = 1e-7
"""Points that are no farther from a plane lie in it."""
_AT_ONCE = 20_000
"""Pairs of a segment and an edge that are looked at in one go."""
_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@dataclass(frozen=True, slots=True, eq=False)
class Convex:
    """All points x with `normals` x <= `offsets`."""

    normals: Array
    """`(k, 3)`, of length 1, outwards."""
    offsets: Array
    """`(k,)` [m]."""
    faces: tuple[Array, ...]
    """For each plane the corners `(v, 3)` [m] of its face, counter-clockwise as seen from outside."""

    @classmethod
    def of_points(cls, points: Array) -> Self:
        """The convex hull of 4 to `MOST_POINTS` points `(p, 3)` [m].

        Each plane through three points that has all others on one side carries a face.

        Raises:
            GeometryError: too few or too many points, or all of them in one plane.
        """
        points = np.asarray(points, dtype=float)
        if points.ndim != 2 or points.shape[1] != 3:
            raise WrongShape("points of a hull", points.shape, "(p, 3)")
        if not 4 <= len(points) <= MOST_POINTS:
            raise GeometryError(f"hull: found {len(points)} points, allowed are 4 to {MOST_POINTS}")
        a, b, c = np.moveaxis(points[np.array(list(combinations(range(len(points)), 3)))], 1, 0)
        normals = np.cross(b - a, c - a)
        lengths = np.linalg.norm(normals, axis=-1)
        wide = lengths > _FLAT_M * np.maximum(np.linalg.norm(b - a, axis=-1), np.linalg.norm(c - a, axis=-1))
        normals, a = normals[wide] / lengths[wide, None], a[wide]
        normals, a = np.concatenate([normals, -normals]), np.concatenate([a, a])
        heights = normals @ points.T - np.einsum("tk,tk->t", normals, a)[:, None]
        outer = np.flatnonzero(heights.max(axis=1, initial=0.0) <= _FLAT_M)
        found = {frozenset(np.flatnonzero(heights[t] >= -_FLAT_M).tolist()): t for t in outer}
        kept = [(corners, t) for corners, t in found.items() if not any(corners < other for other in found)]
        if not kept or any(heights[t].min() > -10.0 * _FLAT_M for _, t in kept):
            raise GeometryError("hull: found points that all lie in one plane, needed are four that do not")
        chosen = normals[[t for _, t in kept]]
        faces = tuple(_ring(points[sorted(corners)], normals[t]) for corners, t in kept)
        return cls(chosen, np.array([(chosen[i] @ face.T).max() for i, face in enumerate(faces)]), faces)

    @classmethod
    def of_box(cls, box: Box) -> Self:
        """The box between six planes."""
        pose = box.pose_world_box
        return cls.of_points(_CORNERS * box.size @ pose[:3, :3].T + pose[:3, 3])

    def beyond(self, points: Array) -> Array:
        """By how much `points` `(..., 3)` are beyond each plane, `(..., k)` [m]."""
        return np.asarray(np.asarray(points) @ self.normals.T - self.offsets)


class Faces:
    """Flat convex polygons in space."""

    def __init__(self, corners: list[Array] | Array, normals: Array) -> None:
        """`corners` `(v, 3)` [m] of each, counter-clockwise about its normal; `normals` `(p, 3)` of length 1."""
        if isinstance(corners, list):
            most = max(map(len, corners))
            corners = np.array([np.concatenate([each, np.repeat(each[-1:], most - len(each), 0)]) for each in corners])
        self._starts = corners
        self._ends = np.roll(corners, -1, axis=1)
        self._normals = normals
        self._offsets = np.einsum("pk,pk->p", normals, self._starts[:, 0])
        self._outward = np.cross(self._ends - self._starts, normals[:, None])
        self._edges = np.stack([self._starts, self._ends], axis=-2)
        self._centres = (self._starts.min(axis=1) + self._starts.max(axis=1)) / 2.0
        self._middles = np.ascontiguousarray(self._centres.T)
        self._balls = np.linalg.norm(self._starts - self._centres[:, None], axis=-1).max(axis=-1)

    def distance(self, segments: Array, within: Array | float) -> Array:
        """Exact distance `(m, p)` [m] of segments `(m, 2, 3)` from each polygon; beyond `within` a bound from below.

        It is least between an edge and the segment, between an end of the segment and the polygon above which that
        lies, or zero where the segment goes through. The bound is the distance from the polygon's plane, or that from
        a ball around it. `within` broadcasts with `(m, p)`.
        """
        heights = segments @ self._normals.T - self._offsets
        start, end = heights[:, 0], heights[:, 1]
        least = np.minimum(np.abs(start), np.abs(end))
        least[start * end <= 0.0] = 0.0
        segment, polygon = np.nonzero(least <= within)
        if not len(segment):
            return np.asarray(least)
        middle, way = (segments[:, 0] + segments[:, 1]) / 2.0, segments[:, 1] - segments[:, 0]
        halves, away = np.sqrt(np.einsum("mk,mk->m", way, way)) / 2.0, middle[segment] - self._centres[polygon]
        beside = np.sqrt(np.einsum("nk,nk->n", away, away)) - self._balls[polygon] - halves[segment]
        least[segment, polygon] = np.maximum(least[segment, polygon], beside)
        near = beside <= np.broadcast_to(within, least.shape)[segment, polygon]
        segment, polygon = segment[near], polygon[near]
        share = max(1, _AT_ONCE // self._starts.shape[1])
        for at in range(0, len(segment), share):
            one, other = segment[at : at + share], polygon[at : at + share]
            least[one, other] = self._distance(segments[one], heights[one, :, other], other)
        return np.asarray(least)

    def near(self, segment: Array, within: float) -> NDArray[np.intp]:
        """The polygons that may be no farther than `within` [m] from a segment `(2, 3)`, by balls around them."""
        way = segment[1] - segment[0]
        away = self._middles - segment[0][:, None]
        share = way @ away / max(float(way @ way), np.finfo(float).tiny)
        away -= np.minimum(np.maximum(share, 0.0, out=share), 1.0, out=share) * way[:, None]
        away *= away
        reach = self._balls + within
        return np.flatnonzero(away[0] + away[1] + away[2] <= reach * reach)

    def at_most(self, points: Array, polygon: int, place: Array) -> Array:
        """Bounds from above on how far points `(n, 3)` are from a polygon: from a place on it, or from its plane."""
        away, outward, normal = points - place, self._outward[polygon], self._normals[polygon]
        bounds = np.sqrt(np.einsum("nk,nk->n", away, away))
        above = (points @ outward.T <= np.einsum("ek,ek->e", self._starts[polygon], outward)).all(axis=1)
        heights = np.abs(points @ normal - self._offsets[polygon])
        return np.asarray(np.where(above, np.minimum(bounds, heights), bounds))

    def of_pairs(self, segments: Array, polygons: NDArray[np.intp]) -> Array:
        """Exact distance `(k,)` [m] of each segment `(k, 2, 3)` from its polygon."""
        heights = np.einsum("kej,kj->ke", segments, self._normals[polygons]) - self._offsets[polygons, None]
        return self._distance(segments, heights, polygons)

    def _distance(self, segments: Array, heights: Array, polygons: NDArray[np.intp]) -> Array:
        """Of each segment `(k, 2, 3)` from its polygon, `(k,)`; `heights` `(k, 2)` are those of its ends above it."""
        least = segment_distance(segments[:, None], self._edges[polygons]).min(axis=-1)
        for end in (0, 1):
            above = self._above(segments[:, end], polygons)
            least = np.where(above, np.minimum(least, np.abs(heights[:, end])), least)
        through = heights[:, 0] * heights[:, 1] < 0.0
        share = heights[:, 0] / np.where(through, heights[:, 0] - heights[:, 1], 1.0)
        meets = segments[:, 0] + share[:, None] * (segments[:, 1] - segments[:, 0])
        return np.where(through & self._above(meets, polygons), 0.0, least)

    def _above(self, points: Array, polygons: NDArray[np.intp]) -> Flags:
        """Whether points `(k, 3)` lie straight above or below their polygon."""
        beyond = np.einsum("pek,pek->pe", points[:, None] - self._starts[polygons], self._outward[polygons])
        return np.asarray(beyond.max(axis=-1) <= 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class Hull:
    """The convex hull of points `(p, 3)` [m] in the axes of a pose `(4, 4)`, as a solid.

    Raises `GeometryError` as `Convex.of_points`.
    """

    points: Array
    pose_world_hull: Array
    convex: Convex = field(init=False, repr=False)
    """In world."""
    _faces: Faces = field(init=False, repr=False)

    def __post_init__(self) -> None:
        in_world = transform_points(self.pose_world_hull, np.asarray(self.points, dtype=float))
        object.__setattr__(self, "convex", Convex.of_points(in_world))
        object.__setattr__(self, "_faces", Faces(list(self.convex.faces), self.convex.normals))

    def moved_to(self, pose_world_solid: Array) -> "Hull":
        """As `PlacedSolid`."""
        return Hull(self.points, pose_world_solid)

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:
        """As `Solid`; exact, and below zero the depth of the axis and the radius."""
        points = np.asarray(points, dtype=float)
        axes = points.reshape(-1, 2, 3)
        distance = least_height(self.convex.beyond(axes))
        reach = np.broadcast_to(radii + within, points.shape[:-2]).reshape(-1)
        near = (distance > 0.0) & (distance < reach)
        distance[near] = self._faces.distance(axes[near], np.inf).min(axis=-1, initial=np.inf)
        return np.asarray(distance.reshape(points.shape[:-2]) - radii)

    def bounds(self) -> Box:
        """As `Solid`."""
        return Box.about(np.concatenate(self.convex.faces), np.eye(4))


def _ring(points: Array, normal: Array) -> Array:
    """The corners of the convex hull of points in one plane, counter-clockwise about its normal (Andrew 1979)."""
    x = np.cross(normal, [1.0, 0.0, 0.0] if abs(normal[0]) < 0.9 else [0.0, 1.0, 0.0])
    x /= np.linalg.norm(x)
    flat = np.round(np.stack([points @ x, points @ np.cross(normal, x)], axis=-1), 12)
    order = np.lexsort((flat[:, 1], flat[:, 0])).tolist()

    def half(indices: list[int]) -> list[int]:
        chain: list[int] = []
        for i in indices:
            while len(chain) > 1 and not _turns_left(flat[chain[-2]], flat[chain[-1]], flat[i]):
                chain.pop()
            chain.append(i)
        return chain[:-1]

    return np.asarray(points[half(order) + half(order[::-1])])


def _turns_left(a: Array, b: Array, c: Array) -> bool:
    return bool((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0.0)
