"""What a drive tells only when it is asked: the current of its motor, and a temperature where the drives file knows it.

6078h is the current in per mille of the rated one, 6075h that in mA (CiA 402-2). Temperatures are objects of each
maker's own, so the drives file says which (`temperature`).
"""

from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.drive_objects import CURRENT_ACTUAL, MOTOR_RATED_CURRENT
from drive_gateway.config.settings import AxisSettings

OLD_S = 5.0
"""What was read longer ago is not told any more."""
MISSES = 3
"""An object that gave so often in a row nothing that can be used is not asked for again before the next start."""

Address = tuple[int, int]
"""Index and sub-index as the node has them."""


class Gauge:
    """Of one axis, since the newest start of its drive. Who asks the drive tells it what came."""

    def __init__(self, axis: AxisSettings) -> None:
        self._rated_at: Address = (index_of(MOTOR_RATED_CURRENT, axis.number), 0)
        self._current_at: Address = (index_of(CURRENT_ACTUAL, axis.number), 0)
        self._temperature = axis.temperature
        self._direction = 1.0 if axis.counts_per_unit > 0.0 else -1.0
        self.restart()

    def restart(self) -> None:
        """The drive starts, or is lost: nothing is known of it."""
        self._rated_a: float | None = None
        self._read: dict[Address, tuple[float, float]] = {}
        """Value and time of the newest reading."""
        self._misses: dict[Address, int] = {}
        self._turn = 0

    def take_turn(self) -> Address | None:
        """What to ask the drive for now, each in its turn; `None`: it has nothing to tell."""
        wanted = [address for address in self._wanted() if self._misses.get(address, 0) < MISSES]
        if not wanted:
            return None
        self._turn += 1
        return wanted[self._turn % len(wanted)]

    def take(self, address: Address, data: bytes, now: float) -> None:
        """The drive has answered with these bytes."""
        value = self._value(address, data)
        if value is None:
            self.missed(address)
            return
        self._misses.pop(address, None)
        if address == self._rated_at:
            self._rated_a = value
        else:
            self._read[address] = value, now

    def missed(self, address: Address) -> None:
        """It gave nothing that can be used: no answer, no number, or a refusal that may pass."""
        self._misses[address] = self._misses.get(address, 0) + 1
        self._read.pop(address, None)

    def lacks(self, address: Address) -> None:
        """The drive has no such object."""
        self._misses[address] = MISSES

    def current(self, now: float) -> float | None:
        """[A] of the motor, positive where it drives the axis upwards; `None`: not told lately."""
        return self._young(self._current_at, now)

    def temperature(self, now: float) -> float | None:
        """[degC] of what the drives file's `temperature` measures; `None`: not told lately."""
        return None if self._temperature is None else self._young(self._temperature.address, now)

    def _young(self, address: Address, now: float) -> float | None:
        found = self._read.get(address)
        return None if found is None or now - found[1] >= OLD_S else found[0]

    def _wanted(self) -> list[Address]:
        """Without a rated current the actual one has no unit."""
        current = self._rated_at if self._rated_a is None else self._current_at
        return [current] if self._temperature is None else [current, self._temperature.address]

    def _value(self, address: Address, data: bytes) -> float | None:
        if address == self._rated_at:
            return 1e-3 * int.from_bytes(data, "little") or None
        if address == self._current_at:
            size, signed, unit = 2, True, 1e-3 * self._direction * (self._rated_a or 0.0)
        elif self._temperature is not None:
            size, signed, unit = self._temperature.size, self._temperature.signed, self._temperature.unit_c
        else:
            return None
        return unit * int.from_bytes(data[:size], "little", signed=signed) if len(data) >= size else None
