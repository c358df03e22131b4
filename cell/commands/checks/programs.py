"""The text of every robot's program."""

from collections.abc import Iterator
from pathlib import Path

from cell.commands.checks.edges import idle_edges
from cell.commands.checks.reachable import unreachable_lines
from cell.commands.checks.readings import NamedFiles
from cell.config.document import Document, Naming, read_text
from cell.config.points_file import PointsOwner, PointsSettings, SignalKind, read_points, settings_of
from cell.config.problem import Problem, Severity, near, refuses
from robot_agent.kinematics import Model
from robot_agent.language import Names, Points, Program, ProgramError, parse_program
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
        text, joints = read_text(file, naming), expected_joints(model_document, model)
        linear = {name for name, joint in model.joints.items() if joint.linear}
        branches = models[robot].branches if robot in models else None
        owner = PointsOwner(joints, linear, document.keys(("frames",)), tuple(model.tools), branches)
        taught, problems = _taught(document, named, robot, file, owner)
        yield from problems
        if not isinstance(text, Problem):
            inputs, outputs = _signals(document, named, robot)
            names = Names(
                joints,
                linear=linear,
                corrections=document.keys(("robots", robot, "corrections")),
                inputs=inputs,
                outputs=outputs,
                spaces=_spaces(document, robot),
                tools=model.tools,
                parts=model.parts,
                meetings=_meetings(document, robot),
                frames=document.keys(("frames",)),
                points=None if taught is None else Points(taught.points),
                signals={} if taught is None else taught.signals,
                robot=robot,
                variables=_variables(document),
                cam=None if taught is None else taught.cam,
            )
            try:
                program = parse_program(text, file.name, names, file.parent)
            except ProgramError as error:
                for each in error.problems:
                    where = file.parent / each.file if each.file else file
                    yield Problem(where, each.line, each.column, "program", each.found, each.allowed)
                continue
            yield from _edges(program, file)
            if robot in models:
                yield from _reach(models[robot], program, file)


def _taught(
    document: Document, named: NamedFiles, robot: str, program: Path, owner: PointsOwner
) -> tuple[PointsSettings | None, list[Problem]]:
    """What a robot was taught, and what is wrong with that; None: nobody can say."""
    naming = Naming(document, ("robots", robot, "points"))
    file = naming.file() or program.parent / f"{robot}.points.yaml"
    if not file.exists():
        return PointsSettings(), []
    reading = read_points(file, owner)
    problems = list(reading.problems)
    if reading.document is None or reading.content is None or refuses(problems):
        return None, problems
    taught = settings_of(reading.content, owner)
    inputs, outputs = _signals(document, named, robot)
    known = {SignalKind.OUTPUT: outputs, SignalKind.INPUT: inputs}
    for name, signal in taught.signals.items():
        there = known.get(signal.kind)
        where = ("signals", name, signal.kind.value)
        if there is not None and signal.name not in there:
            none = f"an {signal.kind.value} of its drives file, which has none"
            found = f"unknown {signal.kind.value} {signal.name!r}"
            problems.append(reading.document.problem(where, found, near(signal.name, there, none)))
        elif there is not None and name in there and name != signal.name:
            found, allowed = f"{name!r}, which is an {signal.kind.value} itself", "a name that the drives file has not"
            problems.append(reading.document.problem(("signals", name), found, allowed, at_key=True))
    return taught, problems


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


def _variables(document: Document) -> dict[str, str]:
    """Those of the cell, with the robot that sets each."""
    said = ((name, document.value(("variables", name))) for name in document.keys(("variables",)))
    return {name: robot for name, robot in said if isinstance(robot, str)}


def _edges(program: Program, file: Path) -> Iterator[Problem]:
    for line, why in idle_edges(program):
        found, allowed = f"an R without effect, the robot stops: {why}", "R where the next move can be joined"
        yield Problem(
            *place_of(program, file, line), 1, "program", found, f"{allowed}; docs/language.md", Severity.WARNING
        )


def _reach(model: Model, program: Program, file: Path) -> Iterator[Problem]:
    for line, why in unreachable_lines(model, program):
        found = f"{program.text_of(line)!r}: {why}"
        yield Problem(
            *place_of(program, file, line),
            1,
            "program",
            found,
            f"what {model.description.name} can do from where it is then",
        )


def place_of(program: Program, file: Path, line: int) -> tuple[Path, int]:
    """The file in which a line of the program in `file` stands, and its number there."""
    name, number = program.place_of(line)
    return (file if name == program.name else file.parent / name), number
