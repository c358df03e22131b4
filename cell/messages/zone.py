"""The geometry of a zone, published by the manager; agents take it from here and from nowhere else."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ZoneGeometry:
    """An exclusive zone: an oriented box. A robot is inside when one of its capsules touches the box."""

    zone: str
    version: int
    size_m: tuple[float, float, float]
    """Full edge lengths along the box's own axes."""
    position_m: tuple[float, float, float]
    """Centre of the box in world."""
    quaternion_xyzw: tuple[float, float, float, float]
    """Orientation of the box in world."""
    robots: tuple[str, ...]
    """Robots that may ask for it; for all others the box is closed."""
