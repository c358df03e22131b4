"""A bound on the speed of the TCP along one travel: how fast path time may advance where."""

import numpy as np

from robot_agent.trajectory.governor.rate_law import Numbers
from robot_agent.trajectory.governor.travel import Travel

_STEP_S = 0.002
_MARGIN = 0.995
"""For what lies between the places at which the speed is looked at."""
_REACH_S = 0.5
"""A segment at rate 1 does not come much further than this before it rests."""
_STRETCH = 50
"""How many places are looked at together, when a segment first comes near one of them: motions may be long."""
_MOST_STRETCHES = 200
"""That are remembered."""


class SpeedCap:
    """The same for all segments of one travel. It holds for the TCP of the mounted tool and for the flange."""

    def __init__(self, travel: Travel, cap_m_s: float) -> None:
        """`cap_m_s` is above 0 [m/s]."""
        self.cap_m_s = cap_m_s
        self._travel = travel
        self._places = int(np.ceil(travel.duration_s / _STEP_S)) + 1
        self._known: dict[int, Numbers] = {}

    @property
    def who(self) -> str:
        """For people."""
        return f"speed of the TCP, at most {1000.0 * self.cap_m_s:.0f} mm/s"

    def kept(self, way: Numbers, rate: Numbers) -> bool:
        """Whether the TCP stays below the cap at each way `(m,)` [s] with its rate `(m,)`."""
        return bool((rate * self._at(way) <= self.cap_m_s).all())

    def rate(self, way: float, rate: float) -> float:
        """The largest rate that may be kept from `way` [s] on until a segment rests; `rate` is the present one."""
        first = min(int(way / _STEP_S), self._places - 1)
        peaks = np.maximum.accumulate(self._speeds(first, first + int(_REACH_S / _STEP_S) + 1))
        reach = np.arange(len(peaks)) * _STEP_S / _REACH_S
        allowed = reach * peaks <= _MARGIN * self.cap_m_s
        last = max(int(np.argmin(allowed)) - 1 if not allowed.all() else len(peaks) - 1, 0)
        last = min(max(last, int(rate * _REACH_S / _STEP_S)), len(peaks) - 1)
        return min(1.0, _MARGIN * self.cap_m_s / max(float(peaks[last]), 1e-9))

    def _at(self, way: Numbers) -> Numbers:
        if not len(way):
            return way
        index = np.minimum((way / _STEP_S).astype(np.int64), self._places - 1)
        following = np.minimum(index + 1, self._places - 1)
        first = int(index.min())
        speeds = self._speeds(first, int(following.max()) + 1)
        return np.asarray(np.maximum(speeds[index - first], speeds[following - first]))

    def _speeds(self, first: int, end: int) -> Numbers:
        """At rate 1, at the places `first` to `end` of the travel, as far as it goes."""
        end = min(end, self._places)
        stretches = range(first // _STRETCH, -(-end // _STRETCH))
        new = np.array([each for each in stretches if each not in self._known])
        if len(new):
            if len(self._known) >= _MOST_STRETCHES:
                self._known.clear()
                new = np.array(stretches)
            taus = (new[:, None] * _STRETCH + np.arange(_STRETCH)) * _STEP_S
            taus = self._travel.taus(np.minimum(taus, self._travel.duration_s))
            motion = self._travel.motion
            self._known.update(zip(new.tolist(), motion.model.tool_speed(motion.q(taus), motion.qd(taus)), strict=True))
        speeds = np.concatenate([self._known[each] for each in stretches])
        return speeds[first - stretches.start * _STRETCH : end - stretches.start * _STRETCH]
