"""How much slower joints over time would have to be to keep their limits."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.limits import Limits

Numbers = NDArray[np.float64]

_PLACES = 17
"""In each piece at which it is looked at, both ends included."""


def joints_slower_by(pieces: Pieces, limits: Limits) -> float:
    """The factor on the clock, below 1 where the joints could be faster; speed, acceleration and jerk together."""
    speed, acceleration, jerk = pieces.inside(_PLACES)
    lower, upper = limits.acceleration_bounds
    used = (
        np.abs(speed) / limits.velocity,
        np.maximum(acceleration / lower, acceleration / upper),
        np.abs(jerk) / limits.jerk,
    )
    return slower_by(used)


def slower_by(used: Sequence[Numbers] | Numbers) -> float:
    """The factor on the clock for what is used of limits of speed, acceleration and jerk, shares of each."""
    return max(math.pow(each.max(), 1.0 / order) for order, each in enumerate(used, 1))
