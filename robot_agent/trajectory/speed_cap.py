"""A bound on the speed of the TCP along one track: how fast path time may advance where."""

import numpy as np

from robot_agent.trajectory.rate_law import Numbers
from robot_agent.trajectory.track import Track

_STEP_S = 0.002
_CHUNK = 128
_MARGIN = 0.995
"""For what lies between the places at which the speed is looked at."""
_REACH_S = 0.5
"""A segment at rate 1 does not come much further than this before it rests."""


class SpeedCap:
    """The same for all segments of one track; speeds are worked out chunk by chunk, when they are asked for first."""

    def __init__(self, track: Track, cap_m_s: float) -> None:
        """`cap_m_s` is above 0 [m/s]."""
        self.cap_m_s = cap_m_s
        steps = int(np.ceil(track.duration_s / _STEP_S)) + 1
        self._track = track
        self._way = np.minimum(np.arange(steps) * _STEP_S, track.duration_s)
        self._speed = np.zeros(steps)
        self._made: set[int] = set()

    @property
    def who(self) -> str:
        """For people."""
        return f"speed of the TCP, at most {1000.0 * self.cap_m_s:.0f} mm/s"

    def kept(self, way: Numbers, rate: Numbers) -> bool:
        """Whether the TCP stays below the cap at each way `(m,)` [s] with its rate `(m,)`."""
        return bool((rate * self._at(way) <= self.cap_m_s).all())

    def rate(self, way: float, rate: float) -> float:
        """The largest rate that may be kept from `way` [s] on until a segment rests; `rate` is the present one."""
        first = min(int(way / _STEP_S), len(self._speed) - 1)
        peaks = np.maximum.accumulate(self._known(first, first + int(_REACH_S / _STEP_S))[first:])
        reach = np.arange(len(peaks)) * _STEP_S / _REACH_S
        allowed = reach * peaks <= _MARGIN * self.cap_m_s
        last = max(int(np.argmin(allowed)) - 1 if not allowed.all() else len(peaks) - 1, 0)
        last = min(max(last, int(rate * _REACH_S / _STEP_S)), len(peaks) - 1)
        return min(1.0, _MARGIN * self.cap_m_s / max(float(peaks[last]), 1e-9))

    def _at(self, way: Numbers) -> Numbers:
        index = np.minimum((way / _STEP_S).astype(np.int64), len(self._speed) - 1)
        following = np.minimum(index + 1, len(self._speed) - 1)
        known = self._known(int(index.min(initial=len(self._speed))), int(following.max(initial=0)))
        speed: Numbers = np.maximum(known[index], known[following])
        return speed

    def _known(self, first: int, last: int) -> Numbers:
        """The speeds up to index `last`, worked out from `first` on."""
        for chunk in range(first // _CHUNK, min(last, len(self._way) - 1) // _CHUNK + 1):
            if chunk not in self._made:
                part = slice(chunk * _CHUNK, (chunk + 1) * _CHUNK)
                self._speed[part] = self._track.motion.tcp_speed(self._track.taus(self._way[part]))
                self._made.add(chunk)
        return self._speed[: last + 1]
