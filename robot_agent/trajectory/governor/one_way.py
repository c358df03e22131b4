"""The governor of one direction of travel; all path times here are ways of its travel (`Travel`)."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from robot_agent.trajectory.governor.rate_bounds import RateBounds
from robot_agent.trajectory.governor.rate_law import RateLaw
from robot_agent.trajectory.governor.sampler import Sampler, SegmentStart
from robot_agent.trajectory.governor.segment import PathState, Segment
from robot_agent.trajectory.governor.speed_cap import SpeedCap
from robot_agent.trajectory.governor.steering import Steering
from robot_agent.trajectory.governor.travel import Travel
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion

AT_HOLD_S = 1e-6
"""A stop this close in front of a hold counts as standing at it: below 10 um at any robot's speed."""
_HOLD_MARGIN_S = 2e-9
_SHARES = (1.0, 0.85, 0.65, 0.45, 0.25, 0.1)
"""Of what the joints allow: tried one after the other until the samples keep the limits."""
_RAMPS_OF_FIRST, _RAMPS = _SHARES[:3], _SHARES[:2]
"""Tried after the first way to a rate and after each gentler one: where these are too hard, so are gentler ones."""
_SLOWER = (1.0, 0.5, 0.25, 0.1)
"""Of the goal, from a standstill: a bound near ahead may only be reached at a lower one."""
_ATTEMPTS = 8
_NEAR_S = 1e-3
_VERY_NEAR = 3e-3
"""A stop this close to where it should be, in units of a slope's slope times the cube of the ramp, is bent there."""


@dataclass(frozen=True, slots=True)
class Goal:
    """What is wanted of the next segment: a rate (0 to 1], and a way that must not be passed."""

    rate: float
    who: str
    bound: float = np.inf
    bound_by: str = ""


