"""`cell reset`: clear the emergency stop and acknowledge faults; nothing moves by it."""

from pathlib import Path
from typing import Annotated

import typer

from cell.commands.connection import Operator, connect, report
from cell.commands.emergency.words import operator_name
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
    """Clear the cell's emergency stop, then acknowledge the faults of all robots, or of the named ones.

    Nothing moves and no drive is switched on: that takes `cell enable` and `cell run` or `cell continue`.
    """
    with connect(file, endpoint) as operator:
        for robot in robots or ():
            operator.check_robot(robot)
        report("manager", operator.ask_manager(ResetEstop(by=operator_name())))
        chosen = tuple(robots or operator.settings.robots)
        _wait_until_robots_know(operator, chosen)
        for robot in chosen:
            report(robot, operator.ask_robot(robot, ResetRobot()))


def _wait_until_robots_know(operator: Operator, robots: tuple[str, ...]) -> None:
    """A robot that still believes in the stop would refuse; it drops it with the manager's next messages."""
    operator.view.wait_for(
        lambda seen: all(
            robot in seen.presences and seen.presences[robot].estop_acknowledged is None for robot in robots
        ),
        CLEARED_TIMEOUT_S,
    )
