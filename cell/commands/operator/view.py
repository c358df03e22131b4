"""`cell view`: a page in the browser that shows a running cell, and lets an operator steer it."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cell.commands.client.cell_files import running_cell
from cell.commands.client.cell_view import POLL_S
from cell.commands.client.connection import TRY_S, Connection, ask_until_answered, client_session, connect
from cell.commands.emergency.answers import Answers
from cell.commands.emergency.door import Door, Stop
from cell.commands.emergency.words import operator_name
from cell.commands.errors import CommandError, not_installed
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
from cell.config.document import read_text
from cell.config.settings import CellSettings
from cell.messages import Command, Go, Heard, Jog, JogHeld, Reply
from cell.net.errors import CallError, Unreachable
from cell.net.session import new_call
from cell.view.desk import NoAnswer
from cell.view.gate import Gate, Level
from cell.view.rows import Axes
from cell.view.source import LiveSource

if TYPE_CHECKING:
    from cell.view.server import GatedServer

DOORS_OPEN_S = 8.0
"""So long a stop is repeated through every door."""
LOCAL = ("127.0.0.1", "localhost", "::1")


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
    with connect(file, endpoints, stop) as operator, page_server(host, port, highest) as server:
        from cell.view.page import Page

        desk = LiveDesk(operator, "by the page") if control is not None else None
        source = LiveSource(operator.session)
        settings = operator.settings
        Page(server, settings, source, axes_of(settings), desk, programs=programs_of(settings)).run(stop)


@contextmanager
def page_server(host: str, port: int, highest: Level) -> Iterator["GatedServer"]:
    """A server for a page, whose addresses up to a level are printed. Raises `CommandError` when there can be none."""
    try:
        from cell.view.server import GatedServer, PortTaken, Unguarded, listen
    except ImportError as error:
        raise not_installed("the page", "view", error) from error
    gate = Gate(_names(host), highest)
    try:
        listener = listen(host, port)
        server = GatedServer(gate, listener)
    except PortTaken as error:
        raise CommandError(str(error), "end that, or name another port: --port 0 takes a free one") from error
    except (OSError, Unguarded) as error:
        raise CommandError(f"the page cannot be served at {host}: {error}") from error
    try:
        _tell(gate, host, listener.getsockname()[1])
        yield server
    finally:
        server.stop()


def _names(host: str) -> tuple[str, ...]:
    """The names under which the page is told. Raises `CommandError` for an address that is every address."""
    if host in ("0.0.0.0", "::", "*", ""):
        raise CommandError(
            f"--host {host or '(empty)'} found, allowed is one address or name of this computer",
            "name the address of the network card by which it should be reached",
        )
    return LOCAL if host in LOCAL else (host, socket.gethostname())


def _tell(gate: Gate, host: str, port: int) -> None:
    shown = f"[{host}]" if ":" in host else host
    for level, token in gate.tokens.items():
        typer.echo(f"to {level.name.lower()}: http://{shown}:{port}/?token={token}")


def axes_of(settings: CellSettings) -> dict[str, Axes]:
    """The joints of each robot whose file can be read here; the page does without the others."""
    from robot_agent.kinematics import KinematicsError
    from robot_agent.workspace import PlacedRobot

    found = {}
    for name, robot in settings.robots.items():
        try:
            model = PlacedRobot.of(robot).model
        except (KinematicsError, OSError) as error:
            typer.echo(f"the axes of {name} are not shown: {error}", err=True)
            continue
        joints = tuple(model.joint_names)
        found[name] = Axes(joints, tuple(each in model.linear_names for each in joints))
    return found


def programs_of(settings: CellSettings) -> dict[str, tuple[str, ...]]:
    """The lines of each robot's program that can be read here."""
    texts = {name: read_text(robot.program) for name, robot in settings.robots.items() if robot.program is not None}
    return {name: tuple(text.splitlines()) for name, text in texts.items() if isinstance(text, str)}


class LiveDesk:
    """Orders to the running cell; any thread may give them."""

    def __init__(self, operator: Connection, by: str) -> None:
        """`by`: what the operator uses, for example "by the page"."""
        self._operator = operator
        self.operator = f"{operator_name()} {by}"

    def ask(self, to: str, command: Command, heard: Heard) -> Reply:
        """See `Desk`; what is worded by the files here is not sent to an agent that runs with others."""
        if isinstance(command, Jog | Go):
            try:
                self._operator.check_files(to, self._operator.presence(to.removeprefix("robot/")).digest)
            except CommandError as error:
                raise NoAnswer(f"{command.verb}: {error.what}; nothing was sent; {error.next_step}") from error
        patience_s = command.answer_within_s + TRY_S
        try:
            return ask_until_answered(
                self._operator.session, to, new_call(command, heard), patience_s, self._operator.stop
            )
        except CallError as error:
            raise NoAnswer(f"{command.verb}: {to} gave no usable answer: {error}; look what was done") from error

    def hold(self, message: JogHeld) -> None:
        """See `Desk`."""
        self._operator.session.publish(message)

    def stop_all(self) -> None:
        """See `Desk`: by the path of `cell estop`, which needs neither the manager nor this session."""
        settings = self._operator.settings
        endpoints = (settings.manager_endpoint, *(gateway.endpoint for gateway in settings.gateways.values()))
        stop, answers = Stop(self.operator, "operator"), Answers()
        doors = [Door(endpoint, (settings.name,), stop, answers, lambda: None) for endpoint in endpoints]
        for door in doors:
            timer = threading.Timer(DOORS_OPEN_S, door.close)
            timer.daemon = True
            timer.start()
