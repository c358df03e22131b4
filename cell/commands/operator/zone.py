"""`cell zone clear` and `cell zone adopt`: an operator's word about a zone whose holder fell silent."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_view import names
from cell.commands.client.connection import Connection, connect, report
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, RobotArgument
from cell.messages import AdoptZone, ClearZone

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
