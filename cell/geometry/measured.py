"""Solids that a few lengths give, by their words in files and messages: the register of the shapes of zones."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.box import Box
from cell.geometry.errors import GeometryError
from cell.geometry.solid import Cylinder, PlacedSolid, Sphere


@dataclass(frozen=True, slots=True)
class Measured:
    """A shape: its lengths by name, and the solid that they give at a pose `(4, 4)` in world."""

    lengths: tuple[str, ...]
    solid: Callable[[Sequence[float], Array], PlacedSolid]


MEASURED: dict[str, Measured] = {
    "box": Measured(("x", "y", "z"), lambda lengths, pose: Box(np.array(lengths), pose)),
    "sphere": Measured(("radius",), lambda lengths, pose: Sphere(pose[:3, 3], lengths[0])),
    "cylinder": Measured(("radius", "length"), lambda lengths, pose: Cylinder(lengths[0], lengths[1], pose)),
}
"""By word."""


def measured_solid(shape: str, lengths: Sequence[float], pose_world_solid: Array) -> PlacedSolid:
    """The solid of a shape's lengths [m] at a pose `(4, 4)`.

    Raises:
        GeometryError: no such shape, other lengths than it has, or one that is not above zero.
    """
    known = MEASURED.get(shape)
    if known is None:
        raise GeometryError(f"shape: found {shape!r}, allowed one of {', '.join(MEASURED)}")
    if len(lengths) != len(known.lengths):
        raise GeometryError(f"{shape}: found {len(lengths)} lengths, allowed {', '.join(known.lengths)}")
    return known.solid(lengths, pose_world_solid)
