"""`cell view`: a page in the browser that shows a running cell, and lets an operator steer it."""

import threading
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_files import running_cell
from cell.commands.client.cell_view import POLL_S
from cell.commands.client.connection import client_session, connect
from cell.commands.client.live_desk import LiveDesk
from cell.commands.client.page_server import axes_of, meshes_of, page_server, programs_of
from cell.commands.options import (
    CELL_FILE,
    PORT,
    CellFileOption,
    ConnectOption,
    Control,
    ControlOption,
    ParentPipeOption,
    PortOption,
)
from cell.commands.processes.stop import stop_event
from cell.net.errors import Unreachable
from cell.view.gate import Level
from cell.view.source import LiveSource

HostOption = Annotated[
    str,
    typer.Option("--host", metavar="ADDRESS", help="Listen at this address of this computer, instead of to it alone."),
]


def view(
    control: ControlOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = PORT,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
    parent_pipe: ParentPipeOption = None,
) -> None:
    """Show the running cell in a browser, until Ctrl-C: where robots are, what they wait for, what to do next.

    Open the address that is printed; its token lets nobody else in. Steering is off without --control, and one browser
    at a time has it. What crosses a network is not encrypted: from elsewhere use an SSH tunnel.
    """
    stop = stop_event(parent_pipe)
    if parent_pipe is not None:
        _wait_for_cell(file, stop)
    if not stop.is_set():
        show(file, endpoint, control, host, port, stop)


def _wait_for_cell(file: Path, stop: threading.Event) -> None:
    """Who starts this process starts the manager as well, which takes its time."""
    settings = running_cell(file)
    while not stop.wait(POLL_S):
        with suppress(Unreachable), client_session(settings, (settings.manager_endpoint,)):
            return


def show(
    file: Path,
    endpoints: list[str] | None,
    control: Control | None,
    host: str,
    port: int,
    stop: threading.Event,
) -> None:
    """Serve the page until `stop`. Raises `CommandError` when it cannot be."""
    highest = Level[control.name] if control is not None else Level.WATCH
    with (
        connect(file, endpoints, stop) as operator,
        LiveDesk(operator, "by the page", endpoints or ()) as desk,
        page_server(host, port, highest) as server,
    ):
        from cell.view.page import Page

        source, settings = LiveSource(operator.session), operator.settings
        page_desk = desk if control is not None else None
        axes, programs = axes_of(settings), programs_of(settings)
        meshes = meshes_of(settings, axes)
        Page(server, settings, source, axes, page_desk, programs=programs, meshes=meshes).run(stop)
