"""Which of the equivalent turns of a revolute joint to take."""

import numpy as np

from cell.geometry.arrays import Array, Flags

TURN = 2 * np.pi
LIMIT_TOLERANCE_RAD = 1e-9
"""A joint this far past its limit is rounding, not a violation [rad or m]."""


def nearest_turn(angles: Array, near: Array | float, lower: Array | float, upper: Array | float) -> tuple[Array, Flags]:
    """Add whole turns to `angles` [rad] so that they lie inside the limits and, there, nearest to `near`.

    Returns the angles and whether a turn inside the limits exists; without one, the turn nearest to `near`.
    """
    turn = angles * (1 / TURN)
    least = np.ceil((lower - LIMIT_TOLERANCE_RAD) / TURN - turn)
    most = np.floor((upper + LIMIT_TOLERANCE_RAD) / TURN - turn)
    wished = np.rint(near / TURN - turn)
    inside = least <= most
    turns = np.where(inside, np.minimum(np.maximum(wished, least), most), wished)
    return angles + TURN * turns, inside


def within(values: Array, lower: Array | float, upper: Array | float) -> Flags:
    """Whether joints that slide lie inside their limits [m]."""
    return (values >= lower - LIMIT_TOLERANCE_RAD) & (values <= upper + LIMIT_TOLERANCE_RAD)
