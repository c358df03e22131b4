"""What commands that read a recording have in common."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cell.commands.errors import CommandError, not_installed

if TYPE_CHECKING:
    from cell.recording.reader import Recorded

RecordingArgument = Annotated[
    Path, typer.Argument(metavar="FILE.mcap", help="A recording of `cell record` or `cell up`.", show_default=False)
]


@contextmanager
def opened(path: Path, command: str) -> Iterator["Recorded"]:
    """A recording; whatever is wrong with it, now or while it is read, becomes a `CommandError`."""
    try:
        from cell.recording.errors import RecordingError
        from cell.recording.reader import Recorded
    except ImportError as error:
        raise not_installed(command, "record", error) from error
    try:
        yield Recorded(path)
    except RecordingError as error:
        raise CommandError(str(error)) from error
