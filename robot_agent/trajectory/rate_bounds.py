"""What the joints allow the rate of path time, tabulated along the way.

Along a path the joints' acceleration is r^2 q'' + r' q' and their jerk r^3 q''' + 3 r r' q'' + r'' q', with the
derivatives of q by tau and those of the rate r by time (chain rule). Divided by q' the bounds of one joint become

    -B <= r' + r^2 q''/q' <= A   and   |r'' + r^3 q'''/q' + 3 r r' q''/q'| <= J/|q'|

where A is what the joint may accelerate in the direction in which it moves, over |q'|, and B the same against it.
"""

import numpy as np

from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.track import Track

Row = list[list[float]]
"""For each joint -B, A, J/|q'|, q''/q', q'''/q'."""

_STEP_S = 0.004
_CHUNK = 128
_ACCELERATION_MARGIN, _JERK_MARGIN = 0.98, 0.95
"""For what lies between the steps in which the bounds are used."""
_STANDING = 1e-7
"""[rad/s or m/s] Below this a joint counts as moving this fast: its quotients stay finite."""


class RateBounds:
    """Rows are made chunk by chunk, when they are asked for first."""

    def __init__(self, track: Track, limits: Limits) -> None:
        self._track = track
        self._acceleration = _ACCELERATION_MARGIN * limits.ramp_acceleration_bounds
        self._jerk = _JERK_MARGIN * limits.ramp_jerk
        self._chunks: dict[int, list[Row]] = {}
        self._last = max(int(track.duration_s / _STEP_S), 1) - 1

    def row(self, way: float) -> Row:
        """The row nearest to `way` [s]."""
        index = min(max(int(way / _STEP_S), 0), self._last)
        chunk = self._chunks.get(index // _CHUNK)
        if chunk is None:
            chunk = self._chunks[index // _CHUNK] = self._make(index // _CHUNK)
        return chunk[index % _CHUNK]

    def _make(self, chunk: int) -> list[Row]:
        way = (np.arange(chunk * _CHUNK, (chunk + 1) * _CHUNK) + 0.5) * _STEP_S
        first, second, third = self._track.derivatives(np.minimum(way, (self._last + 0.5) * _STEP_S))
        first = np.where(np.abs(first) < _STANDING, np.copysign(_STANDING, first), first)
        table, inverse = np.empty((*first.shape, 5)), 1.0 / first
        one, other = self._acceleration[0] * inverse, self._acceleration[1] * inverse
        np.minimum(one, other, out=table[..., 0])
        np.maximum(one, other, out=table[..., 1])
        np.multiply(self._jerk, np.abs(inverse), out=table[..., 2])
        np.multiply(second, inverse, out=table[..., 3])
        np.multiply(third, inverse, out=table[..., 4])
        rows: list[Row] = table.tolist()
        return rows
