"""Statements to steps: what the robot does next, with jumps and counters resolved. It runs ahead of the motion."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

from robot_agent.language.program import (
    FREELY,
    End,
    Goto,
    Home,
    Label,
    MoveArc,
    MoveJoints,
    MoveLine,
    MoveSpline,
    Pace,
    Program,
    SetOutput,
    Switch,
    Tangent,
    Track,
    Wait,
)

_MAX_IDLE_STATEMENTS = 10_000
_MAX_SWITCHES = 100
"""At one place."""


@dataclass(frozen=True, slots=True)
class JointStep:
    """Move joints; `None` keeps a joint, `joints=None` as a whole means home. The rest as in `MoveJoints`."""

    line: int
    joints: tuple[float | None, ...] | None
    speed: float
    pace: Pace = FREELY
    synchronised: bool = True
    switches: tuple[Switch, ...] = ()


LineStep = MoveLine
ArcStep = MoveArc
SplineStep = MoveSpline
FlangeStep = LineStep | ArcStep | SplineStep
MotionStep = JointStep | FlangeStep
"""Moves of the flange are their own steps; what is left to resolve is whether the tool follows the path."""


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still for a while."""

    line: int
    duration_s: float


@dataclass(frozen=True, slots=True)
class SwitchNow:
    """Switch outputs where the robot rests: no move is before them."""

    line: int
    switches: tuple[Switch, ...]


@dataclass(frozen=True, slots=True)
class TrackingOn:
    """The moves that follow are corrected by what is measured under this name."""

    line: int
    name: str


@dataclass(frozen=True, slots=True)
class TrackingOff:
    """Come to rest wherever the correction has led; the next move begins there."""

    line: int


@dataclass(frozen=True, slots=True)
class Finished:
    """The program is done."""

    line: int


@dataclass(frozen=True, slots=True)
class ProgramFault:
    """The program cannot go on, and why."""

    line: int
    text: str


Step = MotionStep | Pause | SwitchNow | TrackingOn | TrackingOff | Finished | ProgramFault


class Interpreter:
    """Walks through a program, one `Step` at a call; after `Finished` or `ProgramFault` it repeats that step.

    Outputs that are switched behind a move are part of its step, so it looks one step farther.
    """

    def __init__(self, program: Program) -> None:
        self._program = program
        self._index = 0
        self._jumps_left: dict[int, int] = {}
        self._tangential_rad: float | None = None
        self._tracking = False
        self._end: Finished | ProgramFault | None = None
        self._switched = 0
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
        return self._index, frozenset(self._jumps_left.items()), self._tangential_rad, self._tracking, following

    def _walk(self) -> Step | Switch:
        if self._end is not None:
            return self._end
        line = 1
        for _ in range(_MAX_IDLE_STATEMENTS):
            if self._index >= len(self._program.statements):
                return self._finish(Finished(line))
            statement = self._program.statements[self._index]
            line = statement.line
            self._index += 1
            match statement:
                case MoveJoints(line, joints, speed, pace, synchronised):
                    return JointStep(line, joints, speed, pace, synchronised)
                case MoveLine() | MoveArc() | MoveSpline():
                    return self._flange_step(statement)
                case Home(line, speed, pace):
                    return JointStep(line, None, speed, pace)
                case Tangent(line, angle_rad):
                    self._tangential_rad = angle_rad
                case Track() if self._tracking or statement.name is not None:
                    return self._track(statement)
                case SetOutput(line, output, on):
                    self._switched += 1
                    return Switch(line, output, on, self._switched)
                case Wait(line, duration_s):
                    return Pause(line, duration_s)
                case Goto():
                    self._jump(statement)
                case Label() | Track():
                    pass
                case End(line):
                    return self._finish(Finished(line))
        text = f"{_MAX_IDLE_STATEMENTS} statements without a motion or WAIT: put one into the loop"
        return self._finish(ProgramFault(line, text))

    def _flange_step(self, move: FlangeStep) -> FlangeStep | ProgramFault:
        """The move with what `TANG` asks for, which leaves no orientation to choose."""
        named = move.orientation_abc or (move.via_orientation_abc if isinstance(move, MoveArc) else None)
        if self._tangential_rad is not None and named is not None:
            text = "A, B and C are named while TANG is on, where the tool follows the path: leave them out, or TANG 0"
            self._end = ProgramFault(move.line, text)
            return self._end
        return replace(move, tangential_rad=self._tangential_rad)

    def _track(self, track: Track) -> TrackingOn | TrackingOff:
        """One step at a call: a correction that is on is ended before the next one begins."""
        if self._tracking:
            self._tracking = False
            self._index -= track.name is not None
            return TrackingOff(track.line)
        self._tracking = True
        return TrackingOn(track.line, track.name or "")

    def _jump(self, goto: Goto) -> None:
        if goto.count is None:
            self._index = goto.target
            return
        place = self._index - 1
        left = self._jumps_left.get(place, goto.count)
        if left > 0:
            self._jumps_left[place] = left - 1
            self._index = goto.target
        else:
            del self._jumps_left[place]

    def _finish(self, end: Finished | ProgramFault) -> Step:
        self._end = end
        return end
