"""`cell status`: the state of a running cell, once."""

from pathlib import Path

from rich.console import Console

from cell.commands.connection import connect
from cell.commands.errors import CommandError
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption
from cell.commands.table import cell_table
from cell.commands.view import names


def status(file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Show every robot, zone and gateway of the running cell once; exit 1 when one of them is silent."""
    with connect(file, endpoint) as operator:
        seen = operator.snapshot()
        Console().print(cell_table(operator.settings, seen))
        silent = [f"robot {robot}" for robot in operator.settings.robots if robot not in seen.robots]
        silent += [f"gateway {gateway}" for gateway in operator.settings.gateways if gateway not in seen.gateways]
        if seen.manager is None:
            silent.append("the manager")
        if silent:
            raise CommandError(
                f"silent: {names(silent)}",
                f"start what is missing with cell manager {file}, drive-gateway run {file} GATEWAY, "
                f"or robot-agent {file} ROBOT",
            )
