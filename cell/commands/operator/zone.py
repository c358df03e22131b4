"""`cell zone`: where zones are and how one is changed, and an operator's word about one whose holder fell silent."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_view import names
from cell.commands.client.connection import Connection, connect, report
from cell.commands.client.json_lines import json_line
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.commands.operator.frame import parsed_pose
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, JsonOption, RobotArgument
from cell.geometry import MEASURED, GeometryError, SpaceOf
from cell.messages import AdoptZone, ClearZone, Place, SetZone, ZoneGeometry

_ANSWER_S = 1.0
_LONGEST_M = 1e6
_HIGHEST = 1000
ZoneArgument = Annotated[str, typer.Argument(metavar="ZONE", help="Name of the zone in the cell file.")]


def _check_zone(operator: Connection, zone: str) -> None:
    if zone not in operator.settings.zones:
        raise CommandError(f"no zone {zone!r} in {operator.file}; its zones are: {names(operator.settings.zones)}")


def clear(zone: ZoneArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Declare a zone free: you have looked, and nobody is inside.

    The software cannot know where a silent robot stands; this is your word for it.
    """
    with connect(file, endpoint) as operator:
        _check_zone(operator, zone)
        report("manager", operator.ask_manager(ClearZone(zone=zone, by=operator_name())))


def adopt(
    zone: ZoneArgument, robot: RobotArgument, file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None
) -> None:
    """Give an orphaned zone to the robot that stands in it, after its agent was started anew."""
    with connect(file, endpoint) as operator:
        _check_zone(operator, zone)
        operator.check_robot(robot)
        report("manager", operator.ask_manager(AdoptZone(zone=zone, robot=robot, by=operator_name())))


def show(
    zone: Annotated[str | None, typer.Argument(metavar="[ZONE]", help="Only this one.", show_default=False)] = None,
    as_json: JsonOption = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Print the zones of the running cell, by the manager: shape, place in world, what counts in them, for whom."""
    with connect(file, endpoint) as operator:
        if zone is not None:
            _check_zone(operator, zone)
        operator.manager_state()
        told = operator.session.last("zone/*", _ANSWER_S)
        zones = sorted((each for each in told if isinstance(each, ZoneGeometry)), key=lambda each: each.zone)
        for each in zones:
            if zone in (None, each.zone):
                line = f"{each.zone}: {each.described()}; for {', '.join(each.robots)}; version {each.version}"
                typer.echo(json_line("zone", each.zone, each) if as_json else line)
        if not zones and not as_json:
            typer.echo(f"cell {operator.settings.name} has no zones")


def set_(
    zone: ZoneArgument,
    pose: Annotated[
        str | None,
        typer.Option("--pose", metavar="X,Y,Z,A,B,C", help="Of its middle, in the zone's frame; mm and deg."),
    ] = None,
    box: Annotated[str | None, typer.Option("--box", metavar="X,Y,Z", help="A box: edge lengths in mm.")] = None,
    sphere: Annotated[str | None, typer.Option("--sphere", metavar="R", help="A ball: radius in mm.")] = None,
    cylinder: Annotated[
        str | None, typer.Option("--cylinder", metavar="R,L", help="A round column about Z: radius, length in mm.")
    ] = None,
    of: Annotated[SpaceOf | None, typer.Option("--of", help="What of a robot counts in it.")] = None,
    priority: Annotated[
        list[str] | None, typer.Option("--priority", metavar="ROBOT=N", help="Before how many others it goes.")
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Change a zone, in the manager's cell file and in the running cell. What is not named stays.

    Where anything but a priority changes, all robots of the cell stay at rest meanwhile: it is refused while one moves
    or runs a program, is silent, holds the zone, or stands where it is to be. Motions that were planned before are not
    driven any more: programs that were halted begin anew with `cell run`.
    """
    placed = None if pose is None else parsed_pose(pose)
    shape, lengths = _shape({"box": box, "sphere": sphere, "cylinder": cylinder})
    place = None if placed is None else Place(placed.position_m, placed.quaternion_xyzw)
    try:
        order = SetZone(zone, operator_name(), place, shape, lengths, of, _ranks(priority or []))
    except GeometryError as error:
        raise CommandError(str(error)) from error
    except ValueError as error:
        raise CommandError(
            "nothing to change", "name --pose, --box, --sphere, --cylinder, --of or --priority"
        ) from error
    with connect(file, endpoint) as operator:
        _check_zone(operator, zone)
        report("manager", operator.ask_manager(order))


def _shape(given: dict[str, str | None]) -> tuple[str | None, tuple[float, ...]]:
    """The one shape that is named, and its lengths [m]. Raises `CommandError`."""
    named = {shape: text for shape, text in given.items() if text is not None}
    if len(named) > 1:
        raise CommandError(f"{' and '.join(f'--{shape}' for shape in named)} found, allowed is one shape")
    for shape, text in named.items():
        lengths = MEASURED[shape].lengths
        try:
            values = [float(part) / 1000.0 for part in text.split(",")]
        except ValueError:
            values = []
        if len(values) != len(lengths) or not all(0.0 < value <= _LONGEST_M for value in values):
            allowed = f"{len(lengths)} length{'s' if len(lengths) > 1 else ''} above 0 in mm: {', '.join(lengths)}"
            raise CommandError(f"--{shape} {text[:80]!r} found, allowed {allowed}")
        return shape, tuple(values)
    return None, ()


def _ranks(given: list[str]) -> dict[str, int]:
    ranks = {}
    for each in given:
        robot, _, number = each.partition("=")
        if not (robot and number.isascii() and number.isdigit() and int(number) <= _HIGHEST):
            raise CommandError(f"--priority {each[:80]!r} found, allowed is a robot and 0 to {_HIGHEST}: left=2")
        ranks[robot] = int(number)
    return ranks
