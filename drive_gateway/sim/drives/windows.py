"""Windows of a drive, each with its own time (CiA 402-2): following error, target reached, standstill.

6065h and 6066h say when a following error is a fault; 606Dh and 606Eh that profile velocity has reached its target,
606Fh and 6070h that the axis stands.
"""

from collections.abc import MutableMapping

from drive_gateway.sim.drives.user_units import UserUnits
from drive_gateway.sim.services.dictionary import key_of

_FOLLOWING, _FOLLOWING_TIME = key_of(0x6065), key_of(0x6066)
_WINDOW, _WINDOW_TIME = key_of(0x606D), key_of(0x606E)
_THRESHOLD, _THRESHOLD_TIME = key_of(0x606F), key_of(0x6070)


class FollowingWindow:
    """When the following error is a fault: outside 6065h [counts] for longer than 6066h [ms]."""

    def __init__(self, numbers: MutableMapping[int, int]) -> None:
        self._numbers = numbers
        self.begin()

    def begin(self) -> None:
        """The drive was enabled: it follows."""
        self._outside_s = 0.0

    def left(self, error: float, step_s: float) -> bool:
        """Take the following error of one step; whether it has been outside for too long."""
        self._outside_s = self._outside_s + step_s if abs(error) > self._numbers[_FOLLOWING] else 0.0
        return 1000.0 * self._outside_s > self._numbers[_FOLLOWING_TIME]


class VelocityWindows:
    """Two windows around speeds [counts/s; in their objects the drive's unit], each with its own time [ms]."""

    def __init__(self, numbers: MutableMapping[int, int], units: UserUnits) -> None:
        self._numbers = numbers
        self._units = units
        self.begin()

    def begin(self) -> None:
        """The drive was enabled, or the mode changed: it stands."""
        self._inside_s = self._above_s = 0.0

    def step(self, velocity: float, wanted: float, step_s: float) -> None:
        """Take the measured speed and the one that is wanted, of one step."""
        self._inside_s = self._inside_s + step_s if self._inside(velocity, wanted) else 0.0
        self._above_s = self._above_s + step_s if self._above(velocity) else 0.0

    def reached(self, velocity: float, wanted: float) -> bool:
        """The speed is within 606Dh of the wanted one, and has been for the time of 606Eh."""
        return self._inside(velocity, wanted) and 1000.0 * self._inside_s >= self._numbers[_WINDOW_TIME]

    def standing(self, velocity: float) -> bool:
        """Not above 606Fh, or not for longer than the time of 6070h."""
        return not (self._above(velocity) and 1000.0 * self._above_s > self._numbers[_THRESHOLD_TIME])

    def _inside(self, velocity: float, wanted: float) -> bool:
        return abs(velocity - wanted) <= self._units.velocity * self._numbers[_WINDOW]

    def _above(self, velocity: float) -> bool:
        return abs(velocity) > self._units.velocity * self._numbers[_THRESHOLD]
