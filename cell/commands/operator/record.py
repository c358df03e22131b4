"""`cell record`: every message of a running cell, in a file."""

import sys
import threading
import time
from bisect import bisect_right
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cell.commands.client.cell_files import running_cell
from cell.commands.client.connection import reached
from cell.commands.client.recorded import SETTLE_S, hear_all, recorded
from cell.commands.errors import CommandError, not_installed, quoted
from cell.commands.options import CELL_FILE, CellFileOption, ConnectOption
from cell.commands.processes.stop import stop_event
from cell.config import ConfigError, load_cell
from cell.config.settings import CellSettings
from cell.core import Arrived
from cell.messages import STATES, ManagerState
from cell.net.inbox import Inbox
from cell.net.session import CellSession

if TYPE_CHECKING:
    from cell.recording.writer import Recording

TAKE_S = 0.05
FLUSH_S = 0.25
"""What is younger may be lost when the recorder is killed; with what is on its way that is less than a second."""
FIRST_S = 3.0
"""A cell that runs is heard by then."""
SILENT_S = 2.0
_WAITING = 50_000
_ANSWER_S = 1.0


def record(
    output: Annotated[
        Path, typer.Argument(metavar="OUT.mcap", help="The new file; Foxglove opens it.", show_default=False)
    ],
    seconds: Annotated[
        float | None,
        typer.Option(
            "--for", metavar="SECONDS", min=0.1, help="End by itself. [default: at Ctrl-C]", show_default=False
        ),
    ] = None,
    file: CellFileOption = Path(CELL_FILE),
    endpoint: ConnectOption = None,
) -> None:
    """Record every message of the running cell, until Ctrl-C, with the cell's files and a layout for Foxglove.

    A recorder that is killed loses less than a second. `cell replay` and `cell report` read the file.
    """
    try:
        from cell.recording.errors import RecordingError
        from cell.recording.writer import SUFFIX, Recording
    except ImportError as error:
        raise not_installed("cell record", "record", error) from error
    if output.suffix != SUFFIX:
        raise CommandError(f"{output}: what is recorded is a file {SUFFIX}", f"name it {output.stem}{SUFFIX}")
    stop = stop_event()
    settings = running_cell(file)
    with reached(settings, file, endpoint) as session, reached(settings, file, endpoint) as bulk:
        heard = Inbox(session.decoder, _WAITING)
        hear_all(session, bulk, heard.store)
        first = _first(settings, session, heard, stop)
        try:
            with Recording(output, recorded(settings), time.time()) as recording:
                _tell_files(settings, recording, first)
                began = time.monotonic()
                _record(recording, heard, first, stop, None if seconds is None else began + seconds)
        except RecordingError as error:
            raise CommandError(str(error)) from error
        size = output.stat().st_size / 1e6
        print(f"{output}: {recording.messages} messages in {time.monotonic() - began:.1f} s, {size:.1f} MB")
        if heard.dropped:
            _say(f"{heard.dropped} messages were lost: this computer is too busy to write them")


def _first(settings: CellSettings, session: CellSession, heard: Inbox, stop: threading.Event) -> list[Arrived]:
    """What is heard first, and what is told only on request. Raises `CommandError` when that is nothing."""
    deadline = time.monotonic() + FIRST_S
    while not (arrived := _states(heard)) and time.monotonic() < deadline and not stop.wait(TAKE_S):
        pass
    if not arrived:
        raise CommandError(
            f"nothing is heard of cell {settings.name}, although somebody answers there",
            f"see who that is: cell status -f {quoted(settings.file)}; or name another endpoint with -e",
        )
    now = time.monotonic()
    told = [*session.last("frame/*", _ANSWER_S), *session.last("zone/*", _ANSWER_S)]
    return [*(Arrived(message, now) for message in told), *arrived]


def _states(heard: Inbox) -> list[Arrived]:
    return [each for each in heard.take_arrived() if type(each.message) in STATES]


def _record(
    recording: "Recording",
    heard: Inbox,
    first: list[Arrived],
    stop: threading.Event,
    until: float | None,
) -> None:
    wall = time.time() - time.monotonic()
    waiting, newest, silent = first, time.monotonic(), False
    flush_due = newest
    while True:
        ends = stop.is_set() or (until is not None and time.monotonic() >= until)
        waiting.sort(key=lambda arrived: arrived.at)
        settled = len(waiting) if ends else bisect_right(waiting, time.monotonic() - SETTLE_S, key=lambda one: one.at)
        for each in waiting[:settled]:
            recording.add(each.message, wall + each.at)
            newest = max(newest, each.at)
        del waiting[:settled]
        now = time.monotonic()
        if now >= flush_due:
            recording.flush()
            flush_due = now + FLUSH_S
        if silent != (now - newest > SILENT_S):
            silent = not silent
            cell = f"cell {recording.cell.settings.name}"
            _say(f"{cell} is silent; waiting for it, Ctrl-C ends the recording" if silent else f"{cell} is heard again")
        if ends:
            return
        stop.wait(TAKE_S)
        waiting += _states(heard)


def _tell_files(settings: CellSettings, recording: "Recording", first: list[Arrived]) -> None:
    """Say where it is, and whether the files that are recorded are those of the running cell."""
    print(f"recording cell {settings.name} to {recording.path}; Ctrl-C ends it", flush=True)
    for path, why in recording.cell.missing.items():
        _say(f"{path} is not in the recording: {why}")
    digest = next((each.message.digest for each in first if isinstance(each.message, ManagerState)), None)
    try:
        own = load_cell(settings.file).digest
    except ConfigError:
        own = ""
    if digest is not None and digest != own:
        _say(f"the cell runs with other files than those of {settings.file}, which are in the recording")


def _say(text: str) -> None:
    print(f"cell record: {text}", file=sys.stderr, flush=True)
