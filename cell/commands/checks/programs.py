"""The text of every robot's program."""

from collections.abc import Iterator
from pathlib import Path

from cell.commands.checks.edges import idle_edges
from cell.commands.checks.reach import unreachable_lines
from cell.commands.checks.readings import NamedFiles
from cell.config.document import Document, Naming, read_text
from cell.config.problem import Problem, Severity
from robot_agent.kinematics import Model
from robot_agent.language import Names, Program, ProgramError, parse_program
from robot_agent.language.names import Known
from robot_agent.model.checks import expected_joints


def check_programs(document: Document, named: NamedFiles, models: dict[str, Model]) -> Iterator[Problem]:
    """Every mistake in every program, at its line and column; what cannot be read is found with the cell file.

    Where there is a robot's kinematics, also what the program tells it to do and it cannot reach.
    """
    for robot, model_document, model in named.usable_models():
        naming = Naming(document, ("robots", robot, "program"))
        if (file := naming.file()) is None:
            continue
        text = read_text(file, naming)
        if not isinstance(text, Problem):
            joints = expected_joints(model_document, model)
            linear = {name for name, joint in model.joints.items() if joint.linear}
            try:
                corrections = document.keys(("robots", robot, "corrections"))
                inputs, outputs = _signals(document, named, robot)
                program = parse_program(
                    text,
                    file.name,
                    Names(
                        joints,
                        linear=linear,
                        corrections=corrections,
                        outputs=outputs,
                        inputs=inputs,
                        spaces=_spaces(document, robot),
                        parts=model.parts,
                        meetings=_meetings(document, robot),
                    ),
                )
            except ProgramError as error:
                for problem in error.problems:
                    yield Problem(file, problem.line, problem.column, "program", problem.found, problem.allowed)
                continue
            yield from _edges(program, file)
            if robot in models:
                yield from _reach(models[robot], program, file)


def _signals(document: Document, named: NamedFiles, robot: str) -> tuple[Known, Known]:
    """The inputs and outputs of the robot's drives file; None where nobody can look at it."""
    gateway = document.value(("robots", robot, "gateway"))
    for name, _, drives in named.usable_drives():
        if name == gateway and robot in drives.robots:
            return drives.robots[robot].inputs, drives.robots[robot].outputs
    return None, None


def _spaces(document: Document, robot: str) -> list[str]:
    """What the robot's program may switch."""
    place = ("robots", robot, "spaces")
    return [name for name in document.keys(place) if document.value((*place, name, "by_program")) is True]


def _meetings(document: Document, robot: str) -> list[str]:
    """Those that the robot is in."""
    named = ((name, document.value(("meetings", name))) for name in document.keys(("meetings",)))
    return [name for name, robots in named if isinstance(robots, list | tuple) and robot in robots]


def _edges(program: Program, file: Path) -> Iterator[Problem]:
    for line, why in idle_edges(program):
        found, allowed = f"an R without effect, the robot stops: {why}", "R where the next move can be joined"
        yield Problem(file, line, 1, "program", found, f"{allowed}; docs/language.md", Severity.WARNING)


def _reach(model: Model, program: Program, file: Path) -> Iterator[Problem]:
    for line, why in unreachable_lines(model, program):
        found = f"{program.text_of(line)!r}: {why}"
        yield Problem(file, line, 1, "program", found, f"what {model.description.name} can do from where it is then")
