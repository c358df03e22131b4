"""The geometry of a zone, published by the manager; agents take it from here and from nowhere else."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Gt, Le

from cell.messages.common import Count, Few, Name, Vector, check_quaternion
from cell.messages.state import state

Edge = Annotated[float, Gt(0.0), Le(1e6)]


@state("zone/{zone}")
@dataclass(frozen=True, slots=True)
class ZoneGeometry:
    """An exclusive zone: an oriented box. A robot is inside when one of its capsules touches the box."""

    zone: Name
    version: Count
    size_m: tuple[Edge, Edge, Edge]
    """Full edge lengths along the box's own axes."""
    position_m: Vector
    """Centre of the box in world."""
    quaternion_xyzw: tuple[float, float, float, float]
    """Orientation of the box in world."""
    robots: Annotated[tuple[Name, ...], Few]
    """Robots that may ask for it; for all others the box is closed."""

    def __post_init__(self) -> None:
        """Raises `ValueError` when the quaternion is no orientation."""
        check_quaternion(self.quaternion_xyzw)
