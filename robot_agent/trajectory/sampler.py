"""From rate laws to the samples on the wire, checked as the drives will see them."""

import math

import numpy as np

from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.rate_law import Numbers, RateLaw, sample_times
from robot_agent.trajectory.rate_search import LONGEST_S
from robot_agent.trajectory.segment import RESTING_SAMPLES, PathState, Segment

_TOLERANCE = 2e-3
"""Relative, for what lies between the points at which the search looked."""
_ROUNDING = 1e-12


class Sampler:
    """Makes segments of one motion."""

    def __init__(self, motion: Motion, limits: Limits, cycle_s: float) -> None:
        self._motion = motion
        self._cycle_s = cycle_s
        self._second = limits.ramp_acceleration * cycle_s**2 * (1.0 + _TOLERANCE) + _ROUNDING
        self._third = limits.ramp_jerk * cycle_s**3 * (1.0 + _TOLERANCE) + _ROUNDING

    def after(self, start: PathState, law: RateLaw, samples: int) -> PathState:
        """The state on `law` that many samples after `start`, at most at the end of the motion."""
        advance, rate, slope, _ = law.at(np.array(samples * self._cycle_s))
        return PathState(min(start.tau + float(advance), self._motion.duration_s), float(rate), float(slope))

    def riding_s(self, start: PathState, law: RateLaw, limit: float) -> float:
        """Time within which `law` reaches tau `limit`; at least the duration of the law."""
        missing = limit - start.tau - float(law.advance)
        return float(law.duration_s) + (max(missing, 0.0) / float(law.target) if law.target > 0.0 else 0.0)

    def ride(
        self, previous: Segment, index: int, start: PathState, law: RateLaw, nominal: int, limit: float, who: str
    ) -> Segment | None:
        """`law` from sample `index` of `previous` up to tau `limit`, where it or the plan rests."""
        riding_s = self.riding_s(start, law, limit)
        if riding_s >= LONGEST_S + nominal * self._cycle_s:
            return None
        t = sample_times(max(nominal, math.ceil(riding_s / self._cycle_s)) + 1, self._cycle_s)
        advance, rate, slope, _ = law.at(t)
        return self._segment(previous, index, start.tau + advance, rate, slope, nominal, limit, who)

    def brake(
        self,
        previous: Segment,
        index: int,
        start: PathState,
        law: RateLaw,
        nominal: int,
        ramp: RateLaw,
        limit: float,
        who: str,
    ) -> Segment | None:
        """`law` for `nominal` samples, then `ramp` to rest, at tau `limit` at the latest."""
        advance, rate, slope, _ = law.at(sample_times(nominal + 1, self._cycle_s))
        head = start.tau + advance
        t = sample_times(math.ceil(float(ramp.duration_s) / self._cycle_s - 1e-9) + 1, self._cycle_s)[1:]
        more, ramp_rate, ramp_slope, _ = ramp.at(t)
        tau = np.concatenate([head, head[-1] + more])
        rates, slopes = np.concatenate([rate, ramp_rate]), np.concatenate([slope, ramp_slope])
        return self._segment(previous, index, tau, rates, slopes, nominal, limit, who)

    def stand(self, previous: Segment, index: int, who: str) -> Segment:
        """Standing where sample `index` of `previous` is; only where the plan itself rests."""
        tau = np.full(RESTING_SAMPLES, previous.state(index).tau)
        still, q = np.zeros(RESTING_SAMPLES), self._motion.q(tau)
        return Segment(tau, still, still, q, np.zeros_like(q), 0, who, previous.history(index), self._cycle_s)

    def _segment(
        self,
        previous: Segment,
        index: int,
        tau: Numbers,
        rate: Numbers,
        slope: Numbers,
        nominal: int,
        limit: float,
        who: str,
    ) -> Segment | None:
        """The samples if the joints keep the `ramp` limits in them, the join included; else None."""
        tau = np.maximum.accumulate(np.minimum(tau, limit))
        rest = int(np.argmax(tau >= tau[-1]))
        kept = np.minimum(np.arange(rest + RESTING_SAMPLES), len(tau) - 1)
        kept[rest:] = len(tau) - 1
        moving = np.arange(len(kept)) < rest
        tau, rate, slope = tau[kept], np.where(moving, rate[kept], 0.0), np.where(moving, slope[kept], 0.0)
        q, before = self._motion.q(tau), previous.history(index)
        steps = np.diff(np.concatenate([before, q]), n=2, axis=0)
        if (np.abs(steps[1:]) > self._second).any() or (np.abs(np.diff(steps, axis=0)) > self._third).any():
            return None
        qd = rate[:, None] * self._motion.qd(tau)
        return Segment(tau, rate, slope, q, qd, min(nominal, rest), who, before, self._cycle_s)
