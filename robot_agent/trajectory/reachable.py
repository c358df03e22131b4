"""The fastest speed along a path under limits of speed and acceleration alone.

Two passes over a grid, by reachability: backwards the largest speed from which the end can still be reached, forwards
as fast as that allows. Source: Pham and Pham, "A new approach to time-optimal path parameterization based on
reachability analysis" (2018); with limits that allow standing still everywhere the controllable sets begin at 0, so
each pass needs one number per grid point.
"""

from itertools import pairwise

import numpy as np

from robot_agent.trajectory.joint_path import Numbers
from robot_agent.trajectory.path_limits import Rows

_TINY = 1e-12


def fastest_speeds(at: Numbers, rows: Rows) -> Numbers:
    """Squared speeds `(k,)` at the grid `at` `(k,)`, at rest at both ends."""
    flip = np.where(rows.first < 0.0, -1.0, 1.0)
    p, b = rows.first * flip, rows.second * flip
    ceiling = np.minimum(np.minimum(rows.fastest, _crossings(p, b)), _by_jerk(rows))
    step = 2.0 * np.diff(at)
    # backwards: x (p - 2 d b) <= H p + 2 d for every row
    divisor = p[:-1] - step[:, None] * b[:-1]
    bounded = divisor > _TINY
    slope = np.where(bounded, p[:-1] / np.where(bounded, divisor, 1.0), 0.0)
    offset = np.where(bounded, step[:, None] / np.where(bounded, divisor, 1.0), np.inf)
    reach = [0.0] * len(at)
    ceilings, slopes, offsets = ceiling.tolist(), slope.tolist(), offset.tolist()
    for k in range(len(at) - 2, -1, -1):
        ahead, least = reach[k + 1], ceilings[k]
        for m, c in zip(slopes[k], offsets[k], strict=True):
            x = m * ahead + c
            if x < least:
                least = x
        reach[k] = least
    return np.array(_forwards(reach, p, b, step))


def _forwards(reach: list[float], p: Numbers, b: Numbers, step: Numbers) -> list[float]:
    with np.errstate(divide="ignore"):
        inverse = np.where(p > _TINY, 1.0 / np.maximum(p, _TINY), np.inf)
    offset = (step[:, None] * inverse[:-1]).tolist()
    slope = (step[:, None] * (b * np.where(p > _TINY, inverse, 0.0))[:-1]).tolist()
    x, speeds = 0.0, [0.0]
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


def _crossings(p: Numbers, b: Numbers) -> Numbers:
    """The largest squared speed `(k,)` at which some acceleration satisfies every row: |p u + b x| <= 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ceiling = np.full(len(p), np.inf)
        for one in range(p.shape[1]):
            for other in range(one + 1):
                # rows i and j: x |b_i p_j - b_j p_i| <= p_i + p_j
                cross = np.abs(b[:, one] * p[:, other] - b[:, other] * p[:, one])
                bound = (p[:, one] + p[:, other]) / cross if one != other else 1.0 / np.abs(b[:, one])
                applies = (cross > _TINY) if one != other else (p[:, one] <= _TINY)
                ceiling = np.where(applies, np.minimum(ceiling, bound), ceiling)
    return ceiling


def _by_jerk(rows: Rows) -> Numbers:
    """The squared speed `(k,)` at which the path's own shape takes all of the jerk."""
    return np.asarray((1.0 / np.maximum(np.abs(rows.third_jerk), 1e-12)).min(axis=1) ** (2.0 / 3.0))
