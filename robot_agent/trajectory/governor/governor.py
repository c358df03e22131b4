"""The governor of path time: how fast a planned motion advances, and how it comes to rest.

Planned time tau advances at a rate: 1 is as planned, 0 stands, a negative one travels backwards along the path. Whoever
wants less than the plan asks for a lower rate, or for an interval of tau not to be entered; the lowest rules and the
robot never leaves its path (`docs/architecture.md`, sections 5.1 and 5.2). Every answer is a segment that ends at rest,
so it can be played out with no one left to ask.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from robot_agent.trajectory.governor.one_way import Goal, OneWay
from robot_agent.trajectory.governor.sampler import SegmentStart
from robot_agent.trajectory.governor.segment import RESTING_SAMPLES, Segment
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.motion import Motion

_SLOWEST = 1e-4
"""A lower rate counts as 0."""
_CREEPS = 0.05
"""A headway asks for no lower rate: a robot comes to the hold in the end."""


@dataclass(frozen=True, slots=True)
class RateRequest:
    """Someone's wish to go no faster than `rate` (-1 to 1; 0 stops) and who that is, for people.

    One negative rate is enough to travel backwards; how fast is the least magnitude of all.
    """

    rate: float
    who: str

    def __post_init__(self) -> None:
        if math.isnan(self.rate):
            raise ValueError(f"rate {self.rate} found, asked by {self.who}, allowed -1 to 1")

    @classmethod
    def ending_in(cls, left_s: float, tau_left_s: float, who: str) -> Self:
        """The rate that needs `left_s` [s] for `tau_left_s` [s] of the plan: robots asked so end together."""
        return cls(min(1.0, tau_left_s / left_s) if left_s > 0.0 else 1.0, who)


@dataclass(frozen=True, slots=True)
class Hold:
    """An interval of tau [s], from `tau` to `until`, that must not be entered from either side, and who says so."""

    tau: float
    who: str
    until: float = np.inf
    headway_s: float = 0.0
    """The rate is at most such that the hold is so far ahead [s], as in adaptive cruise control: where a hold moves on,
    the robot goes at its pace instead of stopping in front of each place that it has."""

    def __post_init__(self) -> None:
        if not self.tau <= self.until:
            raise ValueError(f"hold from {self.tau} to {self.until} s found, asked by {self.who}, allowed only upwards")


class Governor:
    """Answers, for one motion, with the next segment; pure, the same question has the same answer."""

    def __init__(self, motion: Motion, limits: Limits, cycle_s: float, nominal_s: float) -> None:
        """`cycle_s` is the period of the samples, `nominal_s` the length of a segment before its braking ramp.

        Raises ValueError where a segment would have no sample before its ramp.
        """
        if not 0.0 < cycle_s <= nominal_s < math.inf:
            raise ValueError(f"cycle_s {cycle_s}, nominal_s {nominal_s} found, allowed 0 < cycle_s <= nominal_s")
        self._motion = motion
        self._cycle_s = cycle_s
        nominal = round(nominal_s / cycle_s)
        self._forwards = OneWay(motion, limits, cycle_s, nominal, forwards=True)
        self._backwards = OneWay(motion, limits, cycle_s, nominal, forwards=False)

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
        cap_m_s: float | None = None,
        share: float = 1.0,
    ) -> Segment:
        """The segment that joins `previous` at its sample `index` (0 or more; after its end it stands).

        Towards the lowest of `requests` (1 when there is none) for the nominal part, then the fastest braking ramp
        found within the `ramp` limits. A change of direction goes through rest. It comes to rest at or before the
        nearest of `holds`, and reaches it to 2 ns of tau when it has to wait there. `cap_m_s` bounds the speed of the
        TCP in all of it. A new change of the rate uses at most `share` (0 to 1] of what the joints allow; the rest is
        left to what is added to the path. `stop` brakes at once. When nothing better is admissible the answer is the
        remainder of `previous`, which ends at rest. A hold or a cap that is late is answered by the fastest stop.
        """
        lowest = min(requests, key=lambda each: abs(each.rate), default=RateRequest(1.0, ""))
        backwards = next((each for each in requests if each.rate < 0.0), None)
        tau = previous.state(index).tau
        turning = (previous.stop_tau - tau) * (1.0 if backwards is None else -1.0) < 0.0
        way = self._forwards if (backwards is None) is not turning else self._backwards
        join = SegmentStart(previous, index, way.cap(cap_m_s), share)
        if stop or abs(lowest.rate) < _SLOWEST:
            return way.stop(join, "stop" if stop else lowest.who)
        if turning:
            return way.stop(join, "turning round" if backwards is None else backwards.who)
        if join.cap is not None and not way.keeps_cap(previous, index, join.cap):
            return way.stop(join, join.cap.who)
        bound, bound_by, headway_s = min(self._bounds(way, tau, holds), default=(np.inf, "", 0.0))
        rate = min(abs(lowest.rate), 1.0)
        who = lowest.who if rate < 1.0 else ""
        following = max(_CREEPS, (bound - way.travel.way(tau)) / headway_s) if headway_s > 0.0 else 1.0
        if following < rate:
            rate, who = following, bound_by
        return way.towards(join, Goal(rate, who, bound, bound_by))

    def _bounds(self, way: OneWay, tau: float, holds: Sequence[Hold]) -> list[tuple[float, str, float]]:
        """The near ends of the holds that are not behind: way, who says so, headway."""
        if way is self._forwards:
            return [(hold.tau, hold.who, hold.headway_s) for hold in holds if tau < hold.until]
        return [(way.travel.way(hold.until), hold.who, hold.headway_s) for hold in holds if tau > hold.tau]
