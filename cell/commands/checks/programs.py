"""The text of every robot's program."""

from collections.abc import Iterator
from pathlib import Path

from cell.commands.checks.readings import Readings
from cell.config.document import Naming, read_text
from cell.config.problem import Problem
from robot_agent.language import ProgramError, parse_program


def check_programs(readings: Readings) -> Iterator[Problem]:
    """Every mistake in every program, at its line and column; what cannot be read is found with the cell file."""
    for robot, _, model in readings.usable_models():
        naming = Naming.of(readings.document, "robots", robot, "program")
        file = naming.file(readings.cell.robots[robot].program)
        text = read_text(file, naming)
        if not isinstance(text, Problem):
            yield from _program(text, file, tuple(model.joints))


def _program(text: str, file: Path, joints: tuple[str, ...]) -> Iterator[Problem]:
    try:
        parse_program(text, file.name, joints)
    except ProgramError as error:
        for problem in error.problems:
            yield Problem(file, problem.line, problem.column, "program", problem.found, problem.allowed)
