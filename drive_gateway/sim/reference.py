"""Where a simulated axis is and where its drive believes it is: encoder, reference, limit and home switches."""

from dataclasses import dataclass

from drive_gateway.config.settings import AxisSettings

_SPAN = 2.0
"""[rad or m] from the home point to a limit switch that is not the home point itself."""
_HOME_WIDTH = 0.02
"""[rad or m] length of the cam of a home switch."""
NEGATIVE_LIMIT, POSITIVE_LIMIT, HOME_RISING, HOME_FALLING = 17, 18, 23, 27
"""Homing methods (6098h): limit switch; home switch, its edge in positive or in negative direction."""
HERE = (35, 37)
"""Homing methods: the home position is where the axis stands."""
METHODS = (NEGATIVE_LIMIT, POSITIVE_LIMIT, HOME_RISING, HOME_FALLING, *HERE)


@dataclass(frozen=True, slots=True)
class Switches:
    """Switches of the machine [counts of the axis itself]: active below, above, and between two places."""

    negative: float
    positive: float
    home: tuple[float, float]

    @classmethod
    def of(cls, axis: AxisSettings) -> "Switches":
        """As the configured homing expects them: its home point is the edge that its method looks for."""
        scale = abs(axis.counts_per_unit)
        span, width = _SPAN * scale, _HOME_WIDTH * scale
        method = 0 if axis.homing is None else axis.homing.method
        place = axis.simulated_start if axis.homing is None else axis.homing.position
        home = (place - axis.offset) * axis.counts_per_unit
        low = home - width if method == HOME_FALLING else home
        return cls(
            home if method == NEGATIVE_LIMIT else home - span,
            home if method == POSITIVE_LIMIT else home + span,
            (low, low + width),
        )


class Reference:
    """What is added to the encoder's counts. An incremental encoder counts from zero after each power-on."""

    def __init__(self, axis: AxisSettings) -> None:
        self._incremental = axis.incremental
        self.switches = Switches.of(axis)
        self.shift = 0.0
        """Place of the axis minus the position that the drive shows [counts]."""

    def switched_on(self, place: float) -> None:
        """The drive's supply returned while the axis stood at `place` [counts of the axis itself]."""
        if self._incremental:
            self.shift = place

    def found(self, home: float, offset: int) -> None:
        """Homing found the home point at `home` [counts of the axis itself], which is `offset` (607Ch)."""
        self.shift = home - offset
