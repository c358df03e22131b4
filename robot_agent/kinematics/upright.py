"""Poses of robots that can only turn their flange about the vertical."""

import numpy as np

from cell.geometry.arrays import Array

TILT_TOLERANCE_RAD = 1e-6
"""An orientation this close to one that the robot can take is rounding of the caller's numbers."""


def tilt(rotations: Array) -> Array:
    """Angle [rad] `(p,)` between the Z axis of each rotation `(p, 3, 3)` and the vertical; 0 within the tolerance."""
    angle = np.arctan2(np.hypot(rotations[:, 0, 2], rotations[:, 1, 2]), rotations[:, 2, 2])
    return np.where(angle > TILT_TOLERANCE_RAD, angle, 0.0)


def heading(rotations: Array) -> Array:
    """Angle C [rad] `(p,)` of rotations about the vertical `(p, 3, 3)`."""
    return np.asarray(np.arctan2(rotations[:, 1, 0], rotations[:, 0, 0]))
