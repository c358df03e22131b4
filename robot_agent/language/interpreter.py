"""Statements to steps: what the robot does next, with jumps and counters resolved. It runs ahead of the motion."""

from collections.abc import Hashable
from dataclasses import replace

from robot_agent.language.moves import MotionStep
from robot_agent.language.program import Program
from robot_agent.language.statement import Walk
from robot_agent.language.steps import (
    Finished,
    Meet,
    Mount,
    Pause,
    ProgramFault,
    Switch,
    SwitchNow,
    TrackingOff,
    TrackingOn,
)
from robot_agent.model.description import Mounted

_MAX_IDLE_STATEMENTS = 10_000
_MAX_SWITCHES = 100
"""At one place."""

Step = MotionStep | Pause | SwitchNow | Mount | Meet | TrackingOn | TrackingOff | Finished | ProgramFault


class Interpreter:
    """Walks through a program, one `Step` at a call; after `Finished` or `ProgramFault` it repeats that step.

    Outputs that are switched after a move are part of its step, so it looks one step farther.
    """

    def __init__(self, program: Program, mounted: Mounted | None = None) -> None:
        """`mounted` is what the robot carries, or may carry, before it; None where that does not matter."""
        self._program = program
        self._at = Walk(points=program.points)
        if mounted is not None:
            self._at.tools, self._at.held = mounted.tools, mounted.parts
        self._end: Finished | ProgramFault | None = None
        self._following: Step | Switch | None = None
        """What comes next, when it is known already."""

    def next(self) -> Step:
        """The next thing to do; statements that only steer the program are passed over."""
        first = self._following or self._walk()
        self._following = None
        if not isinstance(first, Switch | MotionStep):
            return first
        switches = [first] if isinstance(first, Switch) else []
        while isinstance(following := self._walk(), Switch) and len(switches) < _MAX_SWITCHES:
            switches.append(following)
        if isinstance(following, Switch):
            text = f"more than {_MAX_SWITCHES} SET DO or RESET DO at one place: put a motion or a WAIT into the loop"
            following = self._finish(ProgramFault(following.line, text))
        self._following = following
        if isinstance(first, Switch):
            return SwitchNow(first.line, tuple(switches))
        return replace(first, switches=tuple(switches))

    @property
    def place(self) -> Hashable:
        """Where the walk is: from equal places it goes on alike."""
        following = None if self._following is None else self._following.line
        at = self._at
        switched = at.tangential_rad, at.tracking, at.spaces_off, at.tools, at.held, at.frame
        speeds = at.joint_speed, at.path_speed_m_s, at.speed_share
        calls = tuple((call.back, call.left, frozenset(call.jumps_left.items())) for call in at.calls)
        return at.index, frozenset(at.jumps_left.items()), calls, switched, speeds, following

    def _walk(self) -> Step | Switch:
        if self._end is not None:
            return self._end
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
            if step is not None:
                return step
        text = f"{_MAX_IDLE_STATEMENTS} statements without a motion or WAIT: put one into the loop"
        return self._finish(ProgramFault(line, text))

    def _finish(self, end: Finished | ProgramFault) -> Step:
        self._end = end
        return end
