"""What sensors and conveyors tell the robots that follow them."""

from dataclasses import dataclass

from cell.messages.common import CellTime


@dataclass(frozen=True, slots=True)
class Correction:
    """How far a robot's tool should be from its programmed path, as a sensor has measured it."""

    robot: str
    name: str
    """Of the robot's correction in the cell file."""
    at: CellTime
    """When it was measured."""
    offset_m: tuple[float, float, float]
    """In the axes that the cell file names for this sensor, from the programmed path, not from where the tool is."""
    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Rotation vector in the same axes."""


@dataclass(frozen=True, slots=True)
class ConveyorCount:
    """An encoder's counter."""

    conveyor: str
    at: CellTime
    """When it was read."""
    counts: int
    """0 to 2^32 - 1; it wraps around in both directions."""
    part: int | None = None
    """What the counter was when the newest part passed the place where parts were taught; None where none has."""
