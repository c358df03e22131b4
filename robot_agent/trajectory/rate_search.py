"""Which changes of the rate the joints allow: many candidates looked at together, at a few points each."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.rate_law import Numbers, RateLaw, stopping_in
from robot_agent.trajectory.segment import PathState

LONGEST_S = 8.0
"""Changes of the rate that take longer are not looked for."""
_GROWTH = 1.12
_FEW_POINTS = 5
_MANY_POINTS = 32
_GROUP = 8
_WANTED = 4
_RATE_TOLERANCE = 1e-9


class RateSearch:
    """Finds candidates; what is really sent is checked sample by sample afterwards (`Sampler`).

    Along a path the joints' acceleration is r^2 q'' + r' q' and their jerk r^3 q''' + 3 r r' q'' + r'' q', with the
    derivatives of q by tau and those of the rate r by time. Both stay within the `ramp` limits.
    """

    def __init__(self, motion: Motion, limits: Limits, cycle_s: float) -> None:
        self._motion = motion
        self._acceleration = limits.ramp_acceleration
        self._jerk = limits.ramp_jerk
        steps = int(np.log(LONGEST_S / cycle_s) / np.log(_GROWTH))
        self._durations: Numbers = 2.0 * cycle_s * _GROWTH ** np.arange(steps, dtype=np.float64)

    def changes(self, start: PathState, target: float) -> list[RateLaw]:
        """Up to four ways from `start` to the rate `target`, the fastest first."""
        if start.rate == target and start.rate_dot == 0.0:
            return [RateLaw.one(target, 0.0, target, float(self._durations[0]))]
        laws = self._laws(start, target, self._durations)
        return [laws.pick(k) for k in self._admissible(laws, np.array([[start.tau]]), np.inf)]

    def ramps(self, start: PathState, limit: float) -> list[RateLaw]:
        """Up to four ways from `start` to rate 0, the fastest first; at tau `limit` the plan itself rests."""
        durations = self._durations
        if start.rate_dot < 0.0:
            # the longest cubic that does not fall below zero
            longest = -3.0 * start.rate / start.rate_dot
            durations = np.append(durations[durations < longest], max(longest, durations[0] / 4.0))
        laws = self._laws(start, 0.0, durations)
        return [laws.pick(k) for k in self._admissible(laws, np.array([[start.tau]]), limit)]

    def stops_at(self, tau: Numbers, rate: Numbers, slope: Numbers, end: float) -> list[tuple[int, RateLaw]]:
        """Ramps from states `(k,)` that come to rest exactly at tau `end`: (state, ramp), the last state first."""
        room = end - tau
        duration = stopping_in(rate, slope, np.maximum(room, 0.0))
        usable = np.flatnonzero((room > 0.0) & (duration >= self._durations[0]) & (duration < LONGEST_S))[::-1]
        if len(usable) == 0:
            return []
        columns = [each[usable, None] for each in (rate, slope, np.zeros_like(rate), duration)]
        laws = RateLaw(*columns)
        return [(int(usable[k]), laws.pick(k)) for k in self._admissible(laws, tau[usable, None], np.inf)]

    def _laws(self, start: PathState, target: float, durations: Numbers) -> RateLaw:
        one = np.ones((len(durations), 1))
        return RateLaw(start.rate * one, start.rate_dot * one, target * one, durations[:, None])

    def _admissible(self, laws: RateLaw, tau: Numbers, limit: float) -> list[int]:
        """The first few of the laws `(k, 1)` from `tau` `(k, 1)` or `(1, 1)` that keep the limits, in their order."""
        tau = np.broadcast_to(tau, laws.duration_s.shape)
        promising = np.flatnonzero(self._keeps(laws, tau, limit, _FEW_POINTS))
        found: list[int] = []
        for first in range(0, len(promising), _GROUP):
            group = promising[first : first + _GROUP]
            some = RateLaw(laws.rate[group], laws.slope[group], laws.target[group], laws.duration_s[group])
            found += group[self._keeps(some, tau[group], limit, _MANY_POINTS)].tolist()
            if len(found) >= _WANTED:
                break
        return found[:_WANTED]

    def _keeps(self, laws: RateLaw, tau: Numbers, limit: float, points: int) -> NDArray[np.bool_]:
        advance, rate, slope, bend = laws.at(laws.duration_s * np.linspace(0.0, 1.0, points))
        reached = tau + advance
        first, second, third = self._motion.pieces.derivatives(reached)
        r, d = rate[..., None], slope[..., None]
        acceleration = r**2 * second + d * first
        jerk = r**3 * third + 3.0 * r * d * second + bend[..., None] * first
        kept = (np.abs(acceleration) <= self._acceleration).all(-1) & (np.abs(jerk) <= self._jerk).all(-1)
        kept &= (rate >= -_RATE_TOLERANCE) & (rate <= 1.0 + _RATE_TOLERANCE)
        return np.asarray((kept | (reached >= limit)).all(axis=1))
