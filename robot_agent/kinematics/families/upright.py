"""Poses of robots that can only turn their flange about the vertical."""

import numpy as np

from cell.geometry.arrays import Array

TILT_TOLERANCE_RAD = 1e-6
"""An orientation this close to one that the robot can take is rounding of the caller's numbers."""


def tilt(elements: Array) -> Array:
    """Angle [rad] `(p,)` between the Z axis of each pose `(4, 4, p)` and the vertical; 0 within the tolerance."""
    x, y, z = elements[:3, 2]
    angle = np.arctan2(np.sqrt(x * x + y * y), z)
    return np.where(angle > TILT_TOLERANCE_RAD, angle, 0.0)


def heading(elements: Array) -> Array:
    """Angle C [rad] `(p,)` of poses that are turned about the vertical `(4, 4, p)`."""
    return np.asarray(np.arctan2(elements[1, 0], elements[0, 0]))
