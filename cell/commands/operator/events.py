"""`cell events`: what happened in a cell, as its manager has kept it."""

import re
import sqlite3
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer

from cell.commands.client.cell_files import running_cell
from cell.commands.client.cell_view import names
from cell.commands.client.connection import client_session
from cell.commands.client.json_lines import json_line
from cell.commands.errors import CommandError, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption, JsonOption, StateDirOption
from cell.commands.processes.state_dir import state_path
from cell.commands.processes.stop import stop_event
from cell.config.settings import CellSettings
from cell.manager.event_store import EVENTS_FILE, PAGE, EventStore
from cell.messages import Event, KeptEvent, KeptEvents, ListEvents, Severity
from cell.net.codec import decode
from cell.net.errors import CallError, CodecError, Unreachable
from cell.net.session import CellSession, new_call

SHOWN = 50
ANSWER_S = 2.0
FOLLOW_S = 0.3
_UNITS_S = {"s": 1.0, "m": 60.0, "h": 3600.0, "d": 86400.0}
_AGO = re.compile(r"(\d+(?:\.\d+)?)([smhd])")
_SEVERITIES = tuple(Severity)

Ask = Callable[[ListEvents], KeptEvents]


class NoLog(Exception):
    """Nobody tells the events now; the text says why."""


def events(
    limit: Annotated[
        int | None,
        typer.Option(
            "-n",
            "--limit",
            min=1,
            metavar="N",
            help=f"The last N. [default: {SHOWN}; all with --since]",
            show_default=False,
        ),
    ] = None,
    follow: Annotated[bool, typer.Option("--follow", help="Then show new ones as they come, until Ctrl-C.")] = False,
    since: Annotated[
        str | None,
        typer.Option(
            metavar="WHEN", help="Since 30s, 10m, 2h or 3d ago, or a time as 2026-01-31T14:05 (here) or ...Z (UTC)."
        ),
    ] = None,
    severity: Annotated[Severity, typer.Option(help="So severe or more.")] = Severity.INFO,
    as_json: JsonOption = False,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
    state_dir: StateDirOption = None,
) -> None:
    """Show the events and alarms of a cell, oldest first, with the time (UTC) at which the manager heard them.

    When no manager answers, what it has kept is read from the state folder, if that is on this computer.
    """
    settings = running_cell(file)
    begin = None if since is None else moment(since, time.time())
    asked = ListEvents(since=begin, severity=severity)
    if limit is None and since is None:
        limit = SHOWN
    show = _Show(severity, as_json)
    with ExitStack() as stack:
        manager = _Manager(settings, endpoint, stack)
        try:
            newest = show.all(*fetch(manager.ask, asked, limit))
        except NoLog as error:
            path = state_path(settings.file, settings.name, state_dir) / EVENTS_FILE
            if endpoint or not path.is_file():
                raise CommandError(str(error), f"start the manager with: cell manager {quoted(file)}") from error
            _say(f"{error}; these events are from {path}")
            newest = show.all(*fetch(lambda page: _read(path, page), asked, limit))
        if follow:
            _follow(manager.ask, ListEvents(severity=severity), newest, show)


def moment(text: str, now: float) -> float:
    """Seconds since 1970 (UTC) of what `--since` says. Raises `CommandError`."""
    if ago := _AGO.fullmatch(text):
        return max(0.0, now - float(ago[1]) * _UNITS_S[ago[2]])
    try:
        return max(0.0, datetime.fromisoformat(text).timestamp())
    except (ValueError, OverflowError, OSError) as error:
        raise CommandError(
            f"--since {text!r} is no time; allowed are 30s, 10m, 2h, 3d ago, and times as 2026-01-31T14:05 (of this "
            "computer) or 2026-01-31T13:05:00Z"
        ) from error


