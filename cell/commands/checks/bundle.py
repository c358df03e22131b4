"""From the path of a cell file to everything that its processes need, or to all problems of all files."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cell.commands.checks.bodies import check_bodies
from cell.commands.checks.buses import check_buses
from cell.commands.checks.drives import at_home, check_drives
from cell.commands.checks.programs import check_programs
from cell.commands.checks.readings import NamedFiles, Readings, read_named_files
from cell.commands.checks.separation import check_separation
from cell.commands.checks.spaces import check_spaces
from cell.commands.checks.things import check_homes, check_things
from cell.commands.checks.times import check_times
from cell.config.cell_file import CellFile
from cell.config.document import Document
from cell.config.load import cell_settings, read_cell
from cell.config.problem import Problem, refuses
from cell.config.settings import CellSettings
from drive_gateway.config import GatewaySettings
from drive_gateway.sim.config.load import simulation_of
from drive_gateway.sim.config.simulation import Simulation
from robot_agent.kinematics import KinematicsError, Model, model_of
from robot_agent.model import NO_TOOL
from robot_agent.workspace import PlacedRobot, with_tool


@dataclass(frozen=True, slots=True)
class CellBundle:
    """A cell whose configuration is good: its settings, its robots and its gateways by name."""

    cell: CellSettings
    robots: dict[str, PlacedRobot]
    gateways: dict[str, GatewaySettings]
    simulations: dict[str, Simulation]
    """How the drives of each gateway are simulated."""


def check_cell(path: str | Path) -> tuple[CellBundle | None, list[Problem]]:
    """Read and check the cell file and all files that it names.

    Returns the bundle, or None with at least one error, and every problem of every file, warnings included, file by
    file and line by line.
    """
    reading = read_cell(Path(path))
    settings, problems = cell_settings(reading)
    if reading.document is None:
        return None, problems
    named = read_named_files(reading.document)
    models, unfit = _kinematic_models(named)
    problems += [*named.problems(), *unfit]
    if reading.content is not None:
        problems += _mounted(reading.document, reading.content, models)
    problems += check_programs(reading.document, named, models)
    if reading.content is not None:
        readings = Readings(reading.document, reading.content, named)
        problems += [*check_drives(readings), *check_times(readings), *check_buses(readings)]
        problems += [*check_bodies(readings, models), *check_things(readings, models)]
        problems += check_spaces(readings, models)
        problems += check_separation(readings, models)
        if not refuses(problems):
            problems += check_homes(readings, models)
    problems += [problem for simulation in named.simulations.values() for problem in simulation.problems]
    problems = _in_order(problems)
    if settings is None or refuses(problems):
        return None, problems
    return _bundle(settings, named, models), problems


def _kinematic_models(named: NamedFiles) -> tuple[dict[str, Model], list[Problem]]:
    """Kinematics by robot, and what keeps a file without other problems from having any."""
    models: dict[str, Model] = {}
    problems: list[Problem] = []
    for robot, document, file in named.usable_models():
        if refuses(named.models[robot].problems):
            continue
        try:
            model = model_of(file.description(document.file.parent))
            model.forward(model.home)
        except KinematicsError as error:
            allowed = f"a robot of family {file.family}"
            problems.append(document.problem(("geometry",), str(error), allowed, at_key=True))
        else:
            models[robot] = model
    return models, problems


def _mounted(document: Document, cell: CellFile, models: dict[str, Model]) -> Iterator[Problem]:
    """Give robots the tools that the cell file names; a problem where the robot file has no such tool."""
    for robot, entry in cell.robots.items():
        if entry.tool is None or robot not in models:
            continue
        known = (*models[robot].description.tools, NO_TOOL)
        if entry.tool in known:
            models[robot] = with_tool(models[robot], entry.tool)
        else:
            allowed = f"a tool of its robot file, or none: {', '.join(known)}"
            yield document.problem(("robots", robot, "tool"), f"unknown tool {entry.tool!r}", allowed)


def _bundle(settings: CellSettings, named: NamedFiles, models: dict[str, Model]) -> CellBundle:
    files = {robot: file for robot, _, file in named.usable_models()}
    return CellBundle(
        cell=settings,
        robots={name: PlacedRobot.of(robot, models[name]) for name, robot in settings.robots.items()},
        gateways={gateway: drives.settings(gateway) for gateway, _, drives in named.usable_drives()},
        simulations={
            gateway: at_home(
                simulation_of(named.simulations[gateway], drives),
                {robot: file for robot, file in files.items() if robot in drives.robots},
            )
            for gateway, _, drives in named.usable_drives()
        },
    )


def _in_order(problems: list[Problem]) -> list[Problem]:
    """Each problem once, files in the order in which they were read, then by line and column."""
    once = list(dict.fromkeys(problems))
    files = list(dict.fromkeys(problem.file for problem in once))
    return sorted(once, key=lambda problem: (files.index(problem.file), problem.line, problem.column))
