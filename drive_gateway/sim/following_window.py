"""When a drive takes its following error for a fault: outside 6065h for longer than the time of 6066h (CiA 402-2)."""

from collections.abc import MutableMapping

from drive_gateway.sim.dictionary import key_of

_WINDOW, _TIME = key_of(0x6065), key_of(0x6066)


class FollowingWindow:
    """The window [counts] around the demanded position, and its time [ms]."""

    def __init__(self, numbers: MutableMapping[int, int]) -> None:
        self._numbers = numbers
        self.begin()

    def begin(self) -> None:
        """The drive was enabled: it follows."""
        self._outside_s = 0.0

    def left(self, error: float, step_s: float) -> bool:
        """Take the following error of one step; whether it has been outside for too long."""
        self._outside_s = self._outside_s + step_s if abs(error) > self._numbers[_WINDOW] else 0.0
        return 1000.0 * self._outside_s > self._numbers[_TIME]
