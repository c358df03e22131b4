"""The first motion of an axis after a start of its drive: does it move as fast as it is told, and that way round?

Nobody can read back in which unit a drive takes a speed, and a homing at sixty or ten thousand times its speed ends at
the machine's end. So the drive is told one of its own units first, four times as much after each rung, and is judged
at each rung: whatever the unit means, it is wrong at the slowest speed at which that can be seen.
"""

from math import degrees

from drive_gateway.config.settings import SETUP_SHARE, AxisSettings

FARTHEST = {False: 0.0174, True: 3e-3}
"""[rad, or m of an axis that slides] that it may go: 1 deg, 3 mm."""
RUNG_S = 0.1
FACTOR = 4
STEADY_S = 0.4
"""So long the last rung lasts; how fast it is then is measured in its second half."""
TOLERANCE = 1.5
"""Measured and told speed may differ by this factor."""
NOISE = 0.02
"""Share of the farthest way by which an axis that holds may hunt."""
BACK_S = 4.0
"""The way back takes no longer."""


class FirstMotion:
    """Feed `step` once per cycle; it answers the velocity to be told [the drive's unit].

    Args:
        axis: the axis.
        direction: 1 or -1, of the counts.
        counts: where it stands.
        now: [s]
        back: it goes back to where it stood.
    """

    def __init__(self, axis: AxisSettings, direction: int, counts: int, now: float, back: bool) -> None:
        scale = abs(axis.counts_per_unit)
        self._axis = axis
        self._direction = direction
        self._start = counts
        self._back = back
        self._unit = axis.units.velocity
        self._farthest = FARTHEST[axis.linear] * scale
        self._noise = max(NOISE * self._farthest, min(2.0 * axis.rest_window * scale, 0.1 * self._farthest), 3.0)
        self._top = max(1, int(min(0.5 * self._farthest, SETUP_SHARE * axis.speed * scale) / self._unit))
        self._told = 1
        self._told_way = 0.0
        self._before = self._rung_at = now
        self._middle: tuple[float, float] | None = None
        self._back_at: float | None = None
        self.problem = ""
        """Why the drive must not move on."""
        self.done = False
        """It moved as it was told; the velocity is zero."""

    def step(self, counts: int, now: float) -> int:
        """One cycle, with the newest measured position."""
        way = float((counts - self._start) * self._direction)
        self._told_way += self._told * self._unit * (now - self._before)
        self._before = now
        if self._back_at is not None:
            return self._go_back(way, now - self._back_at)
        if way < -self._noise:
            self._fail(
                way, "moves against the direction that it was told", "direction, or the drive's polarity (607Eh)"
            )
        elif way > TOLERANCE * self._told_way + self._noise:
            self._fail(way, "moves faster than it was told", "velocity_unit and counts_per_turn")
        elif self._told < self._top:
            if now - self._rung_at >= RUNG_S:
                self._told, self._rung_at = min(self._top, FACTOR * self._told), now
        elif way >= 0.5 * self._farthest or now - self._rung_at >= STEADY_S:
            self._judge_slow(way, now)
        elif self._middle is None and now - self._rung_at >= 0.5 * STEADY_S:
            self._middle = way, now
        if self.problem or self.done:
            return 0
        return self._direction * (self._told if self._back_at is None else -self._told)

    def unconfirmed(self, now: float) -> None:
        """The drive has not said yet that it took the newest velocity: nothing is judged by time before it has.

        It may go at the new velocity already, or at the one before.
        """
        self._rung_at = now
        self._middle = None
        if self._back_at is not None:
            self._back_at = now

    @property
    def turning(self) -> bool:
        """It has gone as far as it should, and is told to go back."""
        return self._back_at is not None

    def _judge_slow(self, way: float, now: float) -> None:
        if self._middle is not None:
            since, at = self._middle
            measured = (way - since) / (now - at)
            if measured * TOLERANCE < self._told * self._unit - self._noise / (now - at):
                keys = "velocity_unit, acceleration_unit and counts_per_turn"
                self._fail(way, "moves slower than it was told", keys)
                return
        self.done = not self._back
        self._back_at = now

    def _go_back(self, way: float, back_s: float) -> int:
        """`way` from its start, `back_s` after it was told to go back."""
        if abs(way) > self._farthest:
            self._fail(way, "goes on although it was told to go back", "velocity_unit and acceleration_unit")
        elif back_s > BACK_S:
            self._fail(way, "does not come back as it was told", "velocity_unit and acceleration_unit")
        elif way <= self._told * self._unit * 0.02:
            self.done = True
        return 0 if self.done or self.problem else -self._direction * self._told

    def _fail(self, way: float, what: str, keys: str) -> None:
        unit, factor = ("mm", 1000.0) if self._axis.linear else ("deg", degrees(1.0))
        scale = factor / abs(self._axis.counts_per_unit)
        told = f"{self._told} {self._axis.units.velocity_name} ({scale * self._told * self._unit:.3g} {unit}/s)"
        self.problem = (
            f"{what}: at {told} it was {scale * way:.3g} {unit} from its start, {scale * self._told_way:.3g} {unit} "
            f"were told; it goes no further before that is cleared: correct {keys} in the drives file"
        )
