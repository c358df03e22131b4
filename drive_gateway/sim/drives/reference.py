"""Where a simulated axis is and where its drive believes it is: encoder, reference, switches and index pulse."""

from dataclasses import dataclass, replace
from enum import Enum
from math import ceil, floor, inf

from drive_gateway.config.settings import AxisSettings

_SPAN = 3.5
"""[rad or m] from the home point to a limit switch that is not the home point itself."""
_HOME_WIDTH = 0.02
"""[rad or m] length of the cam of a home switch."""
_NEGATIVE_BIT, _POSITIVE_BIT, _HOME_BIT = 1 << 0, 1 << 1, 1 << 2
"""60FDh."""
_BEFORE_PULSE = 0.4
"""Turns of the motor from the edge of a switch to the index pulse that is home."""


class Look(Enum):
    """What a homing method looks for first."""

    LIMIT = "the limit switch against the direction in which it is left"
    HOME = "the home switch, a cam somewhere on the way"
    END = "the home switch, active from its edge to an end of the way"
    PULSE = "the index pulse"
    HERE = "nothing"


@dataclass(frozen=True, slots=True)
class Method:
    """A homing method. `away`: direction of the counts in which the switch is left, or the pulse is looked for."""

    look: Look
    away: float = 0.0
    pulse: bool = False
    """Home is the first index pulse after the edge."""
    inward: bool = False
    """It turns round behind the edge and takes it, or the pulse behind it, on its way onto the switch."""
    first: float = 0.0
    """Direction in which it looks for the switch."""

    @property
    def last(self) -> float:
        """Direction in which home is taken."""
        return -self.away if self.inward else self.away


_AT_EDGES = {
    1: Method(Look.LIMIT, 1.0, first=-1.0),
    2: Method(Look.LIMIT, -1.0, first=1.0),
    3: Method(Look.END, -1.0, first=1.0),
    4: Method(Look.END, -1.0, inward=True, first=1.0),
    5: Method(Look.END, 1.0, first=-1.0),
    6: Method(Look.END, 1.0, inward=True, first=-1.0),
    7: Method(Look.HOME, -1.0, first=1.0),
    8: Method(Look.HOME, -1.0, inward=True, first=1.0),
    9: Method(Look.HOME, 1.0, inward=True, first=1.0),
    10: Method(Look.HOME, 1.0, first=1.0),
    11: Method(Look.HOME, 1.0, first=-1.0),
    12: Method(Look.HOME, 1.0, inward=True, first=-1.0),
    13: Method(Look.HOME, -1.0, inward=True, first=-1.0),
    14: Method(Look.HOME, -1.0, first=-1.0),
}
"""Which edge, and from which side; `away` is the side of the edge that is off the switch."""
METHODS = {
    **{number: replace(method, pulse=True) for number, method in _AT_EDGES.items()},
    **{number + 16: method for number, method in _AT_EDGES.items()},
    33: Method(Look.PULSE, -1.0, pulse=True),
    34: Method(Look.PULSE, 1.0, pulse=True),
    35: Method(Look.HERE),
    37: Method(Look.HERE),
}
"""The homing methods (6098h) that the drive has, as CiA 402-2 numbers them."""


