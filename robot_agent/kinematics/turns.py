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
    placed = np.asarray(near - angles)
    placed *= 1 / TURN
    np.rint(placed, out=placed)
    placed *= TURN
    placed += angles
    inside = within(placed, lower, upper)
    if inside.all() or not _limits_reach_beyond_half_a_turn(near, lower, upper):
        return placed, inside
    least = np.ceil((lower - LIMIT_TOLERANCE_RAD - placed) / TURN)
    most = np.floor((upper + LIMIT_TOLERANCE_RAD - placed) / TURN)
    inside = least <= most
    return placed + TURN * np.where(inside, np.minimum(np.maximum(least, 0), most), 0), inside


def _limits_reach_beyond_half_a_turn(near: Array | float, lower: Array | float, upper: Array | float) -> bool:
    """Whether a turn other than the nearest one may lie inside the limits."""
    return bool(np.maximum(upper - near, near - lower).max() > np.pi - LIMIT_TOLERANCE_RAD)


def within(values: Array, lower: Array | float, upper: Array | float) -> Flags:
    """Whether joints lie inside their limits, apart from rounding [rad or m]."""
    inside: Flags = values >= lower - LIMIT_TOLERANCE_RAD
    inside &= values <= upper + LIMIT_TOLERANCE_RAD
    return inside
