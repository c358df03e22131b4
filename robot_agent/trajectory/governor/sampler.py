"""From rate laws to the samples on the wire, checked as the drives will see them."""

import math
from dataclasses import dataclass

import numpy as np

from robot_agent.trajectory.governor.rate_law import Numbers, RateLaw, sample_times
from robot_agent.trajectory.governor.segment import RESTING_SAMPLES, PathState, Segment
from robot_agent.trajectory.governor.speed_cap import SpeedCap
from robot_agent.trajectory.governor.travel import Travel
from robot_agent.trajectory.limits import Limits

_TOLERANCE = 2e-3
"""Relative, for what lies between the points at which the search looked."""
_ROUNDING = 1e-12
_LONGEST_S = 8.0
"""Segments that last longer are not made."""
_BEHIND = RESTING_SAMPLES + 2
"""Samples from the last one that may move on; more than rest, since a rounded number of cycles may be one too few."""


@dataclass(frozen=True, slots=True)
class SegmentStart:
    """Where a new segment begins: at sample `index` of `previous`; the cap on its speed, and how gentle it is."""

    previous: Segment
    index: int
    cap: SpeedCap | None
    share: float = 1.0
    """Of what the joints allow, which a new change of the rate uses at most."""

    @property
    def tau(self) -> float:
        """Path time of the join."""
        return float(self.previous.tau[min(self.index, self.previous.length - 1)])

    @property
    def before(self) -> Numbers:
        """`(2, n)` the joints commanded in the two ticks before."""
        return self.previous.history(self.index)

    def remainder(self, who: str) -> Segment:
        """No new segment: the rest of the previous one."""
        return self.previous.remainder(self.index, who)


class Sampler:
    """Makes segments of one travel."""

    def __init__(self, travel: Travel, limits: Limits, cycle_s: float) -> None:
        self._travel = travel
        self._cycle_s = cycle_s
        second = limits.ramp_acceleration_bounds * cycle_s**2 * (1.0 + _TOLERANCE)
        self._second = second + np.array([[-_ROUNDING], [_ROUNDING]])
        self._third = limits.ramp_jerk * cycle_s**3 * (1.0 + _TOLERANCE) + _ROUNDING
        self._times = sample_times(math.ceil(_LONGEST_S / cycle_s) + _BEHIND, cycle_s)

    def after(self, start: PathState, law: RateLaw, t: float) -> PathState:
        """The state on `law` at time `t` [s] after `start`, at most at the end of the travel."""
        advance, rate, slope = law.state(t)
        return PathState(min(start.tau + advance, self._travel.duration_s), rate, slope)

    def riding_s(self, start: PathState, law: RateLaw, limit: float) -> float:
        """Time within which `law` reaches way `limit` [s]; at least the duration of the law."""
        missing = limit - start.tau - law.advance
        return law.duration_s + (max(missing, 0.0) / law.target if law.target > 0.0 else 0.0)

    def ride(
        self, join: SegmentStart, start: PathState, law: RateLaw, nominal: int, limit: float, who: str
    ) -> Segment | int:
        """`law` from `start` up to way `limit`, where it or the plan rests, or the first sample that breaks a limit."""
        riding_s = self.riding_s(start, law, limit)
        if riding_s >= _LONGEST_S:
            return len(self._times)
        last = max(nominal, math.ceil(riding_s / self._cycle_s))
        return self._segment(join, start, law, last, nominal, limit, who, law)

    def brake(
        self, join: SegmentStart, start: PathState, law: RateLaw, until_s: float, ramp: RateLaw, limit: float, who: str
    ) -> Segment | int:
        """`law` for `until_s` [s], then `ramp` to rest at way `limit` [s] at the latest; or as `ride`."""
        whole_s = until_s + ramp.duration_s
        if whole_s >= _LONGEST_S:
            return len(self._times)
        last, nominal = math.ceil(whole_s / self._cycle_s - 1e-9), int(until_s / self._cycle_s + 1e-9)
        begun = law if until_s > 0.0 else None
        return self._segment(join, start, law.then(until_s, ramp), last, nominal, limit, who, begun)

    def stand(self, join: SegmentStart, who: str) -> Segment:
        """Standing at the join; only where the plan itself rests."""
        tau = np.full(RESTING_SAMPLES, join.tau)
        still, q = np.zeros(RESTING_SAMPLES), self._travel.motion.q(tau)
        return Segment(tau, still, still, q, np.zeros_like(q), 0, who, join.before, self._cycle_s)

    def _segment(
        self, join: SegmentStart, start: PathState, law: RateLaw, last: int, nominal: int, limit: float, who: str,
        begun: RateLaw | None,
    ) -> Segment | int:  # fmt: skip
        """The samples of `law` if the joints keep the `ramp` limits in them, the join included, and the cap.

        From sample `last` on the robot rests. Else the first sample that breaks a limit; 0 where nothing moves.
        """
        advance, rate, slope = law.at(self._times[: last + _BEHIND])
        way = np.maximum.accumulate(np.minimum(start.tau + advance, limit))
        rest = int(way.searchsorted(way[-1]))
        if rest == 0:
            return 0
        way, rate, slope = (each[: rest + RESTING_SAMPLES] for each in (way, rate, slope))
        # Where the joints hardly move yet a law may begin with a jump; the join itself is as it was commanded.
        rate[0], slope[0] = start.rate, start.rate_dot
        rate[rest:] = slope[rest:] = 0.0
        if rate.max() > 1.0 + _TOLERANCE:
            return int(rate.argmax())
        if join.cap is not None and not join.cap.kept(way, rate):
            return rest
        tau, sign = self._travel.taus(way), self._travel.sign
        tau[0] = join.tau
        (q, qd), before = self._travel.sampled(tau), join.before
        commanded = np.concatenate([before, q])
        steps = commanded[1:] - commanded[:-1]
        second = steps[2:] - steps[1:-1]
        third = second - (steps[1:-1] - steps[:-2])
        broken = (second < self._second[0]) | (second > self._second[1]) | (np.abs(third) > self._third)
        if broken.any():
            return int(broken.any(axis=1).argmax()) + 1
        rate, slope = sign * rate, sign * slope
        nominal = min(nominal, rest)
        return Segment(tau, rate, slope, q, rate[:, None] * qd, nominal, who, before, self._cycle_s, begun)
