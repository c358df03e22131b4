"""The steps that come next: interpreted and planned ahead of the motion.

Moves between which the robot may not have to stop form a chain. The first of a long chain are planned as one motion,
and while the robot moves along it that motion is extended by the next ones, after all that is sent already. It ends
at rest: when an extension comes too late, the robot rests there and goes on as from any other end.
"""

import math
from collections import deque
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from itertools import pairwise, takewhile

import numpy as np
from numpy.typing import NDArray

from cell.core import Effect
from cell.messages import ZoneGeometry
from robot_agent.agent.parameters import AS_FILED, Tuning
from robot_agent.agent.planning.joining import StraightOn, why_apart
from robot_agent.agent.planning.plans import ExtendRequest, Plan, PlanFailed, Planned, PlanRequest, Unplan
from robot_agent.agent.planning.reading import ReadAhead, tolerance_of
from robot_agent.language import (
    Finished,
    Interpreter,
    MotionStep,
    Program,
    ProgramFault,
    Question,
    SplineStep,
    Still,
    TrackingOff,
    Walk,
    Ways,
    forks,
)
from robot_agent.model.description import Mounted
from robot_agent.trajectory import Motion

_PLANNED_AHEAD = 3
_PLANNED_FURTHER = 12
_CHAIN = 24
"""Steps that are planned at once, or more where these last less than `_AHEAD_S`."""
_LONGEST_CHAIN = 200
_AHEAD_S = 5.0
_LEAD_S = 0.5
"""An extension begins so far ahead of all that is sent, besides what planning takes, or half of what is left."""
_LASTING = 1.5
"""Planning may take so many times as long as the longest of the last `_MEASURED` plans."""
_MEASURED = 4
_BEGIN_S = 2.0
"""So much of many short lines within a tolerance is planned before the robot begins."""
_READ_AT_ONCE = 250
"""Statements, while others wait: some 5 ms."""
_BEYOND = 60
"""Moves within a tolerance towards which a motion is led that ends before them."""
_TAIL_S = 2.0
"""An extension begins no earlier than so long before the end, and two moves: what lies before it stays as it is."""
_LEAST_LEFT_S = 0.3
"""After the beginning of an extension: later the motion brakes already."""
_SHORTEST_S = 1.0
"""A motion shorter than this is over before it can be extended."""
_TIME_TO_PLAN_S = 1.0
"""So long before the end of a motion that cannot be extended the next one is planned."""
_KEPT_S = 10.0
"""Of the motion behind the robot, for going back."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A motion that the worker is still planning."""

    id: int
    line: int


Item = Planned | PlanFailed | Waiting | Still


