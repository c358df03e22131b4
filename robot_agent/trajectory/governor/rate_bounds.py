"""What the joints allow the rate of path time, tabulated along the way.

Along a path the joints' acceleration is r^2 q'' + r' q' and their jerk r^3 q''' + 3 r r' q'' + r'' q', with the
derivatives of q by tau and those of the rate r by time (chain rule). Divided by q' the bounds of one joint become

    -B <= r' + r^2 q''/q' <= A   and   |r'' + r^3 q'''/q' + 3 r r' q''/q'| <= J/|q'|

where A is what the joint may accelerate in the direction in which it moves, over |q'|, and B the same against it.
"""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.governor.travel import Numbers, Travel
from robot_agent.trajectory.limits import Limits

Row = list[list[float]]
"""For each joint that may rule: -B, A, J/|q'|, q''/q', q'''/q'."""

_STEP_S = 0.004
_CHUNK = 64
_MOST_ROWS = 64 * _CHUNK
"""That are remembered, some 16 s of the way: a slow motion may last for hours."""
_ACCELERATION_MARGIN, _JERK_MARGIN = 0.98, 0.94
"""For what lies between the steps in which the bounds are used."""
_STANDING = 1e-7
"""[rad/s or m/s] Below this a joint counts as moving this fast: its quotients stay finite."""


class RateBounds:
    """Rows are made chunk by chunk, when they are asked for first."""

    def __init__(self, travel: Travel, limits: Limits) -> None:
        self._travel = travel
        self._acceleration = _ACCELERATION_MARGIN * limits.ramp_acceleration_bounds[:, None]
        self._jerk = _JERK_MARGIN * limits.ramp_jerk
        self._rows: dict[int, Row] = {}
        self._last = max(int(travel.duration_s / _STEP_S), 1) - 1

    def row(self, way: float) -> Row:
        """The row nearest to `way` [s]."""
        row = self._rows.get(int(way / _STEP_S))
        return self._made(way) if row is None else row

    def _made(self, way: float) -> Row:
        index = min(max(int(way / _STEP_S), 0), self._last)
        if index not in self._rows:
            if len(self._rows) >= _MOST_ROWS:
                self._rows.clear()
            first = index - index % _CHUNK
            self._rows.update(enumerate(self._make(first, min(first + _CHUNK, self._last + 1)), first))
        return self._rows[index]

    def _make(self, first: int, last: int) -> list[Row]:
        speed, second, third = self._travel.derivatives((np.arange(first, last, dtype=np.float64) + 0.5) * _STEP_S)
        inverse = 1.0 / np.where(np.abs(speed) < _STANDING, np.copysign(_STANDING, speed), speed)
        table = np.empty((5, *speed.shape))
        one, other = self._acceleration * inverse
        np.minimum(one, other, out=table[0])
        np.maximum(one, other, out=table[1])
        np.multiply(self._jerk, np.abs(inverse), out=table[2])
        np.multiply(second, inverse, out=table[3])
        np.multiply(third, inverse, out=table[4])
        ruling = _may_rule(table)
        bounds, ends = table.transpose(1, 2, 0)[ruling].tolist(), np.cumsum(ruling.sum(axis=1)).tolist()
        return [bounds[begin:end] for begin, end in pairwise([0, *ends])]


def _may_rule(table: Numbers) -> NDArray[np.bool_]:
    """Which joints of the rows `(5, m, n)` may have the least bound at a rate of 0 to 1: `(m, n)`.

    Each is compared with the one that has the least bound at rest. A bound on the slope is linear in r^2, so r = 0 and
    r = 1 tell. One on the slope's slope is nowhere the least if it is larger by more than the terms of the path differ
    at the steepest slope that the other joint allows.
    """
    row, ruler = np.arange(table.shape[1]), table[2].argmin(axis=1)
    least = table[:, row, ruler, None]
    steepest = np.abs(least[:2]).max(axis=0) + np.abs(least[3])
    lowest, highest, jerk, second, third = table - least
    may_rule = (lowest > np.minimum(second, 0.0)) | (highest < np.maximum(second, 0.0))
    may_rule |= jerk < np.abs(third) + 3.0 * steepest * np.abs(second)
    may_rule[row, ruler] = True
    return np.asarray(may_rule)
