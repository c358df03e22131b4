"""How a robot looks where its file names meshes: made from files, placed by its measured joints."""

from collections.abc import Callable
from dataclasses import dataclass

from cell.geometry.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class LinkMesh:
    """Triangles in a frame of their own."""

    vertices: Array
    """`(v, 3)` [m]"""
    faces: Array
    """`(f, 3)`"""


@dataclass(frozen=True, slots=True, eq=False)
class RobotMeshes:
    """The links of one robot; those without a mesh, tools and parts stay capsules."""

    links: tuple[LinkMesh, ...]
    place: Callable[[Array], Array]
    """Joints `(n,)` [rad or m] to the poses of `links` in world `(k, 4, 4)`."""
    joints: int
    """n"""
    replaced: tuple[int, ...]
    """The capsules of its body that stand for links which have a mesh, by their numbers."""
