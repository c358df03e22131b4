"""All that moves a robot: a path under the governor, the same with a live correction, an operator's jog."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from robot_agent.agent.blocks.motion_source import Followed, Join, SentBlock
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.trajectory import Governor, Hold, Motion, RateRequest, Segment
from robot_agent.trajectory.sources import CorrectedSource, JogSource, States, Target, sampled, states_from

_SETTLED = 2
"""Samples at rest between a ramp and the way on: without them the jerk of both adds up in the sample between them."""
_GOVERNORS = 3
"""So many are kept: of the present motion, and of its neighbours."""


class Supply:
    """What the sources of one enabled robot share: how its blocks are made."""

    def __init__(self, planner: Planner, nominal_s: float) -> None:
        """`nominal_s` is the length of a block before its ramp."""
        self.planner = planner
        self.cycle_s = planner.cycle_s
        self.nominal_s = nominal_s
        self.nominal = round(nominal_s / self.cycle_s)
        """So many samples of a block are what is meant to come; the others are there in case no block follows."""
        self.governor: Callable[[Motion], Governor] = lru_cache(_GOVERNORS)(
            lambda motion: Governor(motion, planner.limits, planner.cycle_s, nominal_s)
        )

    def sampled(
        self, source: JogSource | CorrectedSource, count: int, before: NDArray[np.float64]
    ) -> tuple[Planned, Segment]:
        """The next `count` samples of a source and their ramp; `before` `(2, n)` are commanded in the ticks before."""
        present, nominal = States.one(source.state), source.samples(count)
        states = present.then(nominal).then(source.brake())
        motion, segment = sampled(self.planner.model, states, nominal.count, before, self.cycle_s, source.ruled_by)
        return self.planner.sampled(motion), segment


@dataclass(frozen=True, eq=False)
class _Course:
    """Along a planned motion, from sample `index` of a segment on, which is played at `tick`."""

    supply: Supply
    join: Join
    planned: Planned
    segment: Segment
    index: int
    tick: int

    @property
    def governor(self) -> Governor:
        return self.supply.governor(self.planned.motion)

    @property
    def holds(self) -> list[Hold]:
        return self.join.wishes.holds(self.planned, self.segment, self.index)

    @property
    def requests(self) -> tuple[RateRequest, ...]:
        """What is asked for, and the rate that lets the motion end in time."""
        wishes, tau, ends = self.join.wishes, self.segment.state(self.index).tau, self.planned.motion.duration_s
        left_s = 0.0 if wishes.end_tick is None else (wishes.end_tick - self.tick) * self.supply.cycle_s
        if left_s <= 0.0 or tau >= ends:
            return wishes.requests
        return (*wishes.requests, RateRequest.ending_in(left_s, ends - tau, "ending together"))

    @cached_property
    def onwards(self) -> Segment:
        """The next segment as wished; where a motion begins it is asked for twice: whether it leaves, and how."""
        return self.next(stop=False)

    def next(self, stop: bool) -> Segment:
        """The next segment under the governor; `stop` brakes at once."""
        cap_m_s = self.join.wishes.cap_m_s
        return self.governor.next(self.segment, self.index, self.requests, self.holds, stop, cap_m_s)


class GovernedPath:
    """A planned motion under the governor: of the program, back to its path, or standing still."""

    _course: _Course

    def __init__(self, supply: Supply, planned: Planned, backwards: bool = False) -> None:
        """`backwards`: it ends where what moves the robot now began, and is gone from its end."""
        self._supply = supply
        self._planned = planned
        self._from_tau = planned.motion.duration_s if backwards else 0.0
        self._backwards = backwards

    def begin(self, join: Join) -> bool:
        """Once the motion is due and may leave its first place."""
        start = self._start(join)
        if start is not None:
            self._course = self._beginning(join, start)
        return start is not None and self._course.onwards.stop_tau != self._from_tau

    def resume(self, join: Join) -> None:
        """Go on along the motion that `join.base` is on, which may have been extended; from rest a little later."""
        base, tick = join.base, join.tick
        previous, index = base.segment, base.index(tick)
        if tick >= base.rest_tick:
            tick = max(tick, join.path_rest_tick + _SETTLED)
            previous, index = self._supply.governor(base.path.motion).rest(base.segment.stop_tau), 0
        self._course = _Course(self._supply, join, base.path, previous, index, tick)

    def samples(self) -> SentBlock:
        return self._block(self._course.onwards)

    def brake(self) -> SentBlock:
        return self._block(self._course.next(stop=True))

    def _start(self, join: Join) -> int | None:
        """The tick at which the motion begins, which comes after what is played; None as long as it is not due."""
        base, wishes, nominal = join.base, join.wishes, self._supply.nominal_s / self._supply.cycle_s
        arrived = base.at_motion_begin if self._backwards else base.at_motion_end
        if self._planned.motion is base.path.motion or wishes.stop or not arrived:
            return None
        settled = base.path_rest_tick + (_SETTLED if self._backwards else 0)
        start = max(join.tick, settled, wishes.not_before_tick)
        early, late = start > join.tick + nominal, wishes.on_time and start > wishes.not_before_tick
        return None if early or late else start

    def _beginning(self, join: Join, start: int) -> _Course:
        standing = self._supply.governor(self._planned.motion).rest(self._from_tau)
        return _Course(self._supply, join, self._planned, standing, 0, start)

    def _block(self, segment: Segment) -> SentBlock:
        course = self._course
        return SentBlock(course.join.sequence, course.tick, self, course.planned, segment)


class CorrectedPath(GovernedPath):
    """A planned motion under the governor with a live correction on top."""

    _source: CorrectedSource

    def begin(self, join: Join) -> bool:
        """Once the motion is due; a tool that follows something already joins at once or waits where it is."""
        start, correcting, followed = self._start(join), join.wishes.correction, join.base.followed
        if start is None or correcting is None or (followed is not None and start > join.tick):
            return False
        course = self._course = self._beginning(join, start)
        if any(hold.tau <= 0.0 for hold in course.holds) or any(each.rate <= 0.0 for each in join.wishes.requests):
            return False
        if followed is None:
            planner, how = self._supply.planner, (correcting.limits, correcting.frame, correcting.clear)
            self._source = CorrectedSource(planner.model, planner.limits, course.governor, course.segment, *how)
        else:
            self._source = followed.source
            self._source.resume(start - join.base.first_tick, followed.given)
            self._source.follow(course.governor)
        return True

    def resume(self, join: Join) -> None:
        """Go on along the motion that `join.base` follows, which may have been extended."""
        base, ticks = join.base, join.tick - join.base.first_tick
        self._course = _Course(self._supply, join, base.path, base.path_segment, ticks, join.tick)
        if base.followed is not None:
            self._source.resume(ticks, base.followed.given, self._course.governor)

    def samples(self) -> SentBlock:
        """As wished; where nothing is to be followed any more, path and correction come to rest."""
        return self._corrected(stop=self._course.join.wishes.correction is None)

    def brake(self) -> SentBlock:
        return self._corrected(stop=True)

    def _corrected(self, stop: bool) -> SentBlock:
        course, source, supply = self._course, self._source, self._supply
        join, correcting = course.join, course.join.wishes.correction
        ahead_s = join.ahead_s + (course.tick - join.tick) * supply.cycle_s
        source.requests = (*course.requests, RateRequest(0.0, "stop")) if stop else course.requests
        source.holds = course.holds
        source.target = Target.none() if correcting is None else correcting.target.after(ahead_s)
        source.cap(join.wishes.cap_m_s)
        before = join.base.segment.history(join.base.index(course.tick))
        planned, segment = supply.sampled(source, supply.nominal, before)
        followed = Followed(course.planned, source.given, source)
        return SentBlock(join.sequence, course.tick, self, planned, segment, followed)


class Jogged:
    """What an operator's jog key asks for, from wherever the robot is."""

    _join: Join

    def __init__(self, supply: Supply, source: JogSource) -> None:
        self._supply = supply
        self._source = source

    def begin(self, join: Join) -> bool:
        self.resume(join)
        return True

    def resume(self, join: Join) -> None:
        base, index = join.base, join.base.index(join.tick)
        self._join = join
        self._source.resume(states_from(base.planned.motion, base.segment, index), base.segment.history(index))

    def samples(self) -> SentBlock:
        return self._block(self._supply.nominal)

    def brake(self) -> SentBlock:
        return self._block(0)

    def _block(self, count: int) -> SentBlock:
        join = self._join
        before = join.base.segment.history(join.base.index(join.tick))
        planned, segment = self._supply.sampled(self._source, count, before)
        return SentBlock(join.sequence, join.tick, self, planned, segment)
