"""Where a frame of the cell is, published by the manager; agents take it from here once they have heard it."""

from dataclasses import dataclass

from cell.messages.common import Count, Name, Vector, check_quaternion
from cell.messages.state import state


@state("frame/{frame}")
@dataclass(frozen=True, slots=True)
class FramePose:
    """A frame in which things, zones, robots and conveyors are given."""

    frame: Name
    version: Count
    """Grows with each edit that moves the frame, over restarts of the manager too."""
    parent: Name | None
    """The frame in which the cell file gives it; null for world, and for a frame that was taught by points."""
    position_m: Vector
    """Origin in world."""
    quaternion_xyzw: tuple[float, float, float, float]
    """Orientation in world."""

    def __post_init__(self) -> None:
        """Raises `ValueError` when the quaternion is no orientation."""
        check_quaternion(self.quaternion_xyzw)
