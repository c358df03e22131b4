"""`cell estop`: the software emergency stop of a whole cell, with or without a manager."""

import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.connection import client_session, operator_name, running_cell
from cell.commands.errors import CommandError
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption
from cell.commands.view import CellView, names
from cell.config import ConfigError
from cell.config.settings import CellSettings
from cell.messages import Estop, SetEstop
from cell.net.errors import CallError, Unreachable
from cell.net.session import CellSession, new_call

CONFIRM_S = 3.0
PERIOD_S = 0.05
REMINDER = "This is a software stop: it supports and never replaces a hard-wired emergency stop."


def estop(
    reason: Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why, for the others.")] = "operator",
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Stop every robot of the cell on its path and switch its drives off; only `cell reset` clears it.

    Works with and without a running manager. It supports and never replaces a hard-wired emergency stop.
    """
    try:
        settings = running_cell(file)
    except (CommandError, ConfigError) as error:
        text = error.what if isinstance(error, CommandError) else f"the cell file is refused:\n  {error}"
        raise CommandError(f"no emergency stop was sent: {text}", "use the hard-wired emergency stop") from error
    stop = Estop(id=uuid.uuid4().hex, active=True, by=operator_name(), reason=reason)
    with _doors(settings, endpoint) as sessions:
        if not sessions:
            raise CommandError(
                f"nobody of cell {settings.name} answers: {names(_endpoints(settings, endpoint))}",
                "use the hard-wired emergency stop",
            )
        missing = _repeat_until_confirmed(settings, sessions, stop)
    typer.echo(REMINDER)
    if missing:
        raise CommandError(
            f"not confirmed within {CONFIRM_S:.0f} s by: {names(missing)}",
            f"use the hard-wired emergency stop, then look with: cell status -f {file}",
        )
    typer.echo(f"When the cause is gone: cell reset -f {file}")


def _endpoints(settings: CellSettings, endpoints: list[str] | None) -> tuple[str, ...]:
    gateways = tuple(gateway.endpoint for gateway in settings.gateways.values())
    return tuple(dict.fromkeys((*(endpoints or (settings.manager_endpoint,)), *gateways)))


@contextmanager
def _doors(settings: CellSettings, endpoints: list[str] | None) -> Iterator[list[CellSession]]:
    """A client session through each endpoint that answers: one dead process must not keep the stop from the others."""
    with ExitStack() as stack:
        sessions: list[CellSession] = []
        for endpoint in _endpoints(settings, endpoints):
            try:
                sessions.append(stack.enter_context(client_session(settings, (endpoint,))))
            except Unreachable:
                typer.echo(f"nobody answers at {endpoint}", err=True)
        yield sessions


def _repeat_until_confirmed(settings: CellSettings, sessions: list[CellSession], stop: Estop) -> list[str]:
    """Send the stop until everyone has confirmed it or the time is up; return who has not."""
    views = [CellView(session, settings) for session in sessions]
    pause = threading.Event()
    deadline = time.monotonic() + CONFIRM_S
    told_manager = threading.Thread(target=_tell_manager, args=(sessions[0], stop), daemon=True)
    told_manager.start()
    open_ = {f"robot {robot}" for robot in settings.robots} | {f"gateway {gateway}" for gateway in settings.gateways}
    while open_ and time.monotonic() < deadline:
        for session in sessions:
            session.publish(stop)
        pause.wait(PERIOD_S)
        for view in views:
            seen = view.look()
            done = {f"robot {r}" for r, m in seen.presences.items() if m.estop_acknowledged is not None}
            done |= {f"gateway {g}" for g, m in seen.gateways.items() if m.estop_confirmed is not None}
            for who in sorted(done & open_):
                typer.echo(f"confirmed: {who}")
            open_ -= done
    told_manager.join(CONFIRM_S)
    return sorted(open_)


def _tell_manager(session: CellSession, stop: Estop) -> None:
    """Let the manager latch the stop, so that late-comers hear of it; it also hears it as a message."""
    call = new_call(SetEstop(id=stop.id, by=stop.by, reason=stop.reason))
    try:
        typer.echo(f"manager: {session.ask('manager', call, CONFIRM_S).text}")
    except CallError as error:
        typer.echo(f"the manager does not confirm ({error}); robots and gateways hear the stop directly", err=True)
