"""`cell check`: every problem of every file of a cell, or a summary of a good one."""

from pathlib import Path
from typing import Annotated

import typer
from rich.box import SIMPLE
from rich.console import Console, Group
from rich.table import Table

from cell.commands.checks import CellBundle, check_cell
from cell.commands.checks.motions import ProgramCourse, check_motions, listed
from cell.commands.checks.separation import robots_apart
from cell.config.problem import Problem, refuses
from drive_gateway.config import GatewaySettings
from drive_gateway.config.bus_load import bus_load
from drive_gateway.config.image import images_of


def check(file: Annotated[Path, typer.Argument(metavar="FILE", help="The cell file.", show_default=False)]) -> None:
    """Check a cell file and every file that it names, and plan every robot's program.

    Prints all problems, one a line, as file:line:column: path: found ..., allowed ... and exits with 1; a good cell is
    summed up, its warnings are printed, and the exit is 0.

    Programs are planned from home, each loop twice round, without pauses, zones and what TRACK follows, and up to 60 s
    of motion. Corners after which a robot stops are no problem; they are listed. `cell plot` says why it does.
    """
    bundle, problems = check_cell(file)
    courses: list[ProgramCourse] = []
    if bundle is not None:
        courses, found = check_motions(bundle)
        problems += found
    for problem in problems:
        typer.echo(str(problem))
    if bundle is None or refuses(problems):
        typer.echo(_count(problems))
        raise typer.Exit(1)
    Console().print(_summary(bundle, courses))


def _count(problems: list[Problem]) -> str:
    errors = sum(refuses([problem]) for problem in problems)
    warnings = len(problems) - errors
    files = len({problem.file for problem in problems})
    text = f"{_several(errors, 'problem')} in {_several(files, 'file')}"
    return text + (f", {_several(warnings, 'warning')} among them" if warnings else "")


def _several(count: int, what: str) -> str:
    return f"{count} {what}" + ("" if count == 1 else "s")


def _summary(bundle: CellBundle, courses: list[ProgramCourse]) -> Group:
    cell = bundle.cell
    title = f"cell {cell.name} is good, digest {cell.digest}"
    robots = _table("robot", "model", "gateway", "base mm")
    for name, robot in cell.robots.items():
        base = _millimetres(robot.base.position_m)
        robots.add_row(name, bundle.robots[name].model.description.name, robot.gateway, base)
    programs = _table("robot", "program", "lines with moves", "motion s", "stops after lines")
    for course in courses:
        name, rests = cell.robots[course.robot].program.name, listed(course.rests) or "-"
        programs.add_row(course.robot, name, str(course.moves), f"{course.duration_s:.1f}", rests)
    gateways = _table("gateway", "endpoint", "bus", "kbit/s", "nodes", "cycle ms", "load")
    gateways.caption = "load: worst case of the cyclic frames, and 10 % for SDO and EMCY"
    gateways.caption_justify = "left"
    for name, gateway in bundle.gateways.items():
        gateways.add_row(name, cell.gateways[name].endpoint, *_bus_cells(gateway))
    zones = _table("zone", "of", "shape", "lengths mm", "centre mm", "robots")
    for name, zone in cell.zones.items():
        robots_first = sorted(zone.robots, key=lambda robot: -zone.priority.get(robot, 0))
        who = ", ".join(f"{robot} ({n})" if (n := zone.priority.get(robot)) else robot for robot in robots_first)
        lengths, centre = _millimetres(zone.size_m), _millimetres(zone.pose.position_m)
        zones.add_row(name, zone.of.value, zone.shape, lengths, centre, who)
    shared = [zones] if cell.zones else []
    return Group(title, robots, programs, gateways, *shared, *_kept_apart(bundle))


def _kept_apart(bundle: CellBundle) -> list[Table | str]:
    """What cleared space means in this cell, by pairs of robots."""
    if bundle.cell.separation is None:
        alone = len(bundle.cell.robots) == 1
        return [] if alone else ["Robots are not kept apart (separation: off): zones alone do that."]
    table = _table("kept apart", "margin mm", "apart at home mm", "bases apart mm", "reach mm")
    pairs = robots_apart(bundle.cell.separation, bundle.robots)
    for pair in pairs:
        lengths = _millimetres((pair.margin_m, pair.home_m, pair.bases_m)).split(", ")
        table.add_row(", ".join(pair.robots), *lengths, _millimetres(pair.reaches_m))
    notes = [note for pair in pairs for note in pair.notes]
    remedy = "Home it, or say where it stays: `cell confine ROBOT`, `cell stands ROBOT`."
    return [table, *notes, remedy] if notes else [table]


def _millimetres(xyz: tuple[float, ...]) -> str:
    return ", ".join(f"{1000 * value:.0f}" for value in xyz)


def _bus_cells(gateway: GatewaySettings) -> tuple[str, ...]:
    images = images_of(gateway)
    load = bus_load(images, gateway.bus.bitrate, gateway.cycle_s, gateway.heartbeat_producer_s)
    bus = f"{gateway.bus.interface} {gateway.bus.channel}"
    return (
        bus,
        f"{gateway.bus.bitrate / 1000:g}",
        str(len({image.node_id for image in images})),
        f"{1000 * gateway.cycle_s:g}",
        f"{100 * load.total:.0f} %",
    )


def _table(*headings: str) -> Table:
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0))
    for heading in headings:
        # An address that is broken over two lines cannot be copied.
        table.add_column(heading, overflow="fold", no_wrap=heading == "endpoint")
    return table
