"""How the drives of a bus are simulated."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBusData


class Level(Enum):
    FAST = "fast"
    """Position loop only; many axes in real time."""
    FULL = "full"
    """Motor, load, encoder, servo loop, DC bus and protections; may be slower than real time."""


@dataclass(frozen=True, slots=True)
class Simulation:
    """Level, and what the full level needs. Real drives do not look at it."""

    level: Level = Level.FAST
    wire_time: bool = False
    """Frames take their time on the wire and wait for each other."""
    dc_bus: DcBusData = field(default_factory=DcBusData)
    axes: Mapping[tuple[str, str], AxisData] = field(default_factory=dict)
    """Axes by robot and name; all of them at the full level."""
    whole_robots: bool = False
    """The axes carry what the masses of their robots' files put on them."""
