"""How the drives of a bus are simulated."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from drive_gateway.config.settings import AxisSettings
from drive_gateway.sim.axis.axis_data import AxisData
from drive_gateway.sim.axis.dc_bus import DcBusData

LAG_S = 0.008
"""Of a simulated drive of which nothing else is said."""


class Level(Enum):
    FAST = "fast"
    """Position loop only; many axes in real time."""
    FULL = "full"
    """Motor, load, encoder, servo loop, DC bus and protections; may be slower than real time."""


@dataclass(frozen=True, slots=True)
class Simulation:
    """Level, where the axes stand, and what the full level needs. No master looks at it."""

    lag_s: float = LAG_S
    """Lag with which a drive follows its set points."""
    starts: Mapping[tuple[str, str], float] = field(default_factory=dict)
    """[rad or m] where axes stand when their drives are switched on, by robot and name."""
    level: Level = Level.FAST
    wire_time: bool = False
    """Frames take their time on the wire and wait for each other."""
    dc_bus: DcBusData = field(default_factory=DcBusData)
    axes: Mapping[tuple[str, str], AxisData] = field(default_factory=dict)
    """Axes by robot and name; all of them at the full level."""
    whole_robots: bool = False
    """The axes carry what the masses of their robots' files put on them."""

    def start(self, robot: str, axis: AxisSettings) -> float:
        """[rad or m] Where an axis stands at first; without a word of it in the middle of its limits, or at 0."""
        middle = 0.0 if axis.limits is None else sum(axis.limits) / 2
        return self.starts.get((robot, axis.name), middle)
