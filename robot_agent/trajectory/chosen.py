"""A few out of many limits, others in each interval."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.affine import Numbers


def largest(use: Numbers, count: int) -> NDArray[np.intp]:
    """Numbers `(count, intervals)` of the largest magnitudes in each interval."""
    rest, intervals = np.ascontiguousarray(np.abs(use).T), np.arange(use.shape[1])
    chosen = np.empty((count, use.shape[1]), dtype=np.intp)
    for number in range(count):
        chosen[number] = rest.argmax(axis=1)
        rest[intervals, chosen[number]] = -1.0
    return chosen


def merged(old: Numbers, new: Numbers, known: NDArray[np.bool_]) -> Numbers:
    """Limits `(..., limits, intervals)`: the old ones where they are known, the new ones elsewhere."""
    merged = np.empty((*old.shape[:-2], *known.shape, old.shape[-1]))
    merged[..., known, :], merged[..., ~known, :] = old, new
    return merged


def taken(values: Numbers, at: NDArray[np.intp]) -> Numbers:
    """Of values `(..., m, intervals)` those `(..., n, intervals)` with the numbers `at` `(n, intervals)` out of m."""
    count = values.shape[-1]
    return np.asarray(np.take(values.reshape(*values.shape[:-2], -1), at * count + np.arange(count), axis=-1))
