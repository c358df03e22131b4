"""Software limits of an axis (607Dh): the drive keeps its own targets within them, and they never cross."""

from drive_gateway.sim.abort import Abort, AccessRefused
from drive_gateway.sim.dictionary import key_of
from drive_gateway.sim.objects import AxisObjects

_LOW, _HIGH = key_of(0x607D, 1), key_of(0x607D, 2)


class SoftwareLimits:
    """607Dh of one axis, in the counts that the drive shows. At their power-on values they bound nothing."""

    def __init__(self, objects: AxisObjects) -> None:
        self._numbers = objects.numbers
        objects.guards[_LOW] = lambda low: _ordered(low, self._numbers[_HIGH])
        objects.guards[_HIGH] = lambda high: _ordered(self._numbers[_LOW], high)

    def within(self, target: int) -> int:
        """The target, or the limit that it would pass."""
        return max(self._numbers[_LOW], min(self._numbers[_HIGH], target))


def _ordered(low: int, high: int) -> None:
    if low > high:
        raise AccessRefused(Abort.MAXIMUM_BELOW_MINIMUM)