class OneWay:
    """Makes the segments of one motion in one direction."""

    def __init__(self, motion: Motion, limits: Limits, cycle_s: float, nominal: int, forwards: bool) -> None:
        self.travel = Travel.of(motion, forwards)
        self._cycle_s = cycle_s
        self._nominal = nominal
        self._steering = Steering(RateBounds(self.travel, limits))
        self._sampler = Sampler(self.travel, limits, cycle_s)
        self._cap: SpeedCap | None = None

    def cap(self, cap_m_s: float | None) -> SpeedCap | None:
        """The bound that belongs to a speed of the TCP [m/s]."""
        if cap_m_s is None:
            return None
        if self._cap is None or self._cap.cap_m_s != cap_m_s:
            self._cap = SpeedCap(self.travel, cap_m_s)
        return self._cap

    def start(self, join: SegmentStart, rate: float) -> PathState:
        """The state at a join; where the plan rests the rate may jump to `rate`."""
        state = self.travel.state(join.previous.state(join.index))
        return PathState(state.tau, rate, 0.0) if state.tau in self.travel.rests else state

    def towards(self, join: SegmentStart, goal: Goal) -> Segment:
        """The nominal part towards the goal, then the fastest ramp."""
        state = self.travel.state(join.previous.state(join.index))
        if state.tau >= self.travel.duration_s:
            return join.remainder("")
        if goal.bound - state.tau > AT_HOLD_S:
            goal = self._capped(join.cap, goal, state)
            stands = state.tau in self.travel.rests or (state.rate == 0.0 and state.rate_dot == 0.0)
            for slower in _SLOWER if stands else _SLOWER[:1]:
                moved = self._moved(join, replace(goal, rate=slower * goal.rate))
                if moved is not None:
                    return moved
            if goal.bound == np.inf:
                return join.remainder(goal.who)
        if self._rests_at(join.previous) > goal.bound:
            return self.stop(join, goal.bound_by)
        return join.remainder(goal.bound_by)

    def _moved(self, join: SegmentStart, goal: Goal) -> Segment | None:
        """Freely if that ends in front of the bound, else up to it; None when that is not admissible or not needed."""
        start = self.start(join, goal.rate)
        free = self._onwards(join, start, goal)
        if free is not None and self._rests_at(free) <= goal.bound:
            return free
        return None if goal.bound == np.inf else self._up_to(join, start, goal)

    def stop(self, join: SegmentStart, who: str) -> Segment:
        """The fastest way to rest that ends no farther away than the remainder of the previous segment, else that."""
        start, remainder = self.start(join, 0.0), join.remainder(who)
        if remainder.rest_index == 0 or start.tau in self.travel.rests:
            return self._sampler.stand(join, who)
        limit, farthest = self.travel.next_rest(start.tau), self._rests_at(remainder)
        join = replace(join, cap=None)
        for share in _SHARES:
            ramp = self._steering.change(start, 0.0, join.share * share, limit)
            if ramp.duration_s > remainder.stop_time_s:
                break
            braked = self._sampler.brake(join, start, ramp, 0.0, ramp, limit, who)
            if isinstance(braked, Segment):
                sooner = braked.rest_index < remainder.rest_index and self._rests_at(braked) <= farthest
                return braked if sooner else remainder
        return remainder

    def keeps_cap(self, segment: Segment, index: int, cap: SpeedCap) -> bool:
        """Whether a segment keeps a cap from a sample on."""
        return cap.kept(self.travel.ways(segment.tau[index:]), np.abs(segment.rate[index:]))

    def _capped(self, cap: SpeedCap | None, goal: Goal, state: PathState) -> Goal:
        """The goal at the rate that the cap allows."""
        allowed = 1.0 if cap is None else cap.rate(state.tau, state.rate)
        return goal if cap is None or allowed >= goal.rate else replace(goal, rate=allowed, who=cap.who)

    def _rests_at(self, segment: Segment) -> float:
        return self.travel.way(segment.stop_tau)

    def _laws(self, join: SegmentStart, start: PathState, rate: float) -> Iterator[tuple[RateLaw, tuple[float, ...]]]:
        """Ways to a rate: the one that is under way already, then the fastest, then gentler ones; and ramps' shares."""
        under_way = join.previous.law_from(join.index)
        ramps: tuple[float, ...] = _RAMPS_OF_FIRST
        if under_way is not None and under_way.target == rate and start.rate_dot != 0.0:
            yield under_way, ramps
            ramps = _RAMPS
        for share in _SHARES:
            yield self._steering.change(start, rate, join.share * share), ramps
            if start.rate == rate and start.rate_dot == 0.0:
                return
            ramps = _RAMPS

    def _onwards(self, join: SegmentStart, start: PathState, goal: Goal) -> Segment | None:
        """The nominal part, then the fastest ramp, or on to where the plan itself rests if that is sooner."""
        for law, shares in self._laws(join, start, goal.rate):
            ended = self._ended(join, start, law, shares, goal)
            if ended is not None:
                return ended
        return None

    def _ended(
        self, join: SegmentStart, start: PathState, law: RateLaw, shares: tuple[float, ...], goal: Goal
    ) -> Segment | None:
        """`law` over the nominal part, and its end; None where the joints break a limit whatever the end.

        Without a ramp it ends where the plan rests, if that is not after the bound.
        """
        nominal_s = self._nominal * self._cycle_s
        end = self._sampler.after(start, law, nominal_s)
        limit = self.travel.next_rest(end.tau)
        riding_s = self._sampler.riding_s(start, law, limit) - nominal_s
        for share in shares if riding_s > self._cycle_s else ():
            ramp = self._steering.change(end, 0.0, join.share * share, limit)
            if ramp.duration_s >= riding_s or end.tau + ramp.advance >= limit:
                break
            braked = self._sampler.brake(join, start, law, nominal_s, ramp, limit, goal.who)
            if isinstance(braked, Segment):
                return braked
            if braked <= self._nominal:
                return None
        if limit > goal.bound:
            return None
        ridden = self._sampler.ride(join, start, law, self._nominal, limit, goal.who)
        return ridden if isinstance(ridden, Segment) else None

    def _up_to(self, join: SegmentStart, start: PathState, goal: Goal) -> Segment | None:
        """As far as the bound, braking as late as possible; None when that is not admissible or not needed."""
        if abs(goal.bound - self._rests_at(join.previous)) <= AT_HOLD_S:
            return join.remainder(goal.bound_by)
        last_rest = self.travel.rest_before(goal.bound)
        for law, shares in self._laws(join, start, goal.rate):
            if goal.bound - last_rest <= AT_HOLD_S and last_rest > start.tau:
                ridden = self._sampler.ride(join, start, law, self._nominal, last_rest, goal.bound_by)
                if isinstance(ridden, Segment):
                    return ridden
            ways = 0
            for share in shares:
                found = self._braking_at(start, law, goal.bound - _HOLD_MARGIN_S, join.share * share)
                if found is None:
                    continue
                held = self._sampler.brake(join, start, law, found[0], found[1], goal.bound, goal.bound_by)
                if isinstance(held, Segment):
                    return held
                ways += 1
                if held * self._cycle_s <= found[0]:
                    break
            if ways == 0:
                return None
        return None

    def _braking_at(self, start: PathState, law: RateLaw, stop: float, share: float) -> tuple[float, RateLaw] | None:
        """When on `law` to begin which ramp so that it ends exactly at way `stop`; None when it is too late for that.

        The bracket narrows until the stop is near, then the same ramp a little earlier, later or longer. From rest
        the way grows with the cube of the time, so there its cube root is looked at.
        """
        order = 3.0 if start.rate == 0.0 else 1.0
        high = self._nominal * self._cycle_s
        last, _ = self._stop_of(start, law, high, share, stop)
        if last < 0.0:
            return None
        at_once, _ = self._stop_of(start, law, 0.0, share, stop)
        if at_once > 0.0:
            return None
        begun = (-at_once) ** (1.0 / order)
        a, at_a, b, at_b = 0.0, -begun, high, (last - at_once) ** (1.0 / order) - begun
        part = at_a / (at_a - at_b) if at_b > at_a else 0.0
        for _ in range(_ATTEMPTS):
            t = a + part * (b - a)
            gap, ramp = self._stop_of(start, law, t, share, stop)
            end = self._sampler.after(start, law, t)
            if end.rate_dot == 0.0 and end.rate > 0.0 and abs(gap) < _NEAR_S * end.rate:
                return max(t - gap / end.rate, 0.0), ramp
            if abs(gap) < _VERY_NEAR * float(np.abs(ramp.states[:, 3]).max()) * ramp.duration_s**3:
                return t, ramp.longer(-gap)
            at_t = max(gap - at_once, 0.0) ** (1.0 / order) - begun
            if (at_t > 0.0) == (at_a > 0.0):
                c, at_c = a, at_a
            else:
                c, at_c, b, at_b = b, at_b, a, at_a
            a, at_a = t, at_t
            part = _chandrupatla(a, at_a, b, at_b, c, at_c)
        return None

    def _stop_of(self, start: PathState, law: RateLaw, t: float, share: float, stop: float) -> tuple[float, RateLaw]:
        """How far after way `stop` the ramp that begins on `law` at time `t` ends, and that ramp."""
        end = self._sampler.after(start, law, t)
        ramp = self._steering.change(end, 0.0, share)
        return end.tau + ramp.advance - stop, ramp


def _chandrupatla(a: float, at_a: float, b: float, at_b: float, c: float, at_c: float) -> float:
    """Which part of the way from `a` to `b`, between which a root lies, is to be looked at next.

    `a` is the newest point, `c` the one that it or `b` replaced. Inverse quadratic interpolation where it is certain to
    stay between `a` and `b`, else half way (Chandrupatla 1997).
    """
    if at_a == at_c or at_b == at_c:
        return 0.5
    x, y = (a - b) / (c - b), (at_a - at_b) / (at_c - at_b)
    if y * y >= x or (1.0 - y) ** 2 >= 1.0 - x:
        return 0.5
    return at_a / (at_b - at_a) * at_c / (at_b - at_c) + (c - a) / (b - a) * at_a / (at_c - at_a) * at_b / (at_c - at_b)
