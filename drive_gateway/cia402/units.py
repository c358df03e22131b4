"""Axis position in rad or m to encoder counts and back."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drive_gateway.config.settings import AxisSettings

Floats = NDArray[np.float64]

INT16_MAX = 2**15 - 1
FINITE = float(np.finfo(np.float64).max)


class AxisUnits:
    """Counts of a group of axes: counts = round((position - offset) * counts_per_unit)."""

    def __init__(self, axes: Sequence[AxisSettings]) -> None:
        self._scale = np.array([axis.counts_per_unit for axis in axes], dtype=np.float64)
        self._speed_scale = self._scale / np.array([axis.units.velocity for axis in axes])
        self._offset = np.array([axis.offset for axis in axes], dtype=np.float64)
        fitting = np.array([axis.int32_range for axis in axes])
        allowed = np.array([(-np.inf, np.inf) if axis.limits is None else axis.limits for axis in axes])
        self.lowest: Floats = np.maximum(fitting, allowed)[:, 0]
        """`(n,)` [rad or m] position that fits into an int32 and lies within the axis' limits."""
        self.highest: Floats = np.minimum(fitting, allowed)[:, 1]
        per_mille = [np.nan if axis.torque is None else axis.torque.per_mille for axis in axes]
        self._per_mille = np.nan_to_num(per_mille)
        self.most_torque: Floats = np.where(np.isnan(per_mille), FINITE, INT16_MAX / np.abs(per_mille))
        """`(n,)` [Nm or N] that fits into per mille of a rated torque; of axes without one any finite number."""

    def counts(self, position: Floats) -> list[int]:
        """Nearest counts of `position` (n,) [rad or m], which must fit into an int32."""
        return [int(count) for count in np.rint((position - self._offset) * self._scale).tolist()]

    def speeds(self, velocity: Floats) -> list[int]:
        """Nearest numbers in the drives' own units (60B1h) of `velocity` (n,) [rad/s or m/s]."""
        return [int(speed) for speed in np.rint(velocity * self._speed_scale).tolist()]

    def per_mille(self, torque: Floats) -> list[int]:
        """Nearest per mille of the motors' rated torques for `torque` (n,) [Nm or N] at the axes; 0 without one."""
        return [int(share) for share in np.rint(torque * self._per_mille).tolist()]

    def torque(self, per_mille: Sequence[int]) -> Floats:
        """`(n,)` [Nm or N] at the axes, all of which know their motors' rated torques."""
        return np.asarray(per_mille, dtype=np.float64) / self._per_mille

    def position(self, counts: Sequence[int]) -> Floats:
        """`(n,)` [rad or m] of encoder counts."""
        return np.asarray(counts, dtype=np.float64) / self._scale + self._offset

    def velocity(self, counts_per_s: Sequence[float]) -> Floats:
        """`(n,)` [rad/s or m/s] of counts per second."""
        return np.asarray(counts_per_s, dtype=np.float64) / self._scale
