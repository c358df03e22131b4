"""The program of a robot, read from its files: at the start of its agent, and on a call anew, or another one."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath

from cell.config.document import read_text
from cell.config.points_file import load_points
from cell.config.problem import ConfigError, Problem
from cell.config.settings import CellSettings
from cell.core import Answer, Effect
from cell.messages import Reply, Severity
from robot_agent.agent.planning.planner import Planner
from robot_agent.kinematics import Model
from robot_agent.language import Names, Program, ProgramError, parse_program, points_owner

_MOST_TOLD, _LONGEST_TOLD = 10, 300
"""Mistakes in an answer, and characters of each."""


@dataclass(frozen=True, slots=True)
class ReadProgram(Effect):
    """`read_program` with these; `ProgramRead` or `ProgramNotRead` with the same id comes back."""

    id: int
    cell: CellSettings
    robot: str
    model: Model
    file: Path


@dataclass(frozen=True, slots=True)
class ProgramRead:
    """A program without mistakes."""

    id: int
    program: Program


@dataclass(frozen=True, slots=True)
class ProgramNotRead:
    """The files have mistakes; which, for people."""

    id: int
    reason: str


class NotLoaded(Exception):
    """No program is read; the text says why, for people."""


def read_program(cell: CellSettings, robot: str, model: Model, file: Path) -> Program:
    """The program in `file`, with all that it calls and the points of its robot.

    Raises:
        cell.config.problem.ConfigError: with every mistake in all of these.
    """
    described, problems = model.description, list[Problem]()
    owner = points_owner(cell, described, model.branches)
    try:
        names = Names.of(cell, robot, described, load_points(cell.robots[robot].points, owner))
    except ConfigError as error:
        names = replace(Names.of(cell, robot, described), points=None)
        problems += error.problems
    text = read_text(file)
    if isinstance(text, Problem):
        raise ConfigError((*problems, text))
    try:
        program = parse_program(text, file.name, names, file.parent)
    except ProgramError as error:
        problems += (
            Problem(file.parent / (each.file or file.name), each.line, each.column, "program", each.found, each.allowed)
            for each in error.problems
        )
        raise ConfigError(tuple(problems)) from error
    if problems:
        raise ConfigError(tuple(problems))
    return program


def mistakes_text(problems: tuple[Problem, ...]) -> str:
    """The first mistakes, one a line, and how many more there are."""
    lines = [text if len(text := str(each)) <= _LONGEST_TOLD else f"{text[:_LONGEST_TOLD]}…" for each in problems]
    more = len(lines) - _MOST_TOLD
    return "\n".join([*lines[:_MOST_TOLD], *([f"and {more} more"] if more > 0 else [])])


@dataclass(frozen=True, slots=True)
class _Waiting:
    """An operator who waits for a program to be read."""

    id: int
    request_id: str
    call_id: str
    file: Path


class Loading:
    """Which file the present program is from, and at most one that is being read by the shell."""

    def __init__(self, robot: str, cell: CellSettings, event: Callable[[Severity, str, str], None]) -> None:
        """`event` notes severity, code and text of what has happened."""
        self._robot = robot
        self._cell = cell
        self._event = event
        self._file = cell.robots[robot].program
        self._ids = itertools.count(1)
        self._waiting: _Waiting | None = None
        self._outcome: ProgramRead | ProgramNotRead | None = None

    @property
    def under_way(self) -> bool:
        """A program is being read."""
        return self._waiting is not None

    def file(self, wanted: str | None) -> Path:
        """Where to read: below the folder of the cell file, or the present program's file again. Raises `NotLoaded`."""
        if self._waiting is not None:
            raise NotLoaded(f"{self._waiting.file.name} is being read: load once that is done")
        if wanted is None:
            return self._file
        path = PurePosixPath(wanted)
        if not path.parts or not wanted.isprintable() or path.is_absolute() or ".." in path.parts:
            folder = "the folder of the cell file on the agent's computer"
            raise NotLoaded(f"the file {wanted!r} found, allowed is one in {folder}, relative to that and without ..")
        return self._cell.file.parent / path

    def read(self, file: Path, planner: Planner, request_id: str, call_id: str) -> ReadProgram:
        """What the shell does; the operator is answered once it is done."""
        self._waiting = _Waiting(next(self._ids), request_id, call_id, file)
        return ReadProgram(self._waiting.id, self._cell, self._robot, planner.model, file)

    def heard(self, outcome: ProgramRead | ProgramNotRead) -> None:
        """Take what the shell says, unless nobody waits for it any more."""
        if self._waiting is not None and outcome.id == self._waiting.id:
            self._outcome = outcome

    @property
    def outcome(self) -> ProgramRead | ProgramNotRead | None:
        """What became of the files, until that is answered."""
        return self._outcome

    def answered(self, ok: bool, text: str) -> list[Effect]:
        """Answer who waits, if somebody does; nothing is being read from here on."""
        waiting, self._waiting, self._outcome = self._waiting, None, None
        return [] if waiting is None else [Answer(waiting.request_id, Reply(waiting.call_id, ok, text))]

    def taken(self, program: Program, *, ended: bool) -> str:
        """The robot has the program that was read, by which another one has `ended` or not; what is to be said."""
        if self._waiting is not None:
            self._file = self._waiting.file
        of_cell_file = self._cell.robots[self._robot].program
        text = f"{self._robot} has taken {program.name}, {len(program.lines)} lines"
        if ended:
            text += "; the program that was begun has ended by that"
        self._event(Severity.INFO, "program_loaded", text)
        text += f"; `cell run {self._robot}` starts it"
        if self._file != of_cell_file:
            text += f"; after the next start of its agent {of_cell_file.name} of the cell file counts again"
        return text
