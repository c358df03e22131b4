"""What the measured positions of one robot say: is it at rest, does it follow its command."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drive_gateway.config.settings import AxisSettings

Floats = NDArray[np.float64]

REST_S = 0.1
"""A robot is at rest when no axis left its window for this long."""
REST_WINDOW = 2e-4
"""[rad or m] window of one axis, at least three counts: 2 mrad/s or 2 mm/s over `REST_S`."""


class RestDetector:
    """Measured standstill: positions stay within a window around an anchor."""

    def __init__(self, axes: Sequence[AxisSettings]) -> None:
        self._window: Floats = np.array([max(REST_WINDOW, 3.0 / abs(axis.counts_per_unit)) for axis in axes])
        self._anchor: Floats | None = None
        self._since = 0.0

    def update(self, position: Floats, now: float) -> bool:
        """Take the measured axes, `(n,)` [rad or m]; true when they have been at rest for `REST_S`."""
        if self._anchor is None or (np.abs(position - self._anchor) > self._window).any():
            self._anchor = position
            self._since = now
        return now - self._since >= REST_S

    def forget(self) -> None:
        """Nothing is known any more, for example because an axis is silent."""
        self._anchor = None


class FollowingMonitor:
    """The gateway's own look at the following error, beside the drive's (6065h, 6066h).

    It waits longer than the drive, which is meant to speak first and knows more: by as long as a cycle may be late,
    because in a stalled computer a position is old before it says that an axis is blocked.
    """

    def __init__(self, axes: Sequence[AxisSettings], late_s: float) -> None:
        self._window: Floats = np.array([axis.following_window for axis in axes])
        self._time_s = [axis.following_time_s + late_s for axis in axes]
        self._since: dict[int, float] = {}
        self._fresh = True
        self.largest: Floats = np.zeros(len(axes))
        """`(n,)` [rad or m] since the robot was enabled."""

    def update(self, position: Floats, demand: Floats, now: float) -> tuple[int, float] | None:
        """Take measured and demanded axes of one instant; answer the first axis over its time and its error."""
        error = np.abs(position - demand)
        self.largest = error if self._fresh else np.maximum(self.largest, error)
        self._fresh = False
        over = error > self._window
        if not over.any():
            self._since.clear()
            return None
        for axis in np.flatnonzero(over).tolist():
            if now - self._since.setdefault(axis, now) > self._time_s[axis]:
                return axis, float(error[axis])
        for axis in [axis for axis in self._since if not over[axis]]:
            del self._since[axis]
        return None

    def forget(self) -> None:
        """The robot has no torque; `largest` stays until it has some again."""
        self._since.clear()
        self._fresh = True
