"""What a robot does next: the steps that a program comes down to, besides moves of the TCP, which are their own."""

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from robot_agent.model.description import NOTHING, Mounted
from robot_agent.paths.caps import Tolerance

Position = tuple[float | None, float | None, float | None]
"""Coordinates [m]; `None` keeps the value."""
Orientation = tuple[float, float, float]
"""A, B, C [rad] with R = Rz(C) Ry(B) Rx(A)."""


BASE = ""
"""Instead of a frame's name: the robot's own base."""


@dataclass(frozen=True, slots=True)
class Aim:
    """What is said of a target beside its coordinates, by a line; in a step, by the line and by the point it names."""

    point: str = ""
    frame: str | None = None
    """Its name, or `BASE`; None, in a line: the one that is active, or that of the point."""
    branch: str = ""
    """Of the arm, for a joint move; empty: the nearest."""
    tool: str | None = None
    """Whose TCP comes there; None: the flange."""
    joints: tuple[float, ...] = ()
    """`(n,)` of a point that is given by joints; then all else says nothing."""


HERE = Aim()


@dataclass(frozen=True, slots=True)
class Goal:
    """The pose that a joint move leads to."""

    position_m: Position
    orientation_abc: Orientation | None
    aim: Aim


@dataclass(frozen=True, slots=True)
class MoveCaps:
    """What every move may be told besides its target; `None` asks for nothing. The slowest of all caps rules."""

    speed_m_s: float | None = None
    """Cap on the speed of the TCP (`FC`, and `F` on its moves)."""
    rotation_rad_s: float | None = None
    """Cap on the rotation of the TCP (`FA`)."""
    joint_speed_rad_s: float | None = None
    """Cap on the speed of the joints, the root of the sum of their squares (`FJ`)."""
    round_m: float | None = None
    """Round edge towards the next move (`R`); 0: stop there, `None`: stop unless it goes straight on."""
    tolerance: Tolerance | None = None
    """Of lines and arcs (`TOL`); `None`: the path is theirs."""


FREELY = MoveCaps()


@dataclass(frozen=True, slots=True)
class Before:
    """A place on a move in front of its end: so much way of the TCP [m] earlier, or so much planned time [s]."""

    way_m: float = 0.0
    time_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Switch:
    """One execution of `SET DO name` or `RESET DO name`: a digital output is switched on or off."""

    line: int
    output: str
    on: bool
    number: int
    """Counts what one run of a program switches, from 1; each round of a loop counts anew."""
    before: Before | None = None
    """On its way to the end of its move; None: at that."""


@dataclass(frozen=True, slots=True)
class FlagMark:
    """One execution of `M n ASYNC`: a flag that is counted and that nobody answers."""

    line: int
    flag: int
    number: int
    """Counts what one run of a program raises so, from 1."""


@dataclass(frozen=True, slots=True)
class LetMark:
    """One execution of LET of a variable of the cell."""

    line: int
    name: str
    value: float
    number: int
    """Counted as those of `FlagMark`."""


Mark = Switch | FlagMark | LetMark
"""What is done where a move ends, without a stop."""


@dataclass(frozen=True, slots=True)
class JointStep:
    """Move joints; `None` keeps a joint, `joints=None` as a whole means home. The rest as in `MoveJoints`."""

    line: int
    joints: tuple[float | None, ...] | None
    speed: float
    pace: MoveCaps = FREELY
    synchronised: bool = True
    switches: tuple[Mark, ...] = ()
    spaces_off: frozenset[str] = frozenset()
    """On every move: the spaces that are switched off during it."""
    mounted: Mounted = NOTHING
    """On every move: what the robot carries during it, as in `Mount`."""
    goal: Goal | None = None
    """Where it leads; `joints` are then reference values that choose among the branches."""

    @property
    def known(self) -> bool:
        """Whether it says by itself where all joints are at its end."""
        return self.goal is None and self.joints is not None and None not in self.joints


@dataclass(frozen=True, slots=True)
class Pause:
    """Stand still for a while."""

    line: int
    duration_s: float


@dataclass(frozen=True, slots=True)
class SwitchNow:
    """Switch outputs where the robot rests: no move is before them."""

    line: int
    switches: tuple[Mark, ...]


@dataclass(frozen=True, slots=True)
class Mount:
    """From here on, at rest, the robot carries this tool and this part."""

    line: int
    mounted: Mounted


@dataclass(frozen=True, slots=True)
class Meet:
    """Wait, at rest, until all robots of a meeting have come to it; they leave together."""

    line: int
    meeting: str
    timeout_s: float | None = None
    """After so long the program ends."""


_DIGITS = 9
"""Numbers that differ from there on are equal."""
COMPARISONS: Mapping[str, Callable[[float, float], bool]] = {
    "=": operator.eq,
    "<>": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_KINDS = {"DI": "input", "DO": "output", "KEY": "key"}


@dataclass(frozen=True, slots=True)
class Signal:
    """A digital input (DI) or output (DO) of the robot, by its name in the drives file, or a Zenoh key (KEY)."""

    kind: str
    name: str
    fresh_s: float = 0.0
    """Of a key: what is older counts as unknown."""

    def __str__(self) -> str:
        return f"{_KINDS[self.kind]} {self.name}"


@dataclass(frozen=True, slots=True)
class Relation:
    """A comparison of two numbers, or variables of the cell by their names, that other robots set."""

    left: float | str
    sign: str
    right: float | str

    def holds(self, value: Callable[[str], float | None]) -> bool | None:
        """Whether it does, by the values of the variables; None where one is not known."""
        left, right = (value(each) if isinstance(each, str) else each for each in (self.left, self.right))
        return None if left is None or right is None else compare(left, self.sign, right)

    @property
    def variables(self) -> tuple[str, ...]:
        return tuple(each for each in (self.left, self.right) if isinstance(each, str))


def compare(left: float, sign: str, right: float) -> bool:
    """Whether a comparison holds; numbers that differ by less than 1e-9 are equal."""
    return COMPARISONS[sign](round(left, _DIGITS), round(right, _DIGITS))


Question = Signal | Relation
"""What nobody knows where a program is read."""


@dataclass(frozen=True, slots=True)
class Test:
    """What is left of a condition once the variables are known. Without anything to ask it holds, or never does."""

    asked: tuple[tuple[Question, bool], ...] = ()
    """Inputs and outputs, and whether they have to be on; comparisons that have to hold."""
    decided: tuple[bool, ...] = ()
    """The other terms."""
    any_of: bool = False
    """One of all is enough."""

    def holds(self, known: Callable[[Question], bool | None]) -> bool | None:
        """Whether it does, by what is known; None where what is not known would decide."""
        answers = [None if is_on is None else is_on is on for is_on, on in ((known(s), on) for s, on in self.asked)]
        answers += self.decided
        if self.any_of in answers:
            return self.any_of
        return None if None in answers else not self.any_of


@dataclass(frozen=True, slots=True, eq=False)
class Decide:
    """At rest, an IF: by its test the program goes on with the next statement, or at the index `target`."""

    line: int
    test: Test
    target: int


@dataclass(frozen=True, slots=True, eq=False)
class AwaitInput:
    """Wait, at rest, until a signal is on, or off."""

    line: int
    signal: Signal
    on: bool
    timeout_s: float | None = None
    """After so long the program goes on at the index `target`, or ends without one."""
    target: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class AwaitAnswer:
    """Wait, at rest, until somebody answers a flag."""

    line: int
    flag: int


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
