"""The fastest speed along a path under limits of speed and acceleration alone.

Two passes over a grid, by reachability: backwards the largest speed from which the end can still be reached, forwards
as fast as that allows. Source: Pham and Pham, "A new approach to time-optimal path parameterization based on
reachability analysis" (2018); with limits that allow standing still everywhere the controllable sets begin at 0, so
each pass needs one number per grid point.
"""

from itertools import pairwise

import numpy as np

from robot_agent.trajectory.affine import Numbers, Scaled
from robot_agent.trajectory.path_limits import Rows

_TINY = 1e-12


def fastest_speeds(at: Numbers, rows: Rows, first: float = 0.0) -> Numbers:
    """Squared speeds `(k,)` at the grid `at` `(k,)`, from the squared speed `first` to rest."""
    affine = rows.affine
    flip = affine.a < 0.0
    p, b = np.abs(affine.a), np.where(flip, -affine.b, affine.b)
    above, below = np.where(flip, affine.below, affine.above), np.where(flip, affine.above, affine.below)
    ceiling = np.minimum(np.minimum(rows.fastest, _crossings(Scaled(p, b, above, below))), _by_jerk(rows))
    step = 2.0 * np.diff(at)[:, None]
    # backwards: x (p - 2 d b) <= H p + 2 d below for every row
    divisor = p[:-1] - step * b[:-1]
    bounded = divisor > _TINY
    safe = np.where(bounded, divisor, 1.0)
    slope = np.where(bounded, p[:-1] / safe, 0.0).tolist()
    offset = np.where(bounded, step * below[:-1] / safe, np.inf).tolist()
    reach, ceilings = [0.0] * len(at), ceiling.tolist()
    for k in range(len(at) - 2, -1, -1):
        ahead, least = reach[k + 1], ceilings[k]
        for m, c in zip(slope[k], offset[k], strict=True):
            x = m * ahead + c
            if x < least:
                least = x
        reach[k] = least
    return np.array(_forwards(reach, Scaled(p, b, above, below), step, first))


def _forwards(reach: list[float], rows: Scaled, step: Numbers, first: float) -> list[float]:
    with np.errstate(divide="ignore"):
        inverse = np.where(rows.a > _TINY, 1.0 / np.maximum(rows.a, _TINY), np.inf)
    offset = (step * rows.above[:-1] * inverse[:-1]).tolist()
    slope = (step * (rows.b * np.where(rows.a > _TINY, inverse, 0.0))[:-1]).tolist()
    x, speeds = first, [first]
    for k in range(len(reach) - 1):
        most = reach[k + 1]
        for c, m in zip(offset[k], slope[k], strict=True):
            ahead = x + c - m * x
            if ahead < most:
                most = ahead
        x = max(most, 0.0)
        speeds.append(x)
    return speeds


def times(at: Numbers, squared: Numbers) -> Numbers:
    """Times `(k,)` [s] at which the grid is passed."""
    speed = np.sqrt(squared)
    lengths = [2.0 * d / max(v + w, 1e-9) for d, (v, w) in zip(np.diff(at), pairwise(speed), strict=True)]
    return np.append(0.0, np.cumsum(lengths))


def _crossings(rows: Scaled) -> Numbers:
    """The largest squared speed `(k,)` at which some acceleration satisfies every row; `rows.a` is not negative."""
    p, b = rows.a, rows.b
    # the lower bound that row j sets is at most the upper bound of row i: x (b_i p_j - b_j p_i) <= U_i p_j + D_j p_i
    cross = b[:, :, None] * p[:, None, :]
    cross = cross - np.swapaxes(cross, 1, 2)
    room = rows.above[:, :, None] * p[:, None, :] + rows.below[:, None, :] * p[:, :, None]
    applies = cross > _TINY
    by_pairs = np.where(applies, room / np.where(applies, cross, 1.0), np.inf).min(axis=(1, 2))
    bound = np.where(b > 0.0, rows.above, rows.below)
    alone = (p <= _TINY) & (np.abs(b) > 0.0)
    by_one = np.where(alone, bound / np.where(alone, np.abs(b), 1.0), np.inf).min(axis=1)
    return np.asarray(np.minimum(by_pairs, by_one))


def _by_jerk(rows: Rows) -> Numbers:
    """The squared speed `(k,)` at which the path's own shape takes all of the jerk."""
    return np.asarray((1.0 / np.maximum(np.abs(rows.third_jerk), 1e-12)).min(axis=1) ** (2.0 / 3.0))
