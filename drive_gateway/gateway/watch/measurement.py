"""What the measured positions of one robot say about its command: does it follow."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drive_gateway.config.settings import AxisSettings

Floats = NDArray[np.float64]


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
