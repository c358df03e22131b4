"""A solid of triangles. The tree of boxes of python-fcl finds the one that is nearest to a point."""

import copy
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
            raise GeometryError(f"{file.name}: found no mesh ({error}), allowed are STL and OBJ files") from error
        return cls(vertices, np.array(triangles, dtype=np.int64).reshape(-1, 3), pose_world_mesh)

    def __reduce__(self) -> tuple[type["Mesh"], tuple[Array, NDArray[np.int64], Array]]:
        """The tree is made anew where it is unpacked: plans are made in a process of their own."""
        return Mesh, (self.vertices, self.triangles, self.pose_world_mesh)

    def capsule_distance(self, points: Array, radii: Array, within: float = np.inf) -> Array:
        """As `Solid`; exact where the axis is outside of the mesh.

        Below minus the radius: how deep in the mesh the deepest is of places on the axis, `_SPACING_M` apart, and so of
        the axis to half of that. In a mesh that is not closed an axis has no depth.
        """
        points = np.asarray(points, dtype=float)
        if points.shape[-2:] != (2, 3):
            raise WrongShape("capsule end points", points.shape, "(..., 2, 3)")
        radii = np.broadcast_to(radii, points.shape[:-2])
        axes = (points.reshape(-1, 2, 3) - self.pose_world_mesh[:3, 3]) @ self.pose_world_mesh[:3, :3]
        reach = radii.reshape(-1) + within
        halves = np.linalg.norm(axes[:, 1] - axes[:, 0], axis=-1) / 2.0
        near = point_box_distance(axes.mean(axis=1), self._box) <= halves + reach
        distance = np.full(len(axes), np.inf)
        if near.any():
            distance[near] = self._from_axes(axes[near], reach[near])
        return np.asarray(np.minimum(distance.reshape(radii.shape) - radii, within))

    def _from_axes(self, axes: Array, within: Array) -> Array:
        """Distance of each axis `(k, 2, 3)` in the frame of the mesh; infinite for some beyond `within`, `(k,)` [m]."""
        lengths = np.linalg.norm(axes[:, 1] - axes[:, 0], axis=-1)
        parts = 1 + (lengths / _SPACING_M + _UNEVEN).astype(np.int64)
        shares = [np.linspace(0.0, 1.0, count + 1)[:, None] for count in parts.tolist()]
        places = [axis[0] + share * (axis[1] - axis[0]) for axis, share in zip(axes, shares, strict=True)]
        inside = np.split(self._inside(np.concatenate(places)), (parts + 1).cumsum()[:-1])
        each = zip(places, inside, (lengths / parts).tolist(), within.tolist(), strict=True)
        least = np.array([self._least(*one) for one in each], dtype=float)
        outside = np.flatnonzero((least > 0.0) & np.isfinite(least))
        if len(outside):
            near = [self._faces.near(axes[at], float(least[at])) for at in outside]
            axis = np.repeat(outside, [len(some) for some in near])
            np.minimum.at(least, axis, self._faces.of_pairs(axes[axis], np.concatenate(near)))
        return least

    def _least(self, places: Array, inside: Flags, apart_m: float, within: float) -> float:
        """The least distance [m] of places along an axis, below 0 inside; infinite where the axis is beyond `within`.

        It changes by no more than the way from one to another, so most between two of them need not be looked at.
        """
        import fcl

        held = inside.tolist()

        def height(at: int) -> float:
            point = fcl.CollisionObject(fcl.Sphere(0.0), fcl.Transform(places[at]))
            away = max(float(fcl.distance(self._tree, point)), 0.0)
            return -away if held[at] else away

        last = len(places) - 1
        ends = height(0), height(last)
        least, nearest, between = min(ends), np.inf, [(0, last, *ends)]
        while between:
            first, last, one, other = between.pop()
            bound = (one + other - (last - first) * apart_m) / 2.0
            if last - first == 1:
                nearest = min(nearest, bound)
            elif bound < min(least, within):
                middle = (first + last) // 2
                here = height(middle)
                least = min(least, here)
                between += [(first, middle, one, here), (middle, last, here, other)]
        return least if min(least, nearest) <= within else np.inf

    def _inside(self, points: Array) -> Flags:
        return np.zeros(len(points), np.bool_) if self._winding is None else self._winding.inside(points)

    def bounds(self) -> Box:
        """As `Solid`."""
        return self._box.moved_to(self.pose_world_mesh @ self._box.pose_world_box)
