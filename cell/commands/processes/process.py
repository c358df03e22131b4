"""What the entry points of manager, agent and gateway have in common."""

import logging
import os
import threading
from collections.abc import Callable
from pathlib import Path

import typer

from cell.commands.access import require
from cell.commands.emergency.recipients import STORED, recipients_of, store
from cell.commands.processes.log_file import TEXT, JsonLog, log_by, log_to
from cell.commands.processes.state_dir import LOGS, Lock, make_folder, state_folder
from cell.commands.processes.stop import stop_event
from cell.config.settings import CellSettings
from cell.view.gate import Level

_LOG = logging.getLogger("cell")


def run_process(
    part: str,
    settings: CellSettings,
    state_dir: Path | None,
    parent_pipe: int | None,
    log_json: bool,
    body: Callable[[Path, threading.Event], int],
) -> None:
    """Run `body(state folder, stop event)` as the one process `part` of this cell on this host; exit with its code.

    It logs to stderr, and as a child of `cell up` to a file of its own in the state folder; with `log_json` one JSON
    object per line. Where the cell listens is kept there too, for an emergency stop.
    """
    require(Level.OPERATE, part)
    stop = stop_event(parent_pipe)
    folder = state_folder(settings.file, settings.name, state_dir)
    form = JsonLog(part) if log_json else TEXT
    if parent_pipe is None:
        log_by(logging.StreamHandler(), form)
    else:
        make_folder(folder / LOGS)
        log_to(folder / LOGS / f"{part}.log", form)
        _LOG.info("%s of cell %s starts as process %d", part, settings.name, os.getpid())
    # What python-can warns of (missing optional packages, buses that did not open) our own messages say better.
    logging.getLogger("can").setLevel(logging.ERROR)
    with Lock(folder, part):
        try:
            store(folder, recipients_of(settings))
        except OSError as error:
            _LOG.warning("%s is not written, `cell estop` will need the cell file: %s", folder / STORED, error)
        code = body(folder, stop)
    raise typer.Exit(code)
