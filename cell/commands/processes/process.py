"""What the entry points of manager, agent and gateway have in common."""

import logging
import os
import threading
from collections.abc import Callable
from logging.handlers import RotatingFileHandler
from pathlib import Path

import typer

from cell.commands.access import require
from cell.commands.emergency.reach import STORED, reach_of, store
from cell.commands.processes.json_log import JsonLog
from cell.commands.processes.state_dir import LOGS, Lock, make_folder, state_folder
from cell.commands.processes.stop import stop_event
from cell.config.settings import CellSettings
from cell.view.gate import Level

LOG_BYTES = 1_000_000
OLD_LOGS = 4
_FORMAT = "%(asctime)s %(levelname)s %(name)s: %(message)s"
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
    form = JsonLog(part) if log_json else logging.Formatter(_FORMAT)
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
            store(folder, reach_of(settings))
        except OSError as error:
            _LOG.warning("%s is not written, `cell estop` will need the cell file: %s", folder / STORED, error)
        code = body(folder, stop)
    raise typer.Exit(code)


def log_to(path: Path, form: logging.Formatter | None = None, most_bytes: int = LOG_BYTES) -> None:
    """Append the process' log, and all that it prints, to `path`; a full file becomes `path.1`, at most 4 are kept."""
    log_by(_LogFile(path, most_bytes), form or logging.Formatter(_FORMAT))


def log_by(handler: logging.Handler, form: logging.Formatter) -> None:
    """All that the process logs goes to `handler`."""
    handler.setFormatter(form)
    logging.basicConfig(level=logging.INFO, handlers=[handler])


class _LogFile(RotatingFileHandler):
    """A log that stdout and stderr go to as well: what is printed there, and the last words of a dying interpreter."""

    def __init__(self, path: Path, most_bytes: int) -> None:
        super().__init__(path, maxBytes=most_bytes, backupCount=OLD_LOGS, encoding="utf-8")
        self._take_over()

    def doRollover(self) -> None:
        super().doRollover()
        self._take_over()

    def _take_over(self) -> None:
        if self.stream is not None:
            for fd in (1, 2):
                os.dup2(self.stream.fileno(), fd)
