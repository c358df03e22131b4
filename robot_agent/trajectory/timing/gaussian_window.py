"""The window of the filter on the axes: a Gaussian, constant in each of its cells."""

import math

import numpy as np
from numpy.typing import NDArray

SIGMA = 0.4
"""Standard deviation in halves of the window; the source leaves it open."""
_FEWEST_CELLS = 16
_LONGEST_CELL_S = 2e-3


def gaussian_weights(count: int, sigma: float = SIGMA) -> NDArray[np.float64]:
    """`(count,)` weights of a Gaussian window, their sum 1.

    Source: Frigeni, Industrial Robotics Control, (7-54) to (7-57); (7-56) has to read f[n - i], and a window of N has
    N + 1 weights.
    """
    half = (count - 1) / 2.0
    weights = np.exp(-(((np.arange(count) - half) / (sigma * half)) ** 2) / 2.0)
    return np.asarray(weights / weights.sum())


def spread_s(window_s: float) -> float:
    """A step of the acceleration by a [m/s^2] leaves the filter with a jerk of at most a divided by this time."""
    cells = window_cells(window_s)
    return window_s / cells / float(gaussian_weights(cells).max())


def window_cells(window_s: float) -> int:
    """Cells of equal length in a window, at most 2 ms each."""
    return max(_FEWEST_CELLS, math.ceil(window_s / _LONGEST_CELL_S))
