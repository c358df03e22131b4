"""The folder in which the processes of a cell keep what must outlive them, and the locks on it."""

import fcntl
import os
from pathlib import Path
from types import TracebackType
from typing import TextIO

from cell.commands.errors import CommandError, keep_tracebacks_in


def state_folder(cell_file: Path, cell: str, chosen: Path | None) -> Path:
    """The state folder of a cell: `chosen`, or `.zencell/<cell>/` beside the cell file; made when missing."""
    folder = chosen if chosen is not None else cell_file.parent / ".zencell" / cell
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise CommandError(
            f"state folder {folder}: {error.strerror}", "name a folder you may write to with --state-dir"
        ) from error
    keep_tracebacks_in(folder)
    return folder


class Lock:
    """An exclusive lock on one part of a state folder, held until `close` or the end of the process.

    Raises `CommandError` that names the process which holds it.
    """

    def __init__(self, folder: Path, part: str) -> None:
        path = folder / f"{part}.lock"
        self._file: TextIO = path.open("a+", encoding="utf-8")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            self._file.seek(0)
            holder = self._file.read().strip()
            self._file.close()
            raise CommandError(
                f"{part} is already running with the state folder {folder} ({holder or 'unknown process'})",
                "stop it first, or give this one another folder with --state-dir",
            ) from error
        self._file.truncate(0)
        self._file.write(f"process {os.getpid()}\n")
        self._file.flush()

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> "Lock":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self.close()