@dataclass(frozen=True, slots=True)
class Switches:
    """Switches of the machine [counts of the axis itself]: active below, above, and between two places."""

    negative: float
    positive: float
    home: tuple[float, float]
    index: float = 0.0
    """Counts between two index pulses; 0: the encoder has none."""
    phase: float = 0.0
    """Where one of the pulses is."""
    wired: int = 0
    """Which of them the drive shows in 60FDh: bit 0 negative, 1 positive, 2 home."""
    stops: bool = False
    """The drive stops at its limit switches."""

    @classmethod
    def of(cls, axis: AxisSettings, start: float) -> "Switches":
        """As the configured homing expects them: its home point is the edge, or pulse, that its method looks for.

        What homing does not say stands in `limit_switches`. Without homing, `start` [rad or m] is the home point.
        """
        scale = abs(axis.counts_per_unit)
        span, width = _SPAN * scale, _HOME_WIDTH * scale
        # A method of a maker's own is none of this drive's: its switches are anywhere.
        method = METHODS[35] if axis.homing is None else METHODS.get(axis.homing.method, METHODS[35])
        place = start if axis.homing is None else axis.homing.position
        home = (place - axis.offset) * axis.counts_per_unit
        edge = home - method.last * _BEFORE_PULSE * axis.index_counts if method.pulse else home
        low = edge - width if method.away > 0.0 else edge
        cam = (low, low + width)
        if method.look is Look.END:
            cam = (-inf, edge) if method.away > 0.0 else (edge, inf)
        ends = [home - span, home + span]
        if axis.limit_switches is not None:
            ends = sorted((end - axis.offset) * axis.counts_per_unit for end in axis.limit_switches)
        if method.look is Look.LIMIT:
            ends[method.away < 0.0] = edge
        shown = {
            Look.HOME: _HOME_BIT,
            Look.END: _HOME_BIT,
            Look.LIMIT: _POSITIVE_BIT if method.away < 0.0 else _NEGATIVE_BIT,
        }
        stops = axis.limit_switches is not None
        return cls(
            negative=ends[0],
            positive=ends[1],
            home=cam,
            index=axis.index_counts,
            phase=home,
            wired=shown.get(method.look, 0) | (_NEGATIVE_BIT | _POSITIVE_BIT if stops else 0),
            stops=stops,
        )

    def inputs(self, place: float) -> int:
        """Bits of 60FDh that are active at `place`."""
        if not self.wired:
            return 0
        active = _NEGATIVE_BIT if place <= self.negative else 0
        active |= _POSITIVE_BIT if place >= self.positive else 0
        active |= _HOME_BIT if self.home[0] <= place <= self.home[1] else 0
        return active & self.wired

    def stop(self, place: float, velocity: float) -> bool:
        """The drive stops here on its way in the direction of `velocity`."""
        return self.stops and self.at_limit(place, velocity)

    def edge(self, method: Method) -> float:
        """Where the switch of a method lets go."""
        if method.look is not Look.LIMIT:
            return self.home[1] if method.away > 0.0 else self.home[0]
        return self.negative if method.away > 0.0 else self.positive

    def at_limit(self, place: float, direction: float) -> bool:
        """The limit switch in this direction is active."""
        return place <= self.negative if direction < 0.0 else place >= self.positive

    def at_any_limit(self, place: float) -> bool:
        return self.at_limit(place, -1.0) or self.at_limit(place, 1.0)

    def pulse_between(self, before: float, place: float) -> float | None:
        """The index pulse nearest to `before` on the way to `place`, `before` itself excluded."""
        if place > before:
            pulse = self.phase + self.index * (floor((before - self.phase) / self.index) + 1)
            return pulse if pulse <= place else None
        pulse = self.phase + self.index * (ceil((before - self.phase) / self.index) - 1)
        return pulse if pulse >= place else None


class Reference:
    """What is added to the encoder's counts. An incremental encoder counts from zero after each power-on."""

    def __init__(self, axis: AxisSettings, start: float) -> None:
        self._incremental = axis.incremental
        self.serial = axis.node_id + 0x80 * (axis.number - 1)
        """Of the encoder."""
        self.battery_empty = False
        """An absolute encoder's battery was empty while the drive was off: its turns may be wrong until it homes."""
        self.switches = Switches.of(axis, start)
        self.known = not axis.incremental
        """The drive knows where the axis is: limits mean something."""
        self.shift = 0.0
        """Place of the axis minus the position that the drive shows [counts]."""

    def switched_on(self, place: float) -> None:
        """The drive's supply returned while the axis stood at `place` [counts of the axis itself]."""
        if self._incremental:
            self.shift, self.known = place, False

    def found(self, home: float, offset: int) -> None:
        """Homing found the home point at `home` [counts of the axis itself], which is `offset` (607Ch)."""
        self.shift, self.known = home - offset, True
        self.battery_empty = False
