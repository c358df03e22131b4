"""`cell status`: the state of a running cell, once."""

from pathlib import Path

import typer
from rich.console import Console

from cell.commands.client.cell_view import Snapshot, names
from cell.commands.client.connection import connect
from cell.commands.client.state_table import cell_table
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption
from cell.config.settings import CellSettings
from cell.messages import Mode

NO_TERMINAL_WIDTH = 10_000
"""What is read by programs is not wrapped."""
STOPPED, FAULTY = 3, 4
"""Exit codes."""


def status(file: CellFileOption = Path(CELL_FILE), endpoint: ConnectOption = None) -> None:
    """Show every robot, zone and gateway of the running cell once.

    Exit 1 when one of them is silent, else 3 under an emergency stop, else 4 when a robot is in a fault.
    """
    with connect(file, endpoint) as operator:
        seen = operator.snapshot()
        console = Console()
        width = console.width if console.is_terminal else NO_TERMINAL_WIDTH
        console.print(cell_table(operator.settings, seen, width), soft_wrap=not console.is_terminal)
        silent = _silent(operator.settings, seen, operator.file)
        if silent:
            raise CommandError(f"silent: {names(silent)}", f"start again what has died: {'; '.join(silent.values())}")
        if code := exit_code(seen):
            raise typer.Exit(code)


def exit_code(seen: Snapshot) -> int:
    """The exit code that tells of an emergency stop or a fault; 0 without."""
    estops = seen.manager.estops if seen.manager is not None else ()
    if estops or any(state.mode is Mode.ESTOP for state in seen.robots.values()):
        return STOPPED
    return FAULTY if any(state.mode is Mode.FAULT for state in seen.robots.values()) else 0


def _silent(settings: CellSettings, seen: Snapshot, file: Path) -> dict[str, str]:
    """Who does not answer, and the command that starts it."""
    silent = {} if seen.manager is not None else {"the manager": f"cell manager {quoted(file)}"}
    for gateway in settings.gateways:
        if gateway not in seen.gateways:
            silent[f"gateway {gateway}"] = (
                f"drive-gateway run {quoted(file)} {gateway} (with --simulate for simulated drives)"
            )
    for robot in settings.robots:
        if robot not in seen.robots:
            silent[f"robot {robot}"] = f"robot-agent {quoted(file)} {robot}"
    return silent