def fetch(ask: Ask, asked: ListEvents, limit: int | None = None) -> tuple[list[KeptEvent], KeptEvents]:
    """The newest `limit` events that fit, oldest first, page by page from the newest; and the newest page."""
    found: list[KeptEvent] = []
    newest: KeptEvents | None = None
    while True:
        most = PAGE if limit is None else min(PAGE, limit - len(found))
        before = found[0].number if found else None
        page = ask(replace(asked, before=before, limit=most))
        found = [*page.events, *found]
        newest = newest or page
        if len(page.events) < most or len(found) == limit:
            return found, newest


class _Manager:
    """The manager of a cell, asked through a session that is opened as soon as that is possible."""

    def __init__(self, settings: CellSettings, endpoints: list[str] | None, stack: ExitStack) -> None:
        self._settings = settings
        self._endpoints = tuple(endpoints) if endpoints else (settings.manager_endpoint,)
        self._stack = stack
        self._session: CellSession | None = None

    def ask(self, asked: ListEvents) -> KeptEvents:
        """Raises `NoLog`."""
        try:
            if self._session is None:
                self._session = self._stack.enter_context(client_session(self._settings, self._endpoints))
            reply = self._session.ask("manager", new_call(asked), ANSWER_S)
        except (Unreachable, CallError) as error:
            raise NoLog(f"no manager of cell {self._settings.name} answers at {names(self._endpoints)}") from error
        if not reply.ok:
            raise NoLog(f"the manager of cell {self._settings.name} cannot tell its events: {reply.text}")
        try:
            return decode(KeptEvents, reply.data.encode())
        except CodecError as error:
            raise NoLog(f"the manager of cell {self._settings.name} is of another version: {error}") from error


def _read(path: Path, asked: ListEvents) -> KeptEvents:
    try:
        with EventStore(path, existing=True) as store:
            return store.read(asked)
    except sqlite3.Error as error:
        raise CommandError(
            f"the events in {path} cannot be read: {error}",
            "start the manager, which keeps the file: cell manager FILE",
        ) from error


def _follow(ask: Ask, asked: ListEvents, newest: int, show: "_Show") -> None:
    """Show what is stored after `newest`, until Ctrl-C."""
    stop = stop_event()
    silent = False
    while not stop.wait(FOLLOW_S):
        try:
            found, page = fetch(ask, ListEvents(newest, severity=asked.severity))
            if page.newest < newest:
                _say("the manager has begun a new file of events")
                found, page = fetch(ask, asked)
        except NoLog as error:
            if not silent:
                _say(f"{error}; events are not kept meanwhile")
            silent = True
            continue
        if silent:
            _say("the manager answers again")
        silent = False
        newest = show.all(found, page)


class _Show:
    """Prints events, and once what keeps the manager from storing them."""

    def __init__(self, severity: Severity, as_json: bool) -> None:
        self._severity = severity
        self._as_json = as_json
        self._problem = ""

    def all(self, found: list[KeptEvent], page: KeptEvents) -> int:
        """Print them; the number of the newest event that is stored."""
        for kept in found:
            for line in [json_line("event", kept.event.source, kept)] if self._as_json else lines(kept, self._severity):
                typer.echo(line)
        sys.stdout.flush()
        if page.problem and page.problem != self._problem:
            _say(page.problem)
        self._problem = page.problem
        return max([page.newest, *(kept.number for kept in found)])


def lines(kept: KeptEvent, severity: Severity) -> list[str]:
    """An event for people, and how many of its source were lost before it; not the event when it is less severe."""
    event = kept.event
    told = [f"{kept.at} {lost_text(kept.lost, event)}"] if kept.lost else []
    if _SEVERITIES.index(event.severity) >= _SEVERITIES.index(severity):
        remedy = f"; {event.remedy}" if event.remedy else ""
        told.append(f"{kept.at} {event.severity.value}: {event.source}: {event.text}{remedy} [{event.code}]")
    return told


def lost_text(lost: int, event: Event) -> str:
    return f"{lost} event{'s' if lost > 1 else ''} of {event.source} {'were' if lost > 1 else 'was'} lost"


def _say(text: str) -> None:
    print(f"cell events: {text}", file=sys.stderr, flush=True)
