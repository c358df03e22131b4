"""A program as data: statements in SI units, each with the line it came from."""

from collections.abc import Collection
from dataclasses import dataclass

Position = tuple[float | None, float | None, float | None]
"""Coordinates [m]; `None` keeps the value."""
Orientation = tuple[float, float, float]
"""A, B, C [rad] with R = Rz(C) Ry(B) Rx(A)."""


@dataclass(frozen=True, slots=True)
class Pace:
    """What every move may be told besides its target; `None` asks for nothing. The slowest of all caps rules."""

    speed_m_s: float | None = None
    """Cap on the speed of the flange (`FC`, and `F` on its moves)."""
    rotation_rad_s: float | None = None
    """Cap on the rotation of the flange (`FA`)."""
    joint_speed_rad_s: float | None = None
    """Cap on the speed of the joints, the root of the sum of their squares (`FJ`)."""
    round_m: float | None = None
    """Round edge towards the next move (`R`); 0: stop there, `None`: stop unless it goes straight on."""


FREELY = Pace()


@dataclass(frozen=True, slots=True)
class Switch:
    """One execution of `SET DO name` or `RESET DO name`: a digital output is switched on or off."""

    line: int
    output: str
    on: bool
    number: int
    """Counts what one run of a program switches, from 1; each round of a loop counts anew."""


@dataclass(frozen=True, slots=True)
class MoveJoints:
    """`MJ J1=… F=…`: all joints start and end together. Joints that are not named (`None`) keep their value."""

    line: int
    joints: tuple[float | None, ...]
    """Target per joint [rad or m]."""
    speed: float
    """Fraction of the joints' speed limits, above 0 to 1."""
    pace: Pace = FREELY
    synchronised: bool = True
    """`SYNC=0`: each joint at its own speed, they start together and arrive when they do."""


@dataclass(frozen=True, slots=True)
class MoveLine:
    """`ML X=… F=…`: the flange moves on a straight line in the robot's base frame."""

    line: int
    position_m: Position
    orientation_abc: Orientation | None
    """`None` keeps the orientation."""
    pace: Pace = FREELY
    wrist_may_flip: bool = False
    tangential_rad: float | None = None
    """`TANG`, on every move of the flange: the tool follows the direction of the path, at this angle to it."""
    switches: tuple[Switch, ...] = ()
    """On every move: what is switched at its end."""


@dataclass(frozen=True, slots=True)
class MoveArc:
    """`MC QX=… X=… F=…`: the flange moves on the circle through where it is, the via point Q and the target."""

    line: int
    via_position_m: Position
    via_orientation_abc: Orientation | None
    """`None`: turned evenly on the way to the target."""
    position_m: Position
    orientation_abc: Orientation | None
    angle_rad: float | None
    """`H`: how far to go on the circle; the target is then only a point of it."""
    pace: Pace = FREELY
    tangential_rad: float | None = None
    switches: tuple[Switch, ...] = ()


@dataclass(frozen=True, slots=True)
class MoveSpline:
    """`MS X=… F=…`: the next point of a spline; consecutive ones are one curve."""

    line: int
    position_m: Position
    orientation_abc: Orientation | None
    pace: Pace = FREELY
    tangential_rad: float | None = None
    switches: tuple[Switch, ...] = ()


@dataclass(frozen=True, slots=True)
class Home:
    """`HOME F=…`: a joint move to the robot's home position."""

    line: int
    speed: float
    pace: Pace = FREELY


@dataclass(frozen=True, slots=True)
class Tangent:
    """`TANG 1 H=…`, `TANG 0`: from here on the tool follows the path at this angle [rad], or (`None`) no longer."""

    line: int
    angle_rad: float | None


@dataclass(frozen=True, slots=True)
class Track:
    """`TRACK name`, `TRACK OFF`: from here on the robot follows this correction on its path, or (`None`) none."""

    line: int
    name: str | None


@dataclass(frozen=True, slots=True)
class SetOutput:
    """`SET DO name`, `RESET DO name`: where the move before it ends, this digital output is switched."""

    line: int
    output: str
    on: bool


@dataclass(frozen=True, slots=True)
class Wait:
    """`WAIT s`: stand still."""

    line: int
    duration_s: float


@dataclass(frozen=True, slots=True)
class Label:
    """`LABEL name`: a place to jump to."""

    line: int
    name: str


@dataclass(frozen=True, slots=True)
class Goto:
    """`GOTO name n`: jump `n` times, then go on; without `n` jump always. The count starts anew after it ran out."""

    line: int
    target: int
    """Index of the statement behind the label."""
    count: int | None


@dataclass(frozen=True, slots=True)
class End:
    """`END`: the program is done."""

    line: int


Statement = (
    MoveJoints | MoveLine | MoveArc | MoveSpline | Home | Tangent | Track | SetOutput | Wait | Label | Goto | End
)


@dataclass(frozen=True, slots=True)
class Program:
    """A program that has passed the parser. `lines` is its text, for display."""

    name: str
    statements: tuple[Statement, ...]
    lines: tuple[str, ...]

    def unknown_output(self, known: Collection[str]) -> SetOutput | None:
        """The first statement that switches an output which is not `known`."""
        switching = (each for each in self.statements if isinstance(each, SetOutput))
        return next((each for each in switching if each.output not in known), None)

    def text_of(self, line: int) -> str:
        """The text of a line (from 1) without its comment; empty for lines outside the program."""
        if not 1 <= line <= len(self.lines):
            return ""
        return self.lines[line - 1].split(";")[0].strip()


@dataclass(frozen=True, slots=True)
class ProgramProblem:
    """One mistake in a program: where, what was found, what is allowed. Line and column count from 1."""

    line: int
    column: int
    found: str
    allowed: str

    def __str__(self) -> str:
        return f"{self.line}:{self.column}: found {self.found}, allowed {self.allowed}"


class ProgramError(Exception):
    """A program with mistakes: all of them."""

    def __init__(self, name: str, problems: tuple[ProgramProblem, ...]) -> None:
        self.name = name
        self.problems = problems
        super().__init__("\n".join(f"{name}:{problem}" for problem in problems))
