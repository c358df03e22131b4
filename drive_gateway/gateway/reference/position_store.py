"""The file in which a gateway keeps where its axes stand; written beside the cycle, because a disk may be slow."""

import logging
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import TracebackType
from typing import Self

from pydantic import TypeAdapter, ValidationError

from drive_gateway.errors import GatewayError
from drive_gateway.gateway.reference.encoder_record import EncoderRecord

_log = logging.getLogger("drive_gateway")
_RECORDS = TypeAdapter(dict[str, EncoderRecord])


class PositionStoreError(GatewayError):
    """The file cannot be read; without it nobody knows whether an axis was moved while it was off."""


class PositionStore:
    """Context manager; leaving it waits until all is on disk."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._records = self._read()
        self._writer = ThreadPoolExecutor(max_workers=1, thread_name_prefix="positions")

    @property
    def records(self) -> dict[str, EncoderRecord]:
        """By robot.axis."""
        return dict(self._records)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._writer.shutdown(wait=True)

    def keep(self, name: str, record: EncoderRecord) -> None:
        """Write one record soon; the whole file is replaced, so it is never half written."""
        self._records[name] = record
        self._writer.submit(self._write, _RECORDS.dump_json(self._records, indent=1))

    def _read(self) -> dict[str, EncoderRecord]:
        """Raises `PositionStoreError`."""
        try:
            return _RECORDS.validate_json(self._path.read_bytes())
        except FileNotFoundError:
            return {}
        except (OSError, ValidationError) as error:
            reason = str(error).splitlines()[0]
            raise PositionStoreError(
                f"stored positions {self._path}: {reason}; repair the file, or remove it: then look whether every axis "
                "is where its drive says, because nothing is compared at the next start"
            ) from error

    def _write(self, content: bytes) -> None:
        new = self._path.with_suffix(".new")
        try:
            with new.open("wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            new.replace(self._path)
        except OSError as error:
            _log.error("positions are not stored: %s; after the next start axes must be confirmed (cell accept)", error)
