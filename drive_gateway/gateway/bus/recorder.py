"""All frames of a bus to a file, through a handle of its own on the same channel (candump, Vector ASC, Vector BLF)."""

import time
from contextlib import suppress
from pathlib import Path
from threading import Event

import can

from drive_gateway.config.settings import BusSettings
from drive_gateway.errors import GatewayError
from drive_gateway.gateway.bus.bus_news import name_of, remedy_of
from drive_gateway.gateway.bus.opening import open_bus

FORMATS = {".log": "candump", ".asc": "Vector ASC", ".blf": "Vector BLF"}
"""Suffix of a file: its format."""
LONGEST_S = 3600.0
_POLL_S = 0.1


class RecordError(GatewayError):
    """A recording that cannot begin, or that broke off."""


class Recorder:
    """Context manager: the bus and the file are open, `run` writes.

    Raises:
        RecordError: the suffix names no format, or the file cannot be written.
        BusError: the bus cannot be opened.
    """

    def __init__(self, settings: BusSettings, file: Path) -> None:
        if file.suffix not in FORMATS:
            known = ", ".join(f"{suffix} ({name})" for suffix, name in FORMATS.items())
            raise RecordError(f"{file}: {file.suffix or 'no suffix'} is no format; allowed are {known}")
        self._settings = settings
        self._bus = open_bus(settings)
        try:
            self._logger = can.Logger(str(file))
        except (OSError, ValueError) as error:
            self._bus.shutdown()
            why = error.strerror if isinstance(error, OSError) else error
            raise RecordError(f"{str(file)!r} cannot be written: {why}; choose another file") from error

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(self, *_error: object) -> None:
        self._logger.stop()
        # An adapter that is gone may not even let itself be closed; what was recorded is in the file.
        with suppress(Exception):
            self._bus.shutdown()

    def run(self, seconds: float, stop: Event) -> int:
        """Write what comes within `seconds`, or until `stop` is set; answers the number of frames.

        Raises:
            RecordError: the bus failed meanwhile; what came before is in the file.
        """
        end = time.monotonic() + seconds
        frames = 0
        while (left := end - time.monotonic()) > 0 and not stop.is_set():
            try:
                message = self._bus.recv(min(left, _POLL_S))
            except Exception as error:  # drivers raise whatever they like
                text = f"{name_of(self._settings)}: the recording broke off after {frames} frames: {error}"
                raise RecordError(f"{text}; {remedy_of(self._settings)}") from error
            if message is not None:
                self._logger.on_message_received(message)
                frames += 1
        return frames
