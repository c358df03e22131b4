"""All that lies outside a union of convex bodies: what a robot keeps away from that has to stay inside them."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array
from cell.geometry.convex import Convex, Faces

CRACK_M = 1e-6
"""Where two bodies are no farther apart there is nothing between them."""
_TOUCHES_M = 2.0 * CRACK_M
"""An axis that comes so near to the border touches it: more than a point may be outside that counts as inside."""
_PLACES = np.linspace(0.0, 1.0, 17)
"""Along an axis that is not inside, where it is looked how far out it is."""


@dataclass(frozen=True, slots=True, eq=False)
class Room:
    """The outside of the union of `parts`, as a solid.

    A capsule is inside the union by a margin exactly where its axis is inside and no nearer to the border than its
    radius and the margin. The border is every face of every part without what other parts cover of its outer side;
    cut by their planes, convex pieces are left of it, and the distance from a flat convex piece is exact. So the seam
    of two parts that overlap or abut is no border. Exact but for gaps and steps of `CRACK_M`, and for axes that are
    nearer to the border than twice that, which touch it.
    """

    parts: tuple[Convex, ...]
    extra: tuple[float, ...]
    """[m] By part, how much nearer its border counts than it is."""
    _border: Faces = field(init=False, repr=False)
    _nearer: Array = field(init=False, repr=False)
    """`(p,)` `extra` of each piece of the border."""
    _normals: Array = field(init=False, repr=False)
    """`(3, k)` of the planes of all parts, one part after the other."""
    _offsets: Array = field(init=False, repr=False)
    """`(k,)` [m] of these."""
    _firsts: NDArray[np.intp] = field(init=False, repr=False)
    """Where among them each part begins."""

    def __post_init__(self) -> None:
        pieces = [
            (piece, normal, extra)
            for part, extra in zip(self.parts, self.extra, strict=True)
            for face, normal in zip(part.faces, part.normals, strict=True)
            for piece in self._uncovered(part, face, normal)
        ]
        object.__setattr__(
            self, "_border", Faces([piece for piece, _, _ in pieces], np.array([n for _, n, _ in pieces]))
        )
        object.__setattr__(self, "_nearer", np.array([extra for _, _, extra in pieces]))
        planes = [len(part.offsets) for part in self.parts]
        object.__setattr__(self, "_normals", np.concatenate([part.normals for part in self.parts]).T.copy())
        object.__setattr__(self, "_offsets", np.concatenate([part.offsets for part in self.parts]))
        object.__setattr__(self, "_firsts", np.cumsum([0, *planes[:-1]]))

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:
        """As `Solid`. Below minus the radius: how far the axis is out, by the planes of the nearest part.

        Inside one part the least depth of both ends is a bound from below, and in a union of one part exact; the border
        is looked at where that bound is not enough.
        """
        points = np.asarray(points, dtype=float)
        axes = points.reshape(-1, 2, 3)
        reach = np.broadcast_to(radii + within, points.shape[:-2]).reshape(-1)
        heights = self._heights(axes)
        distance = -heights.max(axis=-2).min(axis=-1) - max(self.extra)
        if len(self.parts) > 1:
            near = distance < reach
            out = heights[near, 0].min(axis=-1)
            distance[near] = self._from_border(axes[near], reach[near], out)
        return np.asarray(distance.reshape(points.shape[:-2]) - radii)

    def bounds(self) -> None:
        """As `Solid`."""

    def _from_border(self, axes: Array, within: Array, out: Array) -> Array:
        """Distance `(m,)` [m] of axes `(m, 2, 3)` from the border; at most 0 for those that are not inside.

        Beyond `within` `(m,)` [m] it is a bound from below. `out` `(m,)` [m] is how far out the starts are.
        """
        distances = self._border.distance(axes, np.maximum(within, _TOUCHES_M)[:, None] + self._nearer)
        inside = (out <= CRACK_M) & (distances.min(axis=1, initial=np.inf) > _TOUCHES_M)
        nearest = (distances - self._nearer).min(axis=1, initial=np.inf)
        outside = ~inside
        if not outside.any():
            return np.asarray(nearest)
        along = axes[outside, None, 0] + _PLACES[:, None] * (axes[outside, 1] - axes[outside, 0])[:, None]
        farthest = self._heights(along).min(axis=-1).max(axis=1, initial=0.0)
        nearest[outside] = -np.maximum(farthest, 0.0) - max(self.extra)
        return np.asarray(nearest)

    def _heights(self, points: Array) -> Array:
        """How far points `(..., 3)` are beyond each part, `(..., parts)` [m]; the least says how far out they are."""
        beyond = points.reshape(-1, 3) @ self._normals - self._offsets
        return np.maximum.reduceat(beyond, self._firsts, axis=1).reshape(*points.shape[:-1], len(self.parts))

    def _uncovered(self, own: Convex, face: Array, normal: Array) -> list[Array]:
        """The pieces of a face whose outer side lies in no other part."""
        pieces = [face]
        for other in self.parts:
            if other is not own:
                offsets = other.offsets - CRACK_M * (other.normals @ normal)
                pieces = [rest for piece in pieces for rest in _without(piece, other.normals, offsets)]
        return pieces


def _without(polygon: Array, normals: Array, offsets: Array) -> list[Array]:
    """A convex polygon `(v, 3)` without what lies between planes, as convex polygons."""
    left, rest = [], polygon
    for normal, offset in zip(normals, offsets, strict=True):
        beyond = _below(rest, -normal, -offset)
        rest = _below(rest, normal, offset)
        if not _wide(rest):
            return [polygon]
        if _wide(beyond):
            left.append(beyond)
    return left


def _below(polygon: Array, normal: Array, offset: float) -> Array:
    """The part of a convex polygon on one side of a plane (Sutherland and Hodgman 1974)."""
    heights = polygon @ normal - offset
    kept: list[Array] = []
    for i in range(len(polygon)):
        before, here = heights[i - 1], heights[i]
        if (before > 0.0) != (here > 0.0):
            kept.append(polygon[i - 1] + before / (before - here) * (polygon[i] - polygon[i - 1]))
        if here <= 0.0:
            kept.append(polygon[i])
    return np.array(kept).reshape(-1, 3)


def _wide(polygon: Array) -> bool:
    """Whether a polygon is more than a crack."""
    if len(polygon) < 3:
        return False
    around = polygon - polygon[0]
    area = float(np.linalg.norm(np.cross(around[1:-1], around[2:]).sum(axis=0))) / 2.0
    longest = float(np.linalg.norm(polygon - np.roll(polygon, 1, axis=0), axis=-1).max())
    return area > CRACK_M * longest
