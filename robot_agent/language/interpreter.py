"""Statements to steps: what the robot does next, with jumps and counters resolved. It runs ahead of the motion."""

from collections.abc import Callable, Hashable
from dataclasses import replace

from robot_agent.language.conditions import Ways
from robot_agent.language.moves import MotionStep
from robot_agent.language.program import Program
from robot_agent.language.statement import Walk
from robot_agent.language.steps import (
    AwaitAnswer,
    AwaitInput,
    Decide,
    Finished,
    Mark,
    Meet,
    Mount,
    Pause,
    ProgramFault,
    Question,
    SwitchNow,
    TrackingOff,
    TrackingOn,
)
from robot_agent.model.description import Mounted

_MAX_IDLE_STATEMENTS = 10_000
_MAX_SWITCHES = 100
"""At one place."""

Fork = Decide | AwaitInput
"""After one the program goes on in one of two places; after `AwaitInput` only where that has a target."""
Still = (
    Pause
    | SwitchNow
    | Mount
    | Meet
    | AwaitInput
    | AwaitAnswer
    | Decide
    | TrackingOn
    | TrackingOff
    | Finished
    | ProgramFault
)
"""What moves nothing: it is done, or waited for, at rest."""
Step = MotionStep | Still


def _nothing(_question: Question) -> None:
    """Nothing is known."""


def forks(step: object) -> bool:
    """Whether a step has to be decided before anybody knows what comes next."""
    return isinstance(step, Decide) or (isinstance(step, AwaitInput) and step.target is not None)


class Interpreter:
    """Walks through a program, one `Step` at a call.

    After `Finished` or `ProgramFault` it repeats that step, and one that forks until that is decided.

    Outputs that are switched after a move are part of its step, so it looks one step farther.
    """

    def __init__(
        self,
        program: Program,
        mounted: Mounted | None = None,
        known: Callable[[Question], bool | None] = _nothing,
        ways: Ways | None = None,
        begins: Walk | None = None,
    ) -> None:
        """`mounted` is what the robot carries, or may carry, before it; None where that does not matter.

        `known` tells what LOOKAHEAD 1 asks for; with `ways` forks go as those say, and none has to be decided. With
        `begins` the walk begins there, and is one's own.
        """
        self._program = program
        self._at = Walk(points=program.points) if begins is None else begins
        self._at.known, self._at.ways = known, ways
        if mounted is not None:
            self._at.tools, self._at.held = mounted.tools, mounted.parts
        self._open: Fork | None = None
        """What has to be decided."""
        self._end: Finished | ProgramFault | None = None
        self._following: Step | Mark | None = None
        """What comes next, when it is known already."""

    def next(self) -> Step:
        """The next thing to do; statements that only steer the program are passed over."""
        first = self._following or self._walk()
        self._following = None
        if not isinstance(first, Mark | MotionStep):
            return first
        switches = [first] if isinstance(first, Mark) else []
        while isinstance(following := self._walk(), Mark) and len(switches) < _MAX_SWITCHES:
            switches.append(following)
        if isinstance(following, Mark):
            words = "SET DO, RESET DO, M ASYNC or LET of the cell"
            text = f"more than {_MAX_SWITCHES} {words} at one place: put a motion or a WAIT into the loop"
            following = self._finish(ProgramFault(following.line, text))
        self._following = following
        if isinstance(first, Mark):
            return SwitchNow(first.line, tuple(switches))
        return replace(first, switches=tuple(switches))

    def decide(self, holds: bool) -> None:
        """Go on after the step that forks: with the next statement, or elsewhere."""
        fork, self._open = self._open, None
        if fork is not None and fork.target is not None and not holds:
            self._at.index = fork.target

    @property
    def variables(self) -> dict[str, float]:
        """As they are where the walk is, ahead of the motion."""
        return dict(self._at.variables)

    @property
    def place(self) -> Hashable:
        """Where the walk is: from equal places it goes on alike."""
        following = None if self._following is None else self._following.line
        at = self._at
        switched = at.tangential_rad, at.tolerance, at.tracking, at.spaces_off, at.tools, at.held, at.frame, at.ahead
        speeds = at.joint_speed, at.path_speed_m_s, at.speed_share
        calls = tuple((call.back, call.left, frozenset(call.jumps_left.items())) for call in at.calls)
        return (
            at.index,
            frozenset(at.jumps_left.items()),
            calls,
            frozenset(at.variables.items()),
            switched,
            speeds,
            following,
        )

    def _walk(self) -> Step | Mark:
        if (repeated := self._end or self._open) is not None:
            return repeated
        line, statements = 1, self._program.statements
        for _ in range(_MAX_IDLE_STATEMENTS):
            if self._at.index >= len(statements):
                return self._finish(Finished(line))
            statement = statements[self._at.index]
            line = statement.line
            self._at.index += 1
            step = statement.run(self._at)
            if isinstance(step, Finished | ProgramFault):
                return self._finish(step)
            if isinstance(step, MotionStep):
                return replace(step, spaces_off=self._at.spaces_off, mounted=self._at.mounted)
            if isinstance(step, Fork) and forks(step) and self._at.ways is None:
                self._open = step
            if step is not None:
                return step
        text = f"{_MAX_IDLE_STATEMENTS} statements without a motion or WAIT: put one into the loop"
        return self._finish(ProgramFault(line, text))

    def _finish(self, end: Finished | ProgramFault) -> Step:
        self._end = end
        return end
