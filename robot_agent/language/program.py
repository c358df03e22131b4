"""A program as data, and what is wrong with its text."""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Self

from cell.config.points_file import PosePoint
from robot_agent.language.names import Points
from robot_agent.language.statement import Statement
from robot_agent.language.steps import Signal
from robot_agent.language.words import COMMENT


class CalledLine(int):
    """A line of a file that a program calls: its number among all lines of the program; people see number and file."""

    def __new__(cls, line: int, file: str, number: int) -> Self:
        """`number` is that of the line in its file, from 1."""
        made = super().__new__(cls, line)
        made.file, made.number = file, number
        return made

    file: str
    number: int

    def __str__(self) -> str:
        return f"{self.number} of {self.file}"

    def __reduce__(self) -> tuple[type[Self], tuple[int, str, int]]:
        return type(self), (int(self), self.file, self.number)


@dataclass(frozen=True, slots=True)
class Program:
    """A program that has passed the parser. `lines` is its text and that of the files it calls, for display."""

    name: str
    statements: tuple[Statement, ...]
    lines: tuple[str, ...]
    points: Points = field(default_factory=Points)
    """Looked up when the program comes to a line that names one."""

    @property
    def frames(self) -> frozenset[str]:
        """The frames that its statements and the points of its robot name."""
        of_points = (point.frame for point in self.points.named.values() if isinstance(point, PosePoint))
        named = (frame for each in self.statements for frame in each.frames)
        return frozenset(frame for frame in (*of_points, *named) if frame)

    def unknown_output(self, known: Collection[str]) -> tuple[int, str] | None:
        """Line and name of the first output that a statement may switch and that is not `known`."""
        named = ((each.line, output) for each in self.statements for output in each.switched_outputs)
        return next(((line, output) for line, output in named if output not in known), None)

    def place_of(self, line: int) -> tuple[str, int]:
        """File and number of a line: those of the file that the program calls, where it is one of that."""
        return (line.file, line.number) if isinstance(line, CalledLine) else (self.name, line)

    def unknown_signal(self, known: dict[str, Collection[str] | None]) -> tuple[int, Signal] | None:
        """Line and signal of the first one that a statement asks for and that is not `known`; by kind, None: unsaid."""
        for each in self.statements:
            for signal in each.signals:
                names = known.get(signal.kind)
                if names is not None and signal.name not in names:
                    return each.line, signal
        return None

    @property
    def keys(self) -> frozenset[str]:
        """The Zenoh keys that its statements ask for."""
        return frozenset(each.name for one in self.statements for each in one.signals if each.kind == "KEY")

    def text_of(self, line: int) -> str:
        """The text of a line (from 1) without its comment; empty for lines outside the program."""
        if not 1 <= line <= len(self.lines):
            return ""
        return COMMENT.split(self.lines[line - 1], maxsplit=1)[0].strip()


@dataclass(frozen=True, slots=True)
class ProgramProblem:
    """One mistake in a program: where, what was found, what is allowed. Line and column count from 1."""

    line: int
    column: int
    found: str
    allowed: str
    file: str = ""
    """That the program calls; empty for its own."""

    def __str__(self) -> str:
        return f"{self.line}:{self.column}: found {self.found}, allowed {self.allowed}"


class ProgramError(Exception):
    """A program with mistakes: all of them."""

    def __init__(self, name: str, problems: tuple[ProgramProblem, ...]) -> None:
        self.name = name
        self.problems = problems
        super().__init__("\n".join(f"{problem.file or name}:{problem}" for problem in problems))
