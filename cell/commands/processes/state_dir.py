"""The folder in which the processes of a cell keep what must outlive them, and the locks on it."""

import fcntl
import os
from pathlib import Path
from types import TracebackType

from cell.commands.errors import CommandError, keep_tracebacks_in

RECORDINGS = "recordings"
"""The folder below it with what happened before each alarm."""
LOGS = "log"
"""The folder below it in which each child of `cell up` has its log."""


def state_path(cell_file: Path, cell: str, chosen: Path | None) -> Path:
    """The state folder of a cell: `chosen`, or `.zencell/<cell>/` beside the cell file."""
    return chosen if chosen is not None else cell_file.parent / ".zencell" / cell


def state_folder(cell_file: Path, cell: str, chosen: Path | None) -> Path:
    """`state_path`, made when it is missing."""
    folder = state_path(cell_file, cell, chosen)
    make_folder(folder)
    keep_tracebacks_in(folder)
    return folder


def make_folder(folder: Path) -> None:
    """Make a folder for what must be kept, when it is missing. Raises `CommandError`."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unusable(folder, error) from error


def _unusable(path: Path, error: OSError) -> CommandError:
    what = "it is a file, not a folder" if isinstance(error, FileExistsError) else error.strerror
    return CommandError(
        f"{path} cannot be used to keep the state of the cell: {what}",
        "make room there, or name a folder that you may write to with --state-dir",
    )


class Lock:
    """An exclusive lock on one part of a state folder, held until `close` or the end of the process.

    Raises `CommandError` that names the process which holds it, or says why the folder cannot be used.
    """

    def __init__(self, folder: Path, part: str) -> None:
        path = folder / f"{part}.lock"
        try:
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
        except OSError as error:
            raise _unusable(path, error) from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(self._file, 0)
            os.pwrite(self._file, f"process {os.getpid()}\n".encode(), 0)
        except BlockingIOError as error:
            holder = os.pread(self._file, 100, 0).decode(errors="replace").strip()
            self.close()
            raise CommandError(
                f"{part} is already running with the state folder {folder} ({holder or 'unknown process'})",
                "stop it first, or give this one another folder with --state-dir",
            ) from error
        except OSError as error:
            self.close()
            raise _unusable(path, error) from error

    def close(self) -> None:
        os.close(self._file)

    def __enter__(self) -> "Lock":
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self.close()
