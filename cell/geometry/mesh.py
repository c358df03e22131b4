"""A solid of triangles. The tree of boxes of python-fcl finds the one that is nearest to a point or a line."""

import copy
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array, Flags
from cell.geometry.box import Box, point_box_distance
from cell.geometry.convex import Faces
from cell.geometry.errors import GeometryError, WrongShape
from cell.geometry.pose import check_poses
from cell.geometry.winding import Winding, closed

KINDS = (".stl", ".obj")


_SPACING_M = 0.01
"""Of the places on an axis at which it is looked how deep it is."""
_UNEVEN = 0.4567
"""Added to how often that fits into an axis: a capsule of a round length has as many places however it is rounded."""
_TOUCHES_M = 1e-9
"""Far above what rounding changes of the distances that fcl finds, the most where lines are nearly parallel."""
_FLAT = 1e-12
"""Triangles lower than this share of their longest side have no normal; their edges are those of others."""


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """A solid, where its triangles close; else the surface that they are, which has no inside."""

    vertices: Array
    """`(v, 3)` [m] in the frame of `pose_world_mesh`."""
    triangles: NDArray[np.int64]
    """`(t, 3)` indices of vertices."""
    pose_world_mesh: Array
    """`(4, 4)`."""
    _faces: Faces = field(init=False, repr=False)
    """Those with a normal. These four are in the frame of the mesh."""
    _box: Box = field(init=False, repr=False)
    _tree: Any = field(init=False, repr=False)
    """The same as fcl's tree of boxes."""
    _winding: Winding | None = field(init=False, repr=False)
    """None where the triangles do not close."""

    def __post_init__(self) -> None:
        import fcl  # some 20 ms that a cell without a mesh need not wait for

        if len(self.triangles) == 0 or not np.isfinite(self.vertices).all():
            raise GeometryError("mesh: found no triangle or no finite vertex, needed are both")
        object.__setattr__(self, "pose_world_mesh", check_poses(self.pose_world_mesh, "pose of the mesh"))
        corners = self.vertices[self.triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        twice, sides = np.linalg.norm(normals, axis=-1), np.linalg.norm(corners - np.roll(corners, 1, 1), axis=-1)
        wide = twice > _FLAT * sides.max(axis=-1) ** 2
        if not wide.any():
            raise GeometryError("mesh: found no triangle that is wider than a line, needed is one")
        tree = fcl.BVHModel()
        tree.beginModel(int(wide.sum()), len(self.vertices))
        tree.addSubModel(np.ascontiguousarray(self.vertices, float), np.ascontiguousarray(self.triangles[wide]))
        tree.endModel()
        object.__setattr__(self, "_faces", Faces(corners[wide], normals[wide] / twice[wide, None]))
        object.__setattr__(self, "_box", Box.about(self.vertices, np.eye(4)))
        object.__setattr__(self, "_tree", fcl.CollisionObject(tree))
        winding = Winding(corners) if closed(self.vertices, self.triangles) else None
        object.__setattr__(self, "_winding", winding)

    @property
    def is_closed(self) -> bool:
        """Whether it has an inside."""
        return self._winding is not None

    def moved_to(self, pose_world_solid: Array) -> "Mesh":
        """As `Solid`; all that was found of the triangles stays."""
        moved = copy.copy(self)
        object.__setattr__(moved, "pose_world_mesh", check_poses(pose_world_solid, "pose of the mesh"))
        return moved

    @classmethod
    def of_file(cls, file: Path, scale: float, pose_world_mesh: Array) -> Self:
        """Of an STL or OBJ file; `scale` is the length of its unit [m].

        Raises:
            GeometryError: the file is no mesh that can be read.
        """
        import coal  # comes with Pinocchio

        try:
            read = coal.MeshLoader().load(str(file), np.full(3, scale))
            corners = [read.tri_indices(number) for number in range(read.num_tris)]
            triangles = [[each[0], each[1], each[2]] for each in corners]
            vertices = np.array(read.vertices(), dtype=float).reshape(-1, 3)
        except (RuntimeError, ValueError, TypeError) as error:
            raise GeometryError(f"no mesh in {file.name}: {_words(error, file)}") from error
        return cls(vertices, np.array(triangles, dtype=np.int64).reshape(-1, 3), pose_world_mesh)

    def __reduce__(self) -> tuple[type["Mesh"], tuple[Array, NDArray[np.int64], Array]]:
        """The tree is made anew where it is unpacked: plans are made in a process of their own."""
        return Mesh, (self.vertices, self.triangles, self.pose_world_mesh)

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:
        """As `Solid`; exact where the axis is outside of the mesh.

        Below minus the radius: how deep in the mesh the deepest is of places on the axis, `_SPACING_M` apart, and so of
        the axis to half of that. In a mesh that is not closed an axis has no depth.
        """
        points = np.asarray(points, dtype=float)
        if points.shape[-2:] != (2, 3):
            raise WrongShape("capsule end points", points.shape, "(..., 2, 3)")
        axes = self._in_mesh(points.reshape(-1, 2, 3))
        radii, within = (np.broadcast_to(each, points.shape[:-2]).reshape(-1) for each in (radii, within))
        reach = radii + within
        halves = np.linalg.norm(axes[:, 1] - axes[:, 0], axis=-1) / 2.0
        near = point_box_distance(axes.mean(axis=1), self._box) <= halves + np.maximum(reach, 0.0)
        distance = np.full(len(axes), np.inf)
        if near.any():
            distance[near] = self._from_axes(axes[near], reach[near])
        return np.asarray(np.minimum(distance - radii, within).reshape(points.shape[:-2]))

    def comes_nearer(self, points: Array, radii: Array, than: Array | float) -> Flags:
        """Which capsules `(k,)` are nearer than that `(k,)` [m] at one of the poses `(m, k, 2, 3)` they go through."""
        axes, apart = self._in_mesh(points), np.asarray(radii + than)
        beside, nearer = np.flatnonzero(apart > 0.0), np.zeros(len(apart), dtype=np.bool_)
        inside = self._inside(axes[:, beside, 0].reshape(-1, 3)).reshape(len(axes), len(beside))
        nearer[beside] = inside.any(axis=0)
        for at in np.flatnonzero(~nearer).tolist():
            way, least = axes[:, at], float(apart[at])
            if least > 0.0:
                nearer[at] = self._comes_within(way, least)
            elif self.is_closed:
                nearer[at] = self._depth(_places(way), -least, some_out=True, enough=-least) > -least
        return nearer

    def _comes_within(self, axes: Array, apart: float) -> bool:
        """Whether one of the axes `(m, 2, 3)` that a capsule goes through is nearer to the surface than `apart` [m].

        No axis is nearer than the last one less the way of its ends to that, so on a way out few others are looked at.
        """
        last = self._away(axes[-1:])
        rest = axes[np.linalg.norm(axes - axes[-1], axis=-1).max(axis=-1) > last - apart]
        return last < apart or (len(rest) > 0 and self._away(rest) < apart)

    def _in_mesh(self, points: Array) -> Array:
        return np.asarray((points - self.pose_world_mesh[:3, 3]) @ self.pose_world_mesh[:3, :3])

    def _from_axes(self, axes: Array, within: Array) -> Array:
        """Distance of each axis `(k, 2, 3)` in the frame of the mesh; infinite for some beyond `within`, `(k,)` [m]."""
        least = self._from_surface(axes, within)
        for at, depth in self._depths(axes, least < _TOUCHES_M):
            least[at] = -depth
        outside = np.flatnonzero((least >= 0.0) & (least <= within + _TOUCHES_M))
        if len(outside):
            near = [self._faces.near(axes[at], float(least[at]) + _TOUCHES_M) for at in outside]
            axis = np.repeat(outside, [len(some) for some in near])
            least[outside] = np.inf
            np.minimum.at(least, axis, self._faces.of_pairs(axes[axis], np.concatenate(near)))
        return least

    def _depths(self, axes: Array, crosses: Flags) -> Iterator[tuple[int, float]]:
        """Which of the axes `(k, 2, 3)` have places inside, and how deep these are [m].

        Of an axis that does not cross the surface the start tells for all of it.
        """
        places = [_places(axis[None]) if crossing else axis[:1] for axis, crossing in zip(axes, crosses, strict=True)]
        inside = np.split(self._inside(np.concatenate(places)), np.cumsum([len(some) for some in places[:-1]]))
        for at in (at for at, held in enumerate(inside) if held.any()):
            held = places[at][inside[at]] if crosses[at] else _places(axes[at, None])
            yield at, self._depth(held, 0.0, some_out=False)

    def _from_surface(self, axes: Array, within: Array) -> Array:
        """Distance `(k,)` of each axis `(k, 2, 3)` from the surface to `_TOUCHES_M`; infinite for some beyond `within`.

        Where all of several axes are beyond it one look is enough.
        """
        away = self._away(axes)
        if len(axes) == 1 or away > within.max() + _TOUCHES_M:
            return np.full(len(axes), away if len(axes) == 1 else np.inf)
        half = len(axes) // 2
        return np.concatenate(
            [self._from_surface(axes[part], within[part]) for part in (slice(half), slice(half, None))]
        )

    def _away(self, axes: Array) -> float:
        """How far the nearest of axes `(m, 2, 3)` is from the surface [m], to `_TOUCHES_M`: 0 where it goes through."""
        import fcl

        lines = fcl.BVHModel()
        lines.beginModel(len(axes), 2 * len(axes))
        lines.addSubModel(axes.reshape(-1, 3), np.arange(2 * len(axes)).reshape(-1, 2)[:, [0, 1, 1]])
        lines.endModel()
        return max(float(fcl.distance(self._tree, fcl.CollisionObject(lines))), 0.0)

    def _depth(self, places: Array, least: float, *, some_out: bool, enough: float = np.inf) -> float:
        """How deep the deepest of places `(p, 3)` is [m]; `least` where none is deeper.

        None is deeper than in the box around the mesh. What is nearest to one place bounds how deep the others are, so
        few have to be looked at. `some_out`: they are not known to be all inside. One that is deeper than `enough` ends
        the search.
        """
        import fcl

        bounds = (self._box.size / 2.0 - np.abs(places - self._box.pose_world_box[:3, 3])).min(axis=1)
        places, bounds = places[bounds > least], bounds[bounds > least]
        request = fcl.DistanceRequest(enable_nearest_points=True)
        while len(places) and least <= enough and bounds[at := int(bounds.argmax())] > least:
            found, place = fcl.DistanceResult(), places[at]
            point = fcl.CollisionObject(fcl.Sphere(0.0), fcl.Transform(place))
            away = max(float(fcl.distance(self._tree, point, request, found)), 0.0)
            if away > least and some_out and not self._inside(place[None])[0]:
                bounds[np.linalg.norm(places - place, axis=-1) < away] = 0.0
            elif away > 0.0:
                least = max(least, away)
                np.minimum(bounds, self._faces.at_most(places, found.b1, found.nearest_points[0]), out=bounds)
            bounds[at] = 0.0
        return least

    def _inside(self, points: Array) -> Flags:
        return np.zeros(len(points), np.bool_) if self._winding is None else self._winding.inside(points)

    def bounds(self) -> Box:
        """As `Solid`."""
        return self._box.moved_to(self.pose_world_mesh @ self._box.pose_world_box)


def _places(axes: Array) -> Array:
    """On each of axes `(m, 2, 3)` of one length the same places, `(p, 3)`."""
    parts = 1 + int(np.linalg.norm(axes[0, 1] - axes[0, 0]) / _SPACING_M + _UNEVEN)
    shares = np.linspace(0.0, 1.0, parts + 1)
    starts, ends = axes.transpose(1, 2, 0)[..., None]
    return np.asarray((starts + shares * (ends - starts)).reshape(3, -1).T)


def _words(error: Exception, file: Path) -> str:
    """What the reader of meshes says of a file, without where in its own code it says so."""
    lines = str(error).splitlines() or [type(error).__name__]
    told = [number for number, line in enumerate(lines) if line.startswith("message:")]
    line = lines[told[0] + 1] if told and told[0] + 1 < len(lines) else lines[0]
    return line.replace(str(file), file.name).rstrip(".")
