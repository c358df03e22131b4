"""What profile velocity says of the speed (CiA 402-2): target reached (606Dh, 606Eh) and standstill (606Fh, 6070h)."""

from collections.abc import MutableMapping

from drive_gateway.sim.dictionary import key_of

_WINDOW, _WINDOW_TIME = key_of(0x606D), key_of(0x606E)
_THRESHOLD, _THRESHOLD_TIME = key_of(0x606F), key_of(0x6070)


class VelocityWindows:
    """Two windows around speeds [counts/s], each with its own time [ms]."""

    def __init__(self, numbers: MutableMapping[int, int]) -> None:
        self._numbers = numbers
        self.begin()

    def begin(self) -> None:
        """The drive was enabled, or the mode changed: it stands."""
        self._inside_s = self._above_s = 0.0

    def step(self, velocity: float, wanted: float, step_s: float) -> None:
        """Take the measured speed and the one that is wanted, of one step."""
        numbers = self._numbers
        self._inside_s = self._inside_s + step_s if abs(velocity - wanted) <= numbers[_WINDOW] else 0.0
        self._above_s = self._above_s + step_s if abs(velocity) > numbers[_THRESHOLD] else 0.0

    def reached(self, velocity: float, wanted: float) -> bool:
        """The speed is within 606Dh of the wanted one, and has been for the time of 606Eh."""
        inside = abs(velocity - wanted) <= self._numbers[_WINDOW]
        return inside and 1000.0 * self._inside_s >= self._numbers[_WINDOW_TIME]

    def standing(self, velocity: float) -> bool:
        """Not above 606Fh, or not for longer than the time of 6070h."""
        above = abs(velocity) > self._numbers[_THRESHOLD]
        return not (above and 1000.0 * self._above_s > self._numbers[_THRESHOLD_TIME])
