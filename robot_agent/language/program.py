"""A program as data, and what is wrong with its text."""

from collections.abc import Collection
from dataclasses import dataclass

from robot_agent.language.statement import Statement
from robot_agent.language.steps import Signal


@dataclass(frozen=True, slots=True)
class Program:
    """A program that has passed the parser. `lines` is its text, for display."""

    name: str
    statements: tuple[Statement, ...]
    lines: tuple[str, ...]

    def unknown_output(self, known: Collection[str]) -> tuple[int, str] | None:
        """Line and name of the first output that a statement may switch and that is not `known`."""
        named = ((each.line, output) for each in self.statements for output in each.switched_outputs)
        return next(((line, output) for line, output in named if output not in known), None)

    def unknown_signal(self, known: dict[str, Collection[str] | None]) -> tuple[int, Signal] | None:
        """Line and signal of the first one that a statement asks for and that is not `known`; by kind, None: unsaid."""
        for each in self.statements:
            for signal in each.signals:
                names = known[signal.kind]
                if names is not None and signal.name not in names:
                    return each.line, signal
        return None

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
