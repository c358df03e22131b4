"""What the entry points of manager, agent and gateway have in common."""

import logging
import threading
from collections.abc import Callable
from pathlib import Path

import typer

from cell.commands.emergency.reach import STORED, reach_of, store
from cell.commands.state_dir import Lock, state_folder
from cell.commands.stop import stop_event
from cell.config.settings import CellSettings

_LOG = logging.getLogger("cell")


def run_process(
    part: str,
    settings: CellSettings,
    state_dir: Path | None,
    parent_pipe: int | None,
    body: Callable[[Path, threading.Event], int],
) -> None:
    """Run `body(state folder, stop event)` as the one process `part` of this cell on this host; exit with its code.

    Where the cell listens is kept in the folder, for an emergency stop.
    """
    logging.basicConfig(level=logging.INFO, format="%(asctime)s %(levelname)s %(name)s: %(message)s")
    # What python-can warns of (missing optional packages, buses that did not open) our own messages say better.
    logging.getLogger("can").setLevel(logging.ERROR)
    stop = stop_event(parent_pipe)
    folder = state_folder(settings.file, settings.name, state_dir)
    with Lock(folder, part):
        try:
            store(folder, reach_of(settings))
        except OSError as error:
            _LOG.warning("%s is not written, `cell estop` will need the cell file: %s", folder / STORED, error)
        code = body(folder, stop)
    raise typer.Exit(code)
