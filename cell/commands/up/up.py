"""`cell up`: start every process of a cell on this host, show it, and end it in order."""

import threading
from typing import Annotated

import typer
from rich.console import Console

from cell.commands.client.cell_files import checked_cell
from cell.commands.client.cell_view import names
from cell.commands.errors import CommandError, quoted
from cell.commands.options import (
    PORT,
    CellFileArgument,
    Control,
    ControlOption,
    LogJsonOption,
    PortOption,
    StateDirOption,
)
from cell.commands.processes.state_dir import LOGS, RECORDINGS, Lock, make_folder, state_folder
from cell.commands.processes.stop import stop_event
from cell.commands.up.children import Children, page_program, programs
from cell.commands.up.endpoints import refuse_taken
from cell.commands.up.supervisor import Supervisor

INTERRUPTED = 130
"""Exit code, by the shells' convention, of a run that was broken off by Ctrl-C."""


def up(
    file: CellFileArgument,
    until_done: Annotated[
        bool, typer.Option("--until-done", help="Run all programs, then stop in order; exit 0 when all of them ended.")
    ] = False,
    run: Annotated[bool, typer.Option("--run", help="Run all programs, and stay.")] = False,
    view: Annotated[
        bool, typer.Option("--view", help="Serve a page for the browser, too: its address is printed.")
    ] = False,
    control: ControlOption = None,
    port: PortOption = PORT,
    real: Annotated[bool, typer.Option("--real", help="Without simulated drives: this moves the machines.")] = False,
    state_dir: StateDirOption = None,
    log_json: LogJsonOption = False,
) -> None:
    """Start a cell on this host: its manager, its gateways with simulated drives, and an agent per robot.

    All robots are enabled; their programs start with `cell run ROBOT`, or at once with `--run` or `--until-done`.
    Ctrl-C brakes every robot on its path, then switches the drives off and ends the processes in order. Nothing that
    dies is started again by itself. The exit code is 0 only when everything ended in order.
    """
    if control is not None and not view:
        raise CommandError(
            "--control without --view", f"add it: cell up {quoted(file)} --view --control {control.value}"
        )
    settings = checked_cell(file)
    hurry = threading.Event()
    stop = stop_event(hurry=hurry)
    folder = state_folder(settings.file, settings.name, state_dir)
    logs = folder / LOGS
    make_folder(logs)
    console = Console()

    def say(text: str) -> None:
        console.print(text, markup=False, highlight=False, soft_wrap=True)

    with Lock(folder, "cell-up"):
        refuse_taken(settings)
        wanted = programs(settings, state_dir, not real, log_json)
        if view:
            wanted.append(page_program(settings, _page_words(control, port)))
        with Children(wanted, logs, hurry, say) as children:
            supervisor = Supervisor(settings, children, console, stop, hurry, folder / RECORDINGS)
            done = supervisor.run(start_programs=run or until_done, until_done=until_done)
    if parts := children.out_of_order():
        raise CommandError(
            f"not in order, died or killed: {names(parts)}",
            f"look at what was said above and in {logs}; what was started again by hand runs on: end it where it runs",
        )
    if until_done and not done:
        raise typer.Exit(INTERRUPTED if stop.is_set() else 1)


def _page_words(control: Control | None, port: int) -> tuple[str, ...]:
    return ("--port", str(port), *(() if control is None else ("--control", control.value)))
