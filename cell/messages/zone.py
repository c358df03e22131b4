"""The geometry of a zone, published by the manager; agents take it from here and from nowhere else."""

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from annotated_types import Gt, Le, MaxLen

from cell.geometry import PlacedSolid, SpaceOf, measured_solid, pose_from, to_xyz_abc
from cell.geometry.arrays import Array
from cell.messages.common import Count, Few, Name, Vector, check_quaternion
from cell.messages.state import state

_COUNTS = {SpaceOf.BODY: "body", SpaceOf.TCP: "TCP"}
Edge = Annotated[float, Gt(0.0), Le(1e6)]


@state("zone/{zone}")
@dataclass(frozen=True, slots=True)
class ZoneGeometry:
    """An exclusive zone: a solid. A robot is inside when its body touches it, or its TCP."""

    zone: Name
    version: Count
    """The same number stands for the same shape, lengths, pose, robots and `of`; another one for anything else."""
    size_m: Annotated[tuple[Edge, ...], MaxLen(10)]
    """The lengths of the shape: a box has its full edge lengths along its own axes, a sphere its radius, a cylinder its
    radius and its length along Z."""
    position_m: Vector
    """Its middle in world."""
    quaternion_xyzw: tuple[float, float, float, float]
    """Its orientation in world."""
    robots: Annotated[tuple[Name, ...], Few]
    """Robots that may ask for it; for all others it is closed."""
    shape: Name = "box"
    """`box`, `sphere`, `cylinder`: a word of `cell.geometry.MEASURED`."""
    of: SpaceOf = SpaceOf.BODY
    """What of a robot is inside: any of its capsules, or its TCP alone, a point."""

    def __post_init__(self) -> None:
        """Raises `ValueError` when the quaternion is no orientation, and for a shape that is none."""
        check_quaternion(self.quaternion_xyzw)
        self.solid()

    def solid(self) -> PlacedSolid:
        """What bodies are looked at against, in world."""
        return measured_solid(self.shape, self.size_m, self._pose())

    def described(self) -> str:
        """Shape, place in world and what counts in it, for people, in mm and deg."""
        lengths = " x ".join(f"{1000.0 * length:g}" for length in self.size_m)
        x, y, z, *turns = to_xyz_abc(self._pose()).tolist()
        place = " ".join(f"{key} {round(1000.0 * v, 2) + 0.0:g}" for key, v in zip("XYZ", (x, y, z), strict=True))
        turned = " ".join(f"{key} {round(math.degrees(v), 4) + 0.0:g}" for key, v in zip("ABC", turns, strict=True))
        return f"{self.shape} {lengths} mm at {place} mm, {turned} deg, of the {_COUNTS[self.of]}"

    def _pose(self) -> Array:
        return pose_from(np.array(self.position_m), np.array(self.quaternion_xyzw))
