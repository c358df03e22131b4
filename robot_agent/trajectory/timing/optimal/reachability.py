"""The fastest speed along a path under limits of speed and acceleration alone.

Two passes over a grid, by reachability: backwards the largest speed from which the end can still be reached, forwards
as fast as that allows. Source: Pham and Pham, "A new approach to time-optimal path parameterization based on
reachability analysis" (2018); with limits that allow standing still everywhere the controllable sets begin at 0, so
each pass needs one number per grid point.
"""

import numpy as np

from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.path_limits import Rows

_TINY = 1e-12


def fastest_speeds(at: Numbers, rows: Rows, first: float = 0.0) -> Numbers:
    """Squared speeds `(k,)` at the grid `at` `(k,)`, from the squared speed `first` to rest."""
    affine = rows.affine
    a, b, above, below = (each.T.copy() for each in (affine.a, affine.b, affine.above, affine.below))
    flip = a < 0.0
    p, b = np.abs(a), np.where(flip, -b, b)
    above, below = np.where(flip, below, above), np.where(flip, above, below)
    ceiling = np.minimum(np.minimum(rows.fastest, _crossings(p, b, above, below)), _by_jerk(rows))
    step = 2.0 * np.diff(at)
    # backwards: x (p - 2 d b) <= H p + 2 d below for every row
    divisor = p[:, :-1] - step * b[:, :-1]
    bounded = divisor > _TINY
    safe = np.where(bounded, divisor, 1.0)
    slope, offset = np.where(bounded, p[:, :-1] / safe, 0.0), np.where(bounded, step * below[:, :-1] / safe, np.inf)
    reach = _swept(slope[:, ::-1], offset[:, ::-1], np.append(0.0, ceiling[-2::-1]))[::-1]
    # forwards: H p <= x (p - 2 d b) + 2 d above
    bounded = p[:, :-1] > _TINY
    inverse = step / np.where(bounded, p[:, :-1], 1.0)
    slope = 1.0 - np.where(bounded, inverse * b[:, :-1], 0.0)
    offset = np.where(bounded, inverse * above[:, :-1], np.inf)
    return _swept(slope, offset, np.append(first, reach[1:]))


def _swept(slope: Numbers, offset: Numbers, most: Numbers) -> Numbers:
    """x `(k,)`: as large as all lines `slope` x + `offset` `(rows, k - 1)` of the x before and `most` `(k,)` allow.

    The first x is the first of `most`. Lines that are nowhere the least are left out beforehand.
    """
    last = slope * most[:-1] + offset
    least = np.minimum(np.maximum(offset, last).min(axis=0), most[1:])
    rules = (np.minimum(offset, last) <= least).T
    slopes, offsets, ends = slope.T[rules].tolist(), offset.T[rules].tolist(), np.cumsum(rules.sum(axis=1)).tolist()
    x, begin = float(most[0]), 0
    swept = [x]
    for end, ahead in zip(ends, most[1:].tolist(), strict=True):
        for m, c in zip(slopes[begin:end], offsets[begin:end], strict=True):
            bound = m * x + c
            if bound < ahead:
                ahead = bound
        x, begin = max(ahead, 0.0), end
        swept.append(x)
    return np.array(swept)


def times(at: Numbers, squared: Numbers) -> Numbers:
    """Times `(k,)` [s] at which the grid is passed."""
    speed = np.sqrt(squared)
    return np.append(0.0, np.cumsum(2.0 * np.diff(at) / np.maximum(speed[:-1] + speed[1:], 1e-9)))


def _crossings(p: Numbers, b: Numbers, above: Numbers, below: Numbers) -> Numbers:
    """The largest squared speed `(k,)` at which some acceleration satisfies every row; `p` is not negative."""
    # the lower bound that row j sets is at most the upper bound of row i: x (b_i p_j - b_j p_i) <= U_i p_j + D_j p_i
    i, j = np.triu_indices(len(p), 1)
    cross = b[i] * p[j] - b[j] * p[i]
    room = np.where(cross > 0.0, above[i] * p[j] + below[j] * p[i], above[j] * p[i] + below[i] * p[j])
    applies = np.abs(cross) > _TINY
    by_pairs = np.where(applies, room / np.where(applies, np.abs(cross), 1.0), np.inf).min(axis=0, initial=np.inf)
    bound = np.where(b > 0.0, above, below)
    alone = (p <= _TINY) & (np.abs(b) > 0.0)
    by_one = np.where(alone, bound / np.where(alone, np.abs(b), 1.0), np.inf).min(axis=0)
    return np.asarray(np.minimum(by_pairs, by_one))


def _by_jerk(rows: Rows) -> Numbers:
    """The squared speed `(k,)` at which the path's own shape takes all of the jerk."""
    return np.asarray((1.0 / np.maximum(np.abs(rows.third_jerk), 1e-12)).min(axis=1) ** (2.0 / 3.0))
