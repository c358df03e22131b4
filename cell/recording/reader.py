"""The messages of a recording, in the order in which they were heard; also of a file that was cut off."""

import dataclasses
import struct
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from importlib.metadata import version
from pathlib import Path, PurePosixPath

from mcap.exceptions import InvalidMagic, McapError, RecordLengthLimitExceeded
from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import CRCValidationError, StreamReader
from zstandard import ZstdError

from cell.config import ConfigError, load_cell_alone
from cell.config.settings import CellSettings
from cell.net.errors import CodecError
from cell.recording.errors import RecordingError
from cell.recording.json_form import KINDS, from_json
from cell.recording.summary import Heard
from cell.recording.writer import METADATA

_BROKEN = (CRCValidationError, McapError, ZstdError, RuntimeError, struct.error, ValueError, EOFError)
"""What the libraries raise where bytes are missing or wrong."""


@dataclass(frozen=True, slots=True)
class Raw:
    """A message as it lies in the file."""

    topic: int
    kind: type
    data: bytes
    at: float
    """When it was heard: seconds since 1970 (UTC)."""


class Recorded:
    """A recording that is read. Every method raises `RecordingError`, with one sentence that names the file."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.cut = False
        """What was read last ended before the end of the file was written: its recorder was killed, or still writes."""
        about: dict[str, str] = {}
        files: dict[str, bytes] = {}
        for record in self._records():
            if isinstance(record, Metadata) and record.name == METADATA:
                about = record.metadata
            elif isinstance(record, Attachment):
                files[record.name] = record.data
            elif isinstance(record, Message):
                break
        if not {"version", "cell_file", "began"} <= set(about):
            raise RecordingError(f"{path} is no recording of a cell: `cell record` and `cell up` write them")
        self.version = about["version"]
        self.files = files
        """The cell's files by their names, and the layout."""
        self.cell = about.get("cell", "")
        self.began = _moment(about["began"])
        """Seconds since 1970 (UTC)."""
        self._cell_file = about["cell_file"]

    def messages(self, since: float | None = None) -> Iterator[Heard]:
        """Everything that was heard; `since` as in `raw`."""
        for raw in self.raw(since):
            yield self.message(raw), raw.at

    def raw(self, since: float | None = None) -> Iterator["Raw"]:
        """The same, not yet read; with `since`, seconds since 1970: first the newest on each topic before."""
        kinds: dict[int, type] = {}
        names: dict[int, str] = {}
        before: dict[int, Raw] = {}
        for record in self._records():
            if isinstance(record, Schema):
                names[record.id] = record.name
            elif isinstance(record, Channel) and record.message_encoding == "json":
                kinds[record.id] = self._kind(names.get(record.schema_id, ""))
            elif isinstance(record, Message) and (kind := kinds.get(record.channel_id)) is not None:
                raw = Raw(record.channel_id, kind, record.data, _seconds(record.log_time))
                if since is not None and raw.at < since:
                    before[raw.topic] = raw
                    continue
                yield from sorted(before.values(), key=_at)
                before = {}
                yield raw
        yield from sorted(before.values(), key=_at)

    def message(self, raw: "Raw") -> object:
        """What was heard."""
        try:
            return from_json(raw.kind, raw.data)
        except CodecError as error:
            raise self._other_version(str(error)) from error

    def span(self) -> tuple[float, float]:
        """When it began, and when the last message was heard; what was newest before that is in it too."""
        return self.began, max((raw.at for raw in self.raw()), default=self.began)

    def _kind(self, name: str) -> type:
        if name not in KINDS:
            raise self._other_version(f"it has messages {name or 'without a name'}")
        return KINDS[name]

    def _other_version(self, found: str) -> RecordingError:
        return RecordingError(
            f"{self.path} was recorded by zencell {self.version}, and this one, {version('zencell')}, cannot read it: "
            f"{found}; read it with the version that wrote it"
        )

    @cached_property
    def settings(self) -> CellSettings:
        """Of the cell file in the recording; what else it names is not looked for."""
        name = self._cell_file
        if name not in self.files or ".." in PurePosixPath(name).parts:
            raise RecordingError(f"{self.path} lacks the file of its cell, {name}")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / PurePosixPath(name).name
            file.write_bytes(self.files[name])
            try:
                return dataclasses.replace(load_cell_alone(file), file=self.path)
            except ConfigError as error:
                raise self._other_version(f"in its cell file, {error.problems[0]}") from error

    def unpack(self, folder: Path) -> Path:
        """Write the files of the cell below a folder; where its cell file is then."""
        for name, data in self.files.items():
            parts = PurePosixPath(name).parts
            if ".." in parts or PurePosixPath(name).is_absolute():
                raise RecordingError(f"{self.path} has a file with the name {name!r}, which leads out of its folder")
            file = folder.joinpath(*parts)
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_bytes(data)
        return folder.joinpath(*PurePosixPath(self._cell_file).parts)

    def _records(self) -> Iterator[McapRecord]:
        """Up to the end, or to where the file was cut off."""
        self.cut = False
        try:
            with self.path.open("rb") as file:
                size = self.path.stat().st_size
                reader = StreamReader(file, validate_crcs=True, record_size_limit=size)
                try:
                    yield from reader.records
                except InvalidMagic as error:
                    raise RecordingError(f"{self.path} is no MCAP file") from error
                except _BROKEN as error:
                    if not isinstance(error, RecordLengthLimitExceeded) and file.tell() < size:
                        raise RecordingError(f"{self.path} is damaged at byte {file.tell()}: {error}") from error
                    self.cut = True
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be read: {error.strerror or error}") from error


def _seconds(nanoseconds: int) -> float:
    return nanoseconds // 10**9 + nanoseconds % 10**9 / 1e9


def _at(raw: Raw) -> float:
    return raw.at


def _moment(text: str) -> float:
    """Seconds since 1970 of a time in ISO 8601; 0 for what is none."""
    try:
        return datetime.fromisoformat(text).timestamp()
    except ValueError:
        return 0.0
