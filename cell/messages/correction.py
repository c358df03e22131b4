"""What sensors and conveyors tell the robots that follow them."""

from dataclasses import dataclass
from typing import Annotated

from annotated_types import Ge, Le

from cell.messages.common import CellTime, Name, Vector
from cell.messages.state import Urgency, state

Counter = Annotated[int, Ge(0), Le(2**32 - 1)]


@state("robot/{robot}/correction/{name}", Urgency.INTERACTIVE)
@dataclass(frozen=True, slots=True)
class Correction:
    """How far a robot's tool should be from its programmed path, as a sensor has measured it."""

    robot: Name
    name: Name
    """Of the robot's correction in the cell file."""
    at: CellTime
    """When it was measured."""
    offset_m: Vector
    """In the axes that the cell file names for this sensor, from the programmed path, not from where the tool is."""
    turn_rad: Vector = (0.0, 0.0, 0.0)
    """Rotation vector in the same axes."""


@state("conveyor/{conveyor}", Urgency.INTERACTIVE)
@dataclass(frozen=True, slots=True)
class ConveyorCount:
    """An encoder's counter."""

    conveyor: Name
    at: CellTime
    """When it was read."""
    counts: Counter
    """0 to 2^32 - 1; it wraps around in both directions."""
    part: Counter | None = None
    """What the counter was when the newest part passed the place where parts were taught; None where none has."""
