"""Steps of a program that are interpreted, but not planned: read ahead by how long they last."""

import math
from collections import deque
from collections.abc import Iterable

from robot_agent.agent.planning.plans import PlanFailed
from robot_agent.language import ArcStep, Interpreter, LineStep, MotionStep, Step
from robot_agent.paths.caps import Tolerance

_MOST_STEPS = 50_000
"""That are read ahead."""


def tolerance_of(step: Step | PlanFailed | None) -> Tolerance | None:
    """Of a line or an arc that may become a part of a smooth curve."""
    return step.pace.tolerance if isinstance(step, LineStep | ArcStep) and step.tangential_rad is None else None


class ReadAhead:
    """What a program does next, in order; or why it ends there."""

    def __init__(self, interpreter: Interpreter, at_once: int) -> None:
        """`at_once` is how many steps may be read in one go: whoever reads has other things to do too."""
        self.interpreter = interpreter
        self._at_once = at_once
        self._steps: deque[tuple[Step | PlanFailed, float]] = deque()
        self._newest: Step | PlanFailed | None = None
        self.lasting_s = 0.0
        """At least so long the steps last that are read, at their feed."""

    @property
    def lines(self) -> tuple[int, ...]:
        """Program lines of what is read."""
        return tuple(step.line for step, _ in self._steps)

    def next(self) -> tuple[Step | PlanFailed, float]:
        """The next step, and how long it lasts at least [s]."""
        if not self._steps:
            self._read()
        step, seconds = self._steps.popleft()
        self.lasting_s = self.lasting_s - seconds if self._steps else 0.0
        return step, seconds

    def peek(self) -> Step | PlanFailed:
        """The next step, which stays the next one."""
        if not self._steps:
            self._read()
        return self._steps[0][0]

    def give_back(self, steps: Iterable[Step]) -> None:
        """These steps are the next ones again."""
        made, before = list[tuple[Step, float]](), None
        for step in steps:
            made.append((step, _least_s(step, before)))
            before = step
        self._steps.extendleft(reversed(made))
        self.lasting_s += sum(seconds for _, seconds in made)

    def end(self, steps: Iterable[Step], failed: PlanFailed) -> None:
        """These steps are the next ones, and the program ends after them."""
        self._steps.clear()
        self.lasting_s = 0.0
        self.give_back(steps)
        self._steps.append((failed, 0.0))
        self._newest = failed

    def reaches(self, seconds: float) -> bool:
        """Read on, if lines within a tolerance come; whether what is read lasts so long, or is all that may be read."""
        if not self._steps:
            self._read()
        for _ in range(self._at_once):
            if self.lasting_s >= seconds or not self._goes_on():
                return True
            self._read()
        return self.lasting_s >= seconds or not self._goes_on()

    def moves_beyond(self, most: int) -> list[MotionStep]:
        """The next moves within a tolerance, which stay the next ones."""
        while len(self._steps) < most and (not self._steps or self._goes_on()):
            self._read()
        found = list[MotionStep]()
        for (step, _), _ in zip(self._steps, range(most), strict=False):
            if not isinstance(step, MotionStep) or tolerance_of(step) is None:
                break
            found.append(step)
        return found

    def _goes_on(self) -> bool:
        return tolerance_of(self._newest) is not None and len(self._steps) < _MOST_STEPS

    def _read(self) -> None:
        step = self.interpreter.next()
        seconds = _least_s(step, self._newest)
        self._newest = step
        self._steps.append((step, seconds))
        self.lasting_s += seconds


def _least_s(step: Step, before: Step | PlanFailed | None) -> float:
    """How long a line or an arc lasts at its feed, by the coordinates that it and the step before name."""
    if not isinstance(step, LineStep | ArcStep) or not isinstance(before, LineStep | ArcStep):
        return 0.0
    pairs = zip(step.position_m, before.position_m, strict=True)
    way = math.hypot(*(one - other for one, other in pairs if one is not None and other is not None))
    return way / (step.pace.speed_m_s or math.inf)
