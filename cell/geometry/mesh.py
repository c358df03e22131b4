"""A solid of triangles. Distances are by python-fcl, whose tree of boxes finds the near triangles."""

import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array
from cell.geometry.box import Box
from cell.geometry.errors import GeometryError, WrongShape
from cell.geometry.pose import check_poses

KINDS = (".stl", ".obj")


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """The surface of a solid: what is wholly inside it touches nothing, so a body must come from outside."""

    vertices: Array
    """`(v, 3)` [m] in the frame of `pose_world_mesh`."""
    triangles: NDArray[np.int64]
    """`(t, 3)` indices of vertices."""
    pose_world_mesh: Array
    """`(4, 4)`."""
    _surface: Any = field(init=False, repr=False)
    """The tree of boxes, in the frame of the mesh."""
    _tree: Any = field(init=False, repr=False)
    """The same in world."""

    def __post_init__(self) -> None:
        import fcl  # some 20 ms that a cell without a mesh need not wait for

        if len(self.triangles) == 0 or not np.isfinite(self.vertices).all():
            raise GeometryError("mesh: found no triangle or no finite vertex, needed are both")
        object.__setattr__(self, "pose_world_mesh", check_poses(self.pose_world_mesh, "pose of the mesh"))
        tree = fcl.BVHModel()
        tree.beginModel(len(self.triangles), len(self.vertices))
        tree.addSubModel(np.ascontiguousarray(self.vertices, float), np.ascontiguousarray(self.triangles, np.int64))
        tree.endModel()
        object.__setattr__(self, "_surface", tree)
        self._place(self.pose_world_mesh)

    def _place(self, pose: Array) -> None:
        import fcl

        object.__setattr__(self, "pose_world_mesh", pose)
        object.__setattr__(self, "_tree", fcl.CollisionObject(self._surface, fcl.Transform(pose[:3, :3], pose[:3, 3])))

    def moved_to(self, pose_world_solid: Array) -> "Mesh":
        """As `Solid`; the tree of boxes stays."""
        moved = copy.copy(self)
        moved._place(check_poses(pose_world_solid, "pose of the mesh"))
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
        """As `Solid`; where a capsule touches it is 0."""
        points = np.asarray(points, dtype=float)
        if points.shape[-2:] != (2, 3):
            raise WrongShape("capsule end points", points.shape, "(..., 2, 3)")
        radii = np.broadcast_to(radii, points.shape[:-2])
        flat = points.reshape(-1, 2, 3)
        way, middles = flat[:, 1] - flat[:, 0], flat.mean(axis=1)
        capsules = zip(radii.ravel().tolist(), np.linalg.norm(way, axis=-1).tolist(), _along(way), middles, strict=True)
        return np.array([self._distance(*capsule, within) for capsule in capsules]).reshape(radii.shape)

    def _distance(self, radius: float, length: float, turn: Array, middle: Array, within: float) -> float:
        """Whether something touches is known some fifty times sooner than how far it is."""
        import fcl

        pose = fcl.Transform(turn, middle)

        def touches(grown: float) -> bool:
            capsule = fcl.CollisionObject(fcl.Capsule(radius + grown, length), pose)
            return bool(fcl.collide(self._tree, capsule, fcl.CollisionRequest(), fcl.CollisionResult()))

        if np.isfinite(within) and not touches(within):
            return within
        if touches(0.0):
            return 0.0
        capsule = fcl.CollisionObject(fcl.Capsule(radius, length), pose)
        return max(float(fcl.distance(self._tree, capsule, fcl.DistanceRequest(), fcl.DistanceResult())), 0.0)

    def bounds(self) -> Box:
        """As `Solid`."""
        return Box.about(self.vertices, self.pose_world_mesh)


def _along(way: Array) -> Array:
    """Rotations `(m, 3, 3)` whose Z points along each `way` `(m, 3)`; any where that is zero.

    By Duff et al., Building an Orthonormal Basis, Revisited (2017): no case but the sign of z.
    """
    length = np.linalg.norm(way, axis=-1, keepdims=True)
    x, y, z = np.where(length > 0.0, way / np.where(length > 0.0, length, 1.0), [0.0, 0.0, 1.0]).T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    columns = [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y], [x, y, z]]
    return np.array(columns).transpose(2, 1, 0)
