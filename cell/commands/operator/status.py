"""`cell status`: the state of a running cell."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from cell.commands.client.cell_view import POLL_S, Snapshot, names
from cell.commands.client.connection import Connection, connect
from cell.commands.client.display import Show
from cell.commands.client.json_lines import status_lines
from cell.commands.client.state_table import cell_table
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, JsonOption
from cell.commands.processes.stop import stop_event
from cell.config.settings import CellSettings
from cell.messages import Mode

NO_TERMINAL_WIDTH = 10_000
"""What is read by programs is not wrapped."""
AGAIN_S = 1.0
"""How often `--watch --json` tells everything."""
STOPPED, FAULTY = 3, 4
"""Exit codes."""


def status(
    as_json: JsonOption = False,
    watch: Annotated[bool, typer.Option("--watch", help="Go on, until Ctrl-C.")] = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Show every robot, zone and gateway of the running cell: once, or with `--watch` as they change.

    Exit 1 when one of them is silent, else 3 under an emergency stop, else 4 when a robot is in a fault; after
    `--watch` as it was at the end.
    """
    with connect(file, endpoint) as operator:
        show = _json if as_json else _table
        seen = _watch(operator, as_json) if watch else show(operator.settings, operator.snapshot())
        silent = _silent(operator.settings, seen, operator.file)
        if silent:
            raise CommandError(
                f"silent: {names(silent)}",
                f"see whether they run; start again what has died: {'; '.join(silent.values())}",
            )
        if code := exit_code(seen):
            raise typer.Exit(code)


def _table(settings: CellSettings, seen: Snapshot) -> Snapshot:
    console = Console()
    width = console.width if console.is_terminal else NO_TERMINAL_WIDTH
    console.print(cell_table(settings, seen, width), soft_wrap=not console.is_terminal)
    return seen


def _json(settings: CellSettings, seen: Snapshot) -> Snapshot:
    print(*status_lines(settings, seen), sep="\n", flush=True)
    return seen


def _watch(operator: Connection, as_json: bool) -> Snapshot:
    """Show the cell until Ctrl-C: a live table, a line per change where there is no terminal, or all each second."""
    stop = stop_event()
    seen = operator.snapshot()
    if as_json:
        _json(operator.settings, seen)
        while not stop.wait(AGAIN_S):
            _json(operator.settings, seen := operator.view.look())
        return seen
    with Show(operator.settings, Console()) as shown:
        while not stop.wait(POLL_S):
            shown.update(seen := operator.view.look())
    return seen


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
