"""The governor of path time: how fast a planned motion advances, and how it comes to rest.

Planned time tau advances at a rate: 1 is as planned, 0 stands. Whoever wants less than the plan asks for a lower rate
or for a tau not to be passed; the lowest rules and the robot never leaves its path (`docs/architecture.md`, sections
5.1 and 5.2). Every answer is a segment that ends at rest, so it can be played out with no one left to ask.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.rate_law import RateLaw, sample_times
from robot_agent.trajectory.rate_search import RateSearch
from robot_agent.trajectory.sampler import Sampler
from robot_agent.trajectory.segment import RESTING_SAMPLES, PathState, Segment

_AT_HOLD_S = 1e-6
"""A stop this close in front of a hold counts as standing at it: below 10 um at any robot's speed."""
_HOLD_MARGIN_S = 2e-9


@dataclass(frozen=True, slots=True)
class RateRequest:
    """Someone's wish to go no faster than `rate` (0 to 1; 0 stops) and who that is, for people."""

    rate: float
    who: str


@dataclass(frozen=True, slots=True)
class Hold:
    """A `tau` [s] that must not be passed and who says so, for people."""

    tau: float
    who: str


class Governor:
    """Answers, for one motion, with the next segment; pure, the same question has the same answer."""

    def __init__(self, motion: Motion, limits: Limits, cycle_s: float, nominal_s: float) -> None:
        """`cycle_s` is the period of the samples, `nominal_s` the length of a segment before its braking ramp."""
        self._motion = motion
        self._cycle_s = cycle_s
        self._nominal = round(nominal_s / cycle_s)
        self._rests = motion.rests
        self._search = RateSearch(motion, limits, cycle_s)
        self._sampler = Sampler(motion, limits, cycle_s)

    def rest(self, tau: float) -> Segment:
        """Standing at `tau` [s]."""
        taus = np.full(RESTING_SAMPLES, min(max(tau, 0.0), self._motion.duration_s))
        still, q = np.zeros(RESTING_SAMPLES), self._motion.q(taus)
        return Segment(taus, still, still, q, np.zeros_like(q), 0, "", q[:2], self._cycle_s)

    def next(
        self,
        previous: Segment,
        index: int,
        requests: Sequence[RateRequest],
        holds: Sequence[Hold],
        stop: bool = False,
    ) -> Segment:
        """The segment that joins `previous` at its sample `index` (0 or more; behind its end it stands).

        Towards the lowest of `requests` (1 when there is none) for the nominal part, then the fastest braking ramp
        found within the `ramp` limits. It comes to rest at or before the nearest of `holds`, and reaches it to 2 ns of
        tau when it has to wait there. `stop` brakes at once. When nothing better is admissible the answer is the
        remainder of `previous`, which ends at rest. A hold that is set too near to stop for is answered by the
        fastest stop.
        """
        join = previous.state(index)
        request = min(requests, key=lambda each: each.rate, default=RateRequest(1.0, ""))
        hold = min(holds, key=lambda each: each.tau, default=Hold(np.inf, ""))
        if stop or request.rate <= 0.0:
            return self._stop(previous, index, "stop" if stop else request.who)
        if join.tau >= self._motion.duration_s:
            return previous.remainder(index, "")
        if hold.tau - join.tau > _AT_HOLD_S:
            target = min(request.rate, 1.0)
            start = PathState(join.tau, target, 0.0) if join.tau in self._rests else join
            laws = self._search.changes(start, target)
            who = request.who if target < 1.0 else ""
            free = self._onwards(previous, index, start, laws, who)
            if free is not None and free.stop_tau <= hold.tau:
                return free
            if hold.tau == np.inf:
                return previous.remainder(index, who)
            held = self._up_to(previous, index, start, laws, hold)
            if held is not None:
                return held
        if previous.stop_tau > hold.tau:
            return self._stop(previous, index, hold.who)
        return previous.remainder(index, hold.who)

    def _onwards(
        self, previous: Segment, index: int, start: PathState, laws: list[RateLaw], who: str
    ) -> Segment | None:
        """The nominal part, then the fastest ramp, or on to where the plan itself rests if that is sooner."""
        for law in laws:
            end = self._sampler.after(start, law, self._nominal)
            limit = self._next_rest(end.tau)
            riding_s = self._sampler.riding_s(start, law, limit) - self._nominal * self._cycle_s
            for ramp in self._search.ramps(end, limit):
                if ramp.duration_s >= riding_s:
                    break
                braked = self._sampler.brake(previous, index, start, law, self._nominal, ramp, limit, who)
                if braked is not None:
                    return braked
            ridden = self._sampler.ride(previous, index, start, law, self._nominal, limit, who)
            if ridden is not None:
                return ridden
        return None

    def _up_to(
        self, previous: Segment, index: int, start: PathState, laws: list[RateLaw], hold: Hold
    ) -> Segment | None:
        """As far as `hold`, braking as late as possible; None when that is not admissible or not needed."""
        if abs(hold.tau - previous.stop_tau) <= _AT_HOLD_S:
            return previous.remainder(index, hold.who)
        last_rest = float(self._rests[int(np.searchsorted(self._rests, hold.tau, side="right")) - 1])
        for law in laws:
            if hold.tau - last_rest <= _AT_HOLD_S and last_rest > start.tau:
                ridden = self._sampler.ride(previous, index, start, law, self._nominal, last_rest, hold.who)
                if ridden is not None:
                    return ridden
            advance, rate, slope, _ = law.at(sample_times(self._nominal + 1, self._cycle_s))
            for nominal, ramp in self._search.stops_at(start.tau + advance, rate, slope, hold.tau - _HOLD_MARGIN_S):
                held = self._sampler.brake(previous, index, start, law, nominal, ramp, hold.tau, hold.who)
                if held is not None:
                    return held
        return None

    def _stop(self, previous: Segment, index: int, who: str) -> Segment:
        """The fastest way to rest from sample `index` of `previous`; its remainder if nothing is faster."""
        start, remainder = previous.state(index), previous.remainder(index, who)
        if remainder.rest_index == 0 or start.tau in self._rests:
            return self._sampler.stand(previous, index, who)
        limit = self._next_rest(start.tau)
        for ramp in self._search.ramps(start, limit):
            braked = self._sampler.brake(previous, index, start, ramp, 0, ramp, limit, who)
            if braked is not None and braked.rest_index < remainder.rest_index:
                return braked
        return remainder

    def _next_rest(self, tau: float) -> float:
        """The first tau from `tau` on at which the plan itself rests."""
        return float(self._rests[min(int(np.searchsorted(self._rests, tau)), len(self._rests) - 1)])
