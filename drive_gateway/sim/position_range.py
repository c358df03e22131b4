"""Counts of an endless axis: the drive shows and takes positions within the range of 607Bh, and wraps at its ends."""

from collections.abc import MutableMapping

from drive_gateway.sim.dictionary import key_of

_LOWEST, _HIGHEST = key_of(0x607B, 1), key_of(0x607B, 2)
_LOW, _HIGH = -(1 << 31), (1 << 31) - 1


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
        return None if (low == _LOW and high == _HIGH) or high <= low else high - low + 1


def clipped(value: float) -> int:
    """Nearest int32."""
    nearest = round(value)
    if _LOW <= nearest <= _HIGH:
        return nearest
    return _HIGH if nearest > 0 else _LOW
