"""The velocity for displays (2074h): a first-order lag (2073h) behind the measured one. Nothing is controlled by it."""

from collections.abc import MutableMapping

from drive_gateway.sim.dictionary import key_of

_TIME_US, _VELOCITY = key_of(0x2073), key_of(0x2074)


class FilteredVelocity:
    """Keeps 2074h in the numbers of a node's objects."""

    def __init__(self, numbers: MutableMapping[int, int]) -> None:
        self._numbers = numbers
        self._velocity = 0.0

    def reset(self) -> None:
        """The drive starts at standstill."""
        self._velocity = 0.0

    def follow(self, velocity: float, step_s: float) -> None:
        """Take the measured velocity [counts/s] of one step."""
        share = step_s / (step_s + 1e-6 * self._numbers[_TIME_US])
        self._velocity += share * (velocity - self._velocity)
        self._numbers[_VELOCITY] = round(self._velocity)
