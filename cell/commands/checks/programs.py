"""The text of every robot's program."""

from collections.abc import Iterator
from pathlib import Path

from cell.commands.checks.readings import NamedFiles
from cell.config.document import Document, Naming, read_text
from cell.config.problem import Problem
from robot_agent.language import ProgramError, parse_program
from robot_agent.model.checks import expected_joints


def check_programs(document: Document, named: NamedFiles) -> Iterator[Problem]:
    """Every mistake in every program, at its line and column; what cannot be read is found with the cell file."""
    for robot, model_document, model in named.usable_models():
        naming = Naming(document, ("robots", robot, "program"))
        if (file := naming.file()) is None:
            continue
        text = read_text(file, naming)
        if not isinstance(text, Problem):
            joints = expected_joints(model_document, model)
            linear = {name for name, joint in model.joints.items() if joint.linear}
            yield from _program(text, file, joints, linear)


def _program(text: str, file: Path, joints: tuple[str, ...], linear: set[str]) -> Iterator[Problem]:
    try:
        parse_program(text, file.name, joints, linear)
    except ProgramError as error:
        for problem in error.problems:
            yield Problem(file, problem.line, problem.column, "program", problem.found, problem.allowed)
