"""Bounds of positions: the range of an endless axis (607Bh) and software limits (607Dh).

A drive shows and takes positions within the range, and wraps at its ends. It keeps its own targets within its software
limits, which never cross.
"""

from collections.abc import MutableMapping

from drive_gateway.sim.services.abort import Abort, AccessRefused
from drive_gateway.sim.services.dictionary import key_of
from drive_gateway.sim.services.objects import AxisObjects

_LOWEST, _HIGHEST = key_of(0x607B, 1), key_of(0x607B, 2)
_LEAST, _MOST = -(1 << 31), (1 << 31) - 1
_LOW_LIMIT, _HIGH_LIMIT = key_of(0x607D, 1), key_of(0x607D, 2)


class PositionRange:
    """607Bh of one axis. At its power-on value, all of an int32, nothing wraps."""

    def __init__(self, numbers: MutableMapping[int, int]) -> None:
        self._numbers = numbers

    def shown(self, position: float) -> int:
        """Nearest count of `position`, within the range."""
        span = self._span
        if span is None:
            return clipped(position)
        low = self._numbers[_LOWEST]
        return low + (round(position) - low) % span

    def nearest(self, target: float, place: float) -> float:
        """The position that shows as `target` and is nearest to `place`: the shorter way."""
        span = self._span
        if span is None:
            return target
        return target + span * round((place - target) / span)

    @property
    def _span(self) -> int | None:
        """`None`: nothing wraps."""
        low, high = self._numbers[_LOWEST], self._numbers[_HIGHEST]
        return None if (low == _LEAST and high == _MOST) or high <= low else high - low + 1


def clipped(value: float) -> int:
    """Nearest int32."""
    nearest = round(value)
    if _LEAST <= nearest <= _MOST:
        return nearest
    return _MOST if nearest > 0 else _LEAST


class SoftwareLimits:
    """607Dh of one axis, in the counts that the drive shows. At their power-on values they bound nothing."""

    def __init__(self, objects: AxisObjects) -> None:
        self._numbers = objects.numbers
        objects.guards[_LOW_LIMIT] = lambda low: _ordered(low, self._numbers[_HIGH_LIMIT])
        objects.guards[_HIGH_LIMIT] = lambda high: _ordered(self._numbers[_LOW_LIMIT], high)

    def within(self, target: int) -> int:
        """The target, or the limit that it would pass."""
        return max(self._numbers[_LOW_LIMIT], min(self._numbers[_HIGH_LIMIT], target))


def _ordered(low: int, high: int) -> None:
    if low > high:
        raise AccessRefused(Abort.MAXIMUM_BELOW_MINIMUM)
