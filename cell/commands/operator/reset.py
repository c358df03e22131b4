"""`cell reset`: clear the emergency stop and acknowledge faults; nothing moves by it."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.connection import Connection, ask_each, connect, report
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption
from cell.messages import ResetEstop, ResetRobot

CLEARED_TIMEOUT_S = 2.0


def reset(
    robots: Annotated[
        list[str] | None,
        typer.Argument(metavar="[ROBOT]...", help="Acknowledge the faults of these robots only.", show_default=False),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Clear the cell's emergency stops, then acknowledge the faults of all robots, or of the named ones.

    The stops that are cleared are shown; one that comes meanwhile stays in force. Nothing moves and no drive is
    switched on: that takes `cell enable` and `cell run` or `cell continue`.
    """
    with connect(file, endpoint) as operator:
        for robot in robots or ():
            operator.check_robot(robot)
        chosen = tuple(robots or operator.settings.robots)
        _clear_stops(operator, chosen)
        ask_each(operator, chosen, ResetRobot())


def _clear_stops(operator: Connection, robots: tuple[str, ...]) -> None:
    """Clear the stops that the operator is shown. Raises `CommandError` when another one is in force."""
    estops = operator.manager_state().estops
    for estop in estops:
        print(f"clearing the emergency stop by {estop.by}: {estop.reason}")
    if not estops:
        print("no emergency stop is in force")
        return
    reply = operator.ask_manager(ResetEstop(operator_name(), tuple(estop.id for estop in estops)))
    if not reply.ok:
        raise CommandError(
            f"manager: {reply.text}", f"no fault was acknowledged; look with: cell status -f {quoted(operator.file)}"
        )
    report("manager", reply)
    _wait_until_robots_know(operator, robots)


def _wait_until_robots_know(operator: Connection, robots: tuple[str, ...]) -> None:
    """A robot that still believes in the stop would refuse; it drops it with the manager's next messages."""
    operator.view.wait_for(
        lambda seen: all(
            robot in seen.presences and seen.presences[robot].estop_acknowledged is None for robot in robots
        ),
        CLEARED_TIMEOUT_S,
    )
