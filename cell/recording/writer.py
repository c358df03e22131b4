"""A recording that is being written: an MCAP file of which all that was flushed can be read, however its writer ends.

On one topic per key of the cell lies each message whole, as JSON (`json_form`); beside them the same in the schemas
that Foxglove draws (`scene`). The cell's files and a layout are attachments; who recorded is in the metadata `zencell`.
"""

import os
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from functools import partial
from importlib.metadata import version
from io import RawIOBase
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, Self

from foxglove import Channel, Context, Schema, open_mcap
from foxglove.mcap import MCAPWriteOptions

from cell.messages import STATES
from cell.recording.cell_files import RecordedCell
from cell.recording.errors import RecordingError
from cell.recording.json_form import schema_of, to_json
from cell.recording.layout import LAYOUT, layout_of
from cell.recording.scene import Drawn, Scene

METADATA = "zencell"
SUFFIX = ".mcap"


class Recording:
    """A context manager around a new file. `begun_at` is when it begins, seconds since 1970 (UTC)."""

    def __init__(self, path: Path, cell: RecordedCell, begun_at: float) -> None:
        """Raises `RecordingError` where no file can be made, and for one that is there already."""
        self.path = path
        self.cell = cell
        self.messages = 0
        self._scene = Scene(cell)
        self._channels: dict[str, Channel] = {}
        self._context = Context()
        try:
            self._file = _File(path.open("xb"))
        except OSError as error:
            raise RecordingError(f"{path} cannot be recorded to: {_why(error)}") from error
        options = MCAPWriteOptions(profile="", compression_threads=0)
        self._writer = open_mcap(self._file, context=self._context, writer_options=options)
        try:
            self._tell_cell(cell, begun_at)
            self._draw(self._scene.begin(begun_at), begun_at)
            self.flush()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, message: object, at: float) -> None:
        """Record a state message that was heard at `at`, seconds since 1970 (UTC). Raises `RecordingError`."""
        kind: Any = type(message)
        self._log(f"/{STATES[kind].key_of(message)}", partial(schema_of, kind), to_json(message), at)
        self._draw(self._scene.of(message, at), at)
        self.messages += 1

    def flush(self) -> None:
        """Hand all that was recorded to the operating system: what was not may be lost, so do it each second.

        Raises `RecordingError` where there is no room.
        """
        self._writer.flush()
        self._file.flush()
        self._check()

    def close(self) -> None:
        """End the file in order. Raises `RecordingError` where that fails; what was flushed can still be read."""
        for channel in self._channels.values():
            channel.close()
        self._channels.clear()
        self._writer.close()
        self._file.close()
        self._check()

    def _check(self) -> None:
        if (error := self._file.error) is not None:
            raise RecordingError(f"{self.path} cannot be written any more: {_why(error)}; what came before is in it")

    def _tell_cell(self, cell: RecordedCell, begun_at: float) -> None:
        began = datetime.fromtimestamp(begun_at, UTC).isoformat(timespec="microseconds")
        about = {"version": version("zencell"), "cell": cell.settings.name, "cell_file": cell.cell_file, "began": began}
        self._writer.write_metadata(METADATA, about)
        stamp = _nanoseconds(begun_at)
        layout = layout_of(cell).encode()
        for name, data in {**cell.files, LAYOUT: layout}.items():
            kind = "application/json" if name == LAYOUT else "application/octet-stream"
            self._writer.attach(log_time=stamp, create_time=stamp, name=name, media_type=kind, data=data)

    def _draw(self, drawn: Iterable[Drawn], at: float) -> None:
        for topic, picture in drawn:
            self._log(topic, picture.get_schema, picture.encode(), at)

    def _log(self, topic: str, schema: Callable[[], dict[str, Any] | Schema], data: bytes, at: float) -> None:
        channel = self._channels.get(topic)
        if channel is None:
            known = schema()
            encoding = "json" if isinstance(known, dict) else "protobuf"
            channel = Channel(topic, schema=known, message_encoding=encoding, context=self._context)
            self._channels[topic] = channel
        channel.log(data, log_time=_nanoseconds(at))


class _File(RawIOBase):
    """What the writer writes to: it keeps the first error for us, since the writer tells of errors on stderr alone."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._at = self._size = 0
        self.error: OSError | None = None

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def write(self, data: Any) -> int:
        self._try(lambda: self._file.write(data))
        self._at += len(data)
        self._size = max(self._size, self._at)
        return len(data)

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        self._at = offset + {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        self._try(lambda: self._file.seek(self._at))
        return self._at

    def flush(self) -> None:
        if not self._file.closed:
            self._try(self._file.flush)

    def close(self) -> None:
        self.flush()
        try:
            self._file.close()
        except OSError as error:
            self.error = self.error or error
        super().close()

    def _try(self, what: Callable[[], object]) -> None:
        if self.error is None:
            try:
                what()
            except OSError as error:
                self.error = error


def _nanoseconds(at: float) -> int:
    """Exact: the product with 1e9 has more digits than a double."""
    seconds = int(at)
    return seconds * 10**9 + round((at - seconds) * 1e9)


def _why(error: OSError) -> str:
    if isinstance(error, FileExistsError):
        return "there is such a file already; name another one"
    return (error.strerror or str(error)) + "; name a file in a folder with room that you may write to"