class Lookahead:
    """A queue of what the program does next. A motion is planned from where the one before it ends."""

    def __init__(self, read_at_once: int = _READ_AT_ONCE) -> None:
        """`read_at_once` is how many steps are read in one call at most."""
        self._read_at_once = read_at_once
        self._ahead: ReadAhead | None = None
        self._items: deque[Item] = deque()
        self._chain_of = _CHAIN
        """How many steps the next plan from rest may have."""
        self._plans = 0
        self._end = np.zeros(0)
        self._aimed: NDArray[np.float64] | None = None
        """The pose to which the newest motion leads, where it may end beside it."""
        self._last: MotionStep | None = None
        """Of the newest motion."""
        self.open: Planned | None = None
        """The newest motion, while it waits to be extended; nothing is planned after it."""
        self._asked: PlanRequest | None = None
        """The newest plan from rest that was asked for."""
        self._extension: ExtendRequest | None = None
        self._unplanned: set[int] = set()
        """Ids of the plans that were asked for and are not there yet."""
        self._asked_at = 0.0
        self.looks_further = False
        """More is planned than is needed to go on: others have to know where the robot will be."""
        self._took_s: deque[float] = deque(maxlen=_MEASURED)
        """From asking for a plan to having it."""
        self.known: Callable[[Question], bool | None] = lambda _: None
        """Whether an input or output is on now, or a comparison holds; None where nobody knows."""
        self.tuning: Callable[[], Tuning] = lambda: AS_FILED
        """What an operator has set; a motion that is extended keeps that with which it was planned."""

    def start(
        self,
        program: Program,
        q: NDArray[np.float64],
        mounted: Mounted,
        ways: Ways | None = None,
        begins: Walk | None = None,
    ) -> None:
        """Begin the program with the robot at rest at `q` `(n,)`; `mounted` is what it carries, or may carry.

        With `ways` its forks go as those say, and nothing is asked. With `begins` it does not begin at its first line.
        """
        self.stop()
        self._ahead = ReadAhead(Interpreter(program, mounted, self.known, ways, begins), self._read_at_once)
        self._end = q

    def stop(self) -> None:
        self._ahead = self._aimed = None
        self._items.clear()
        self._chain_of = _CHAIN
        self._asked = self.open = self._extension = self._last = None

    @property
    def head(self) -> Item | None:
        return self._items[0] if self._items else None

    @property
    def items(self) -> tuple[Item, ...]:
        return tuple(self._items)

    @property
    def planned_to(self) -> int:
        """The program line of the newest move that is planned or being planned; 0 for none."""
        newest = self._last if self._extension is None else self._extension.steps[-1]
        return 0 if newest is None else newest.line

    @property
    def place(self) -> Hashable:
        """All that is to come, by where the program is: from equal places, and the same joints, it goes on alike."""
        ahead = None if self._ahead is None else (self._ahead.interpreter.place, self._ahead.lines)
        return ahead, tuple(item.lines if isinstance(item, Planned) else item.line for item in self._items)

    def motions(self, running: Planned) -> tuple[Planned, ...]:
        """All that is planned: the motion that runs, and those that come."""
        coming = (item for item in self._items if isinstance(item, Planned) and item.motion is not running.motion)
        return (running, *coming)

    @property
    def goes_on(self) -> bool:
        """Whether the program goes on after all that is planned."""
        return not any(isinstance(item, Finished | ProgramFault | PlanFailed) for item in self._items)

    @property
    def plans_more(self) -> bool:
        """Whether a motion is being planned that begins after all that is planned."""
        return any(isinstance(item, Waiting) for item in self._items)

    def advance(self) -> None:
        """The head is being executed; what follows becomes the head."""
        self._items.popleft()

    def advance_from(self, q: NDArray[np.float64]) -> None:
        """The head is done with the robot at rest at `q` `(n,)`, where nobody knew that it would be."""
        self._end, self._aimed = q, None
        self.advance()

    def decide(self, holds: bool) -> None:
        """The head is a step that forks, and is done: the program goes on with the next statement, or elsewhere."""
        if self._ahead is not None:
            self._ahead.interpreter.decide(holds)
        self.advance()

    @property
    def variables(self) -> dict[str, float]:
        """Of the program, as far as it is interpreted."""
        return {} if self._ahead is None else self._ahead.interpreter.variables

    def planned(self, result: Planned | PlanFailed, now: float = 0.0) -> None:
        """Take the worker's result; a result for a program that was stopped meanwhile is dropped."""
        self._unplanned.discard(result.id)
        for index, item in enumerate(self._items):
            if isinstance(item, Waiting) and item.id == result.id:
                self._took_s.append(now - self._asked_at)
                if self._too_short(result) if isinstance(result, Planned) else self._ends_before(result):
                    del self._items[index]
                    return
                self._chain_of = _CHAIN
                self._items[index] = result
                if isinstance(result, Planned):
                    self._after(result, extensible=result.motion.duration_s >= _SHORTEST_S)

    def extends(self, result: Planned | PlanFailed) -> Planned | None:
        """The motion that a result of the worker extends."""
        return self.open if self._extension is not None and result.id == self._extension.id else None

    def extended(self, result: Planned | PlanFailed, taken: bool, now: float = 0.0) -> None:
        """What became of an extension: the robot is on it, or its steps are to be planned again."""
        self._unplanned.discard(result.id)
        self._took_s.append(now - self._asked_at)
        if taken and self._extension is not None and isinstance(result, Planned):
            self._last, self._extension = self._extension.steps[-1], None
            self._after(result, extensible=True)
        elif isinstance(result, PlanFailed):
            self.close()
        else:
            self._give_back()

    def fill(self, zones: tuple[ZoneGeometry, ...] | None, now: float = 0.0) -> list[Effect]:
        """Interpret further, and hand the next motion to the worker; without zone geometry nothing is planned."""
        if self._ahead is None or zones is None or self.open is not None:
            return []
        most = _PLANNED_FURTHER if self.looks_further else _PLANNED_AHEAD
        while len(self._items) < most and not self._blocked():
            if not self._ahead.reaches(_BEGIN_S):
                return []
            step, _ = self._ahead.next()
            if isinstance(step, MotionStep):
                steps = self._chain(self._ahead, step, self._chain_of, _BEGIN_S, self._end)
                self._plans += 1
                self._unplanned.add(self._plans)
                self._last = steps[-1]
                self._items.append(Waiting(self._plans, step.line))
                beyond = self._beyond(self._ahead, steps[-1])
                self._asked = PlanRequest(
                    self._plans, steps, self._end, zones, tuning=self.tuning(), beyond=beyond, aimed=self._aimed
                )
                self._asked_at = now
                return [Plan(self._asked)]
            self._items.append(step)
            self._aimed = None  # it is done at rest, where the motion before it ends exactly
        return []

    def extend(
        self, reach: tuple[float, float], played_tau: float, zones: tuple[ZoneGeometry, ...], now: float = 0.0
    ) -> list[Effect]:
        """Ask for more of the open motion when little of it is left.

        All blocks that count lie within the taus `reach` [s]; `played_tau` is where the robot is.
        """
        running = self.open
        if running is None or self._ahead is None or self._last is None:
            return []
        motion, (lowest_tau, sent_tau) = running.motion, reach
        if self._extension is not None:
            if sent_tau <= self._extension.splice_s:
                return []
            self._took_s.append(now - self._asked_at)  # or longer: it would come too late
            self._give_back()
        at_s = self._splice(motion, sent_tau)
        tuning = AS_FILED if self._asked is None else self._asked.tuning
        too_late = motion.duration_s - at_s < _LEAST_LEFT_S or tuning != self.tuning()
        if too_late or running.zone_versions != {zone.zone: zone.version for zone in zones}:
            if motion.duration_s - played_tau < max(_TIME_TO_PLAN_S, self._planning_s):
                self.close()
            return []
        most = _moves_ahead(motion)
        left = len(motion.ends) - int(np.searchsorted(motion.ends, sent_tau + self._planning_s, side="right"))
        left_s = motion.duration_s - sent_tau - self._planning_s
        many = tolerance_of(self._last) is not None
        read = self._ahead.reaches(_AHEAD_S) or left_s < _TAIL_S / 2.0
        if (left_s > _AHEAD_S / 2.0 or not read) if many else left > most // 2:
            return []
        steps = self._chain(self._ahead, self._last, 1 + most - left, _AHEAD_S - left_s)[1:]
        self._plans += 1
        self._unplanned.add(self._plans)
        cut_s = max(lowest_tau - _KEPT_S, 0.0)
        self._extension = ExtendRequest(
            self._plans, steps, motion, running.lines, running.switches, at_s, cut_s, running.first_tau, zones,
            sections=running.sections, tuning=tuning, beyond=self._beyond(self._ahead, steps[-1]), aimed=running.aimed,
        )  # fmt: skip
        self._asked_at = now
        return [Plan(self._extension)]

    @property
    def _planning_s(self) -> float:
        """How long the next plan may take, from asking for it to having it."""
        return _LEAD_S + _LASTING * max(self._took_s, default=0.0)

    def _splice(self, motion: Motion, sent_tau: float) -> float:
        """Where an extension begins [s]: once it is planned, and so late that little is timed anew."""
        planned = sent_tau + min(self._planning_s, (motion.duration_s - sent_tau) / 2.0)
        return max(planned, min(motion.duration_s - _TAIL_S, float(motion.ends[-3:][0])))

    def drop(self) -> list[Effect]:
        """Have nothing planned any more that is not wanted: of a program that was stopped, or a late extension."""
        wanted = {item.id for item in self._items if isinstance(item, Waiting)}
        if self._extension is not None:
            wanted.add(self._extension.id)
        unwanted = sorted(self._unplanned - wanted)
        self._unplanned &= wanted
        return [Unplan(tuple(unwanted))] if unwanted else []

    def close(self) -> None:
        """Extend the motion no more: what follows begins where it rests."""
        self._give_back()
        self.open = None

    def _too_short(self, planned: Planned) -> bool:
        """Whether a motion shall be planned again with more of the steps that join it; they are given back."""
        most = _moves_ahead(planned.motion)
        if self._asked is None or most <= len(self._asked.steps) or not self._chain_goes_on() or self._ahead is None:
            return False
        self._ahead.give_back(self._asked.steps)
        self._chain_of = most
        return True

    def _ends_before(self, failed: PlanFailed) -> bool:
        """Whether some of the steps can be planned without the one that cannot; the program ends after these.

        Not the points of a spline in front of it: without that move they would be another curve.
        """
        if self._asked is None or self._ahead is None:
            return False
        steps = self._asked.steps[: failed.step]
        while steps and isinstance(steps[-1], SplineStep):
            steps = steps[:-1]
        if not steps:
            return False
        self._ahead.end(steps, failed)
        return True

    def _give_back(self) -> None:
        """The steps of an extension that is not wanted any more are still to be planned."""
        if self._extension is not None and self._ahead is not None:
            self._ahead.give_back(self._extension.steps)
            self._extension = None

    def _after(self, newest: Planned, extensible: bool) -> None:
        """Go on after a motion; if it is extensible and the chain is longer, by extending it."""
        self._end, self._aimed = newest.motion.q(np.array(newest.motion.duration_s)), newest.aimed
        self.open = newest if extensible and self._chain_goes_on() else None

    def _chain_goes_on(self) -> bool:
        if self._ahead is None or self._last is None:
            return False
        step = self._ahead.peek()
        return isinstance(step, MotionStep) and not why_apart(self._last, step)

    def _chain(
        self, ahead: ReadAhead, first: MotionStep, most: int, lasting_s: float, start: NDArray[np.float64] | None = None
    ) -> tuple[MotionStep, ...]:
        """The steps from `first` on between which the robot may not have to stop; they are planned together.

        They are so many, and within a tolerance as many as last so long at their feed. `start` `(n,)` are the joints
        before the first one, None where they are not known.
        """
        steps, straight, lasts_s = [first], StraightOn(start), 0.0
        straight.take(first)
        while len(steps) < most or (lasts_s < lasting_s and tolerance_of(steps[-1]) is not None):
            step = ahead.peek()
            if not isinstance(step, MotionStep) or not (not why_apart(steps[-1], step) or straight.goes_on(step)):
                break
            steps.append(step)
            straight.take(step)
            lasts_s += ahead.next()[1]
        return tuple(steps)

    def _beyond(self, ahead: ReadAhead, last: MotionStep) -> tuple[MotionStep, ...]:
        """The moves towards which a motion is led that ends with `last`: after a spline it is one."""
        if isinstance(last, SplineStep):
            step = ahead.peek()
            return (step,) if isinstance(step, MotionStep) and not why_apart(last, step) else ()
        if tolerance_of(last) is None or last.pace.round_m is not None:
            return ()
        moves = [last, *ahead.moves_beyond(_BEYOND)]
        joined = takewhile(lambda pair: not why_apart(*pair), pairwise(moves))
        return tuple(move for _, move in joined)

    def _blocked(self) -> bool:
        """After a motion without a plan, where a correction ends, at a fork, or after the end, nothing is planned."""
        ends = Waiting | PlanFailed | TrackingOff | Finished | ProgramFault
        return any(isinstance(item, ends) or forks(item) for item in self._items)


def _moves_ahead(motion: Motion) -> int:
    """As many moves of a motion's mean duration as last `_AHEAD_S`, within what is planned at once."""
    moves = math.ceil(_AHEAD_S * len(motion.ends) / max(motion.duration_s, 1e-3))
    return min(max(moves, _CHAIN), _LONGEST_CHAIN)
