"""The steps that come next: interpreted and planned ahead of the motion."""

from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.core import Effect
from cell.messages import ZoneGeometry
from robot_agent.agent.planning import Plan, PlanFailed, Planned, PlanRequest
from robot_agent.language import (
    Finished,
    Interpreter,
    JointStep,
    MotionStep,
    Pause,
    Program,
    ProgramFault,
    SplineStep,
    Step,
    TrackingOff,
    TrackingOn,
)

_PLANNED_AHEAD = 3
_LONGEST_CHAIN = 24
"""Steps that are planned as one motion; a longer chain rests between its parts."""


@dataclass(frozen=True, slots=True)
class Waiting:
    """A motion that the worker is still planning."""

    id: int
    line: int


Item = Planned | PlanFailed | Waiting | Pause | TrackingOn | TrackingOff | Finished | ProgramFault


class Lookahead:
    """A queue of what the program does next. A motion is planned from where the one before it ends."""

    def __init__(self) -> None:
        self._interpreter: Interpreter | None = None
        self._items: deque[Item] = deque()
        self._next: Step | None = None
        self._plans = 0
        self._end = np.zeros(0)

    def start(self, program: Program, q: NDArray[np.float64]) -> None:
        """Begin the program with the robot at rest at `q` `(n,)`."""
        self._interpreter = Interpreter(program)
        self._next = None
        self._items.clear()
        self._end = q

    def stop(self) -> None:
        self._interpreter = None
        self._items.clear()

    @property
    def head(self) -> Item | None:
        return self._items[0] if self._items else None

    @property
    def items(self) -> tuple[Item, ...]:
        return tuple(self._items)

    def advance(self) -> None:
        """The head is being executed; what follows becomes the head."""
        self._items.popleft()

    def advance_from(self, q: NDArray[np.float64]) -> None:
        """The head is done with the robot at rest at `q` `(n,)`, where nobody knew that it would be."""
        self._end = q
        self.advance()

    def planned(self, result: Planned | PlanFailed) -> None:
        """Take the worker's result; a result for a program that was stopped meanwhile is dropped."""
        for index, item in enumerate(self._items):
            if isinstance(item, Waiting) and item.id == result.id:
                self._items[index] = result
                if isinstance(result, Planned):
                    self._end = result.motion.q(np.array(result.motion.duration_s))

    def rezone(self, again: list[Planned]) -> None:
        """Replace motions by the same motions against changed zones."""
        by_id = {planned.id: planned for planned in again}
        self._items = deque(by_id.get(item.id, item) if isinstance(item, Planned) else item for item in self._items)

    def fill(self, zones: tuple[ZoneGeometry, ...] | None) -> list[Effect]:
        """Interpret further, and hand the next motion to the worker; without zone geometry nothing is planned."""
        if self._interpreter is None or zones is None:
            return []
        while len(self._items) < _PLANNED_AHEAD and not self._blocked():
            step = self._take(self._interpreter)
            if isinstance(step, MotionStep):
                steps = self._chain(self._interpreter, step)
                self._plans += 1
                self._items.append(Waiting(self._plans, step.line))
                return [Plan(PlanRequest(self._plans, steps, self._end, zones))]
            self._items.append(step)
        return []

    def _take(self, interpreter: Interpreter) -> Step:
        step = self._next or interpreter.next()
        self._next = None
        return step

    def _chain(self, interpreter: Interpreter, first: MotionStep) -> tuple[MotionStep, ...]:
        """The steps from `first` on between which the robot may not have to stop; they are planned together."""
        steps = [first]
        while len(steps) < _LONGEST_CHAIN:
            step = self._take(interpreter)
            if not isinstance(step, MotionStep) or not _may_go_on(steps[-1], step):
                self._next = step
                break
            steps.append(step)
        return tuple(steps)

    def _blocked(self) -> bool:
        """Behind a motion without a plan, where a correction ends, or behind the end, nothing can be planned."""
        ends = Waiting | PlanFailed | TrackingOff | Finished | ProgramFault
        return any(isinstance(item, ends) for item in self._items)


def _may_go_on(step: MotionStep, following: MotionStep) -> bool:
    """Whether two moves may join without a stop: by a round edge, or because they are tangential.

    A joint move behind a move of the flange needs all its joints named: where the flange move leaves the others is not
    known before it is planned. A spline takes its direction from a joint move next to it. Where TANG changes, the tool
    may have to turn before the robot goes on.
    """
    if isinstance(following, JointStep):
        incomplete = following.joints is not None and None in following.joints
        if isinstance(step, JointStep):
            return bool(step.pace.round_m)
        return not incomplete and (bool(step.pace.round_m) or _takes_directions(step, step))
    if isinstance(step, JointStep):
        return bool(step.pace.round_m) or _takes_directions(following, step)
    return step.pace.round_m != 0.0 and step.tangential_rad == following.tangential_rad


def _takes_directions(move: MotionStep, first: MotionStep) -> bool:
    """Whether a move takes over the direction of a joint move next to it, and the first of both asks for no stop."""
    return isinstance(move, SplineStep) and move.tangential_rad is None and first.pace.round_m is None
