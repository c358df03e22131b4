"""The CAN bus as python-can opens it: one handle, one reader thread, frames in both directions."""

import logging
import threading
from collections.abc import Callable
from types import TracebackType
from typing import Any, Self

import can

from cell.net.runner import scheduling
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import BusSettings
from drive_gateway.errors import GatewayError

_POLL_S = 0.1
"""The reader looks this often whether it should end; it waits for nothing else."""
_LOG = logging.getLogger("drive_gateway.bus")


class BusError(GatewayError):
    """A bus that cannot be opened or used."""

    def __init__(self, settings: BusSettings, found: str, remedy: str) -> None:
        super().__init__(f"CAN bus {settings.interface}:{settings.channel}: {found}; {remedy}")
        self.interface = settings.interface
        self.channel = settings.channel
        self.found = found
        self.remedy = remedy


def open_bus(settings: BusSettings) -> can.BusABC:
    """Open the bus that the YAML names. Raises `BusError` with what to do."""
    options: dict[str, Any] = dict(settings.options)
    known = ", ".join(sorted(can.VALID_INTERFACES))
    if settings.interface not in can.VALID_INTERFACES:
        raise BusError(settings, f"python-can has no interface {settings.interface!r}", f"allowed are {known}")
    try:
        return can.Bus(interface=settings.interface, channel=settings.channel, bitrate=settings.bitrate, **options)
    except ImportError as error:
        raise BusError(settings, f"a package is missing: {error}", "install it beside this program") from error
    except (TypeError, ValueError) as error:
        raise BusError(settings, str(error), "correct the channel, bit rate or options of the bus file") from error
    except (can.CanError, OSError) as error:
        remedy = "check that the adapter is plugged in, its driver is loaded and the channel is up"
        raise BusError(settings, str(error), remedy) from error


class BusPort:
    """Context manager: sends frames, and gives each received one to `on_frame` from its own thread.

    Extended and error frames are no business of CANopen and left out.
    """

    def __init__(self, settings: BusSettings, on_frame: Callable[[CanFrame], None]) -> None:
        self._settings = settings
        self._on_frame = on_frame
        self._bus: can.BusABC | None = None
        self._lock = threading.Lock()
        self._end = threading.Event()
        self._reader: threading.Thread | None = None
        self.failure: str | None = None
        """Why the reader ended although nobody asked it to."""
        self.send_failures = 0

    def __enter__(self) -> Self:
        """Open the bus. Raises `BusError`."""
        self._bus = bus = open_bus(self._settings)
        self._reader = threading.Thread(target=self._read, args=(bus,), name=f"can-{bus.channel_info}", daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        if self._reader is not None:
            self._reader.join()
        if self._bus is not None:
            self._bus.shutdown()

    def send(self, frame: CanFrame) -> None:
        """Send a frame. One that the driver does not take is counted: the drives watch for silence themselves."""
        if self._bus is None:
            raise BusError(self._settings, "the bus is not open", "use the port inside its `with` block")
        message = can.Message(
            arbitration_id=frame.id, data=frame.data, is_remote_frame=frame.remote, is_extended_id=False
        )
        try:
            with self._lock:
                self._bus.send(message)
        except can.CanError as error:
            self.send_failures += 1
            if self.send_failures == 1:
                _LOG.warning("frame %03Xh was not sent: %s", frame.id, error)

    def _read(self, bus: can.BusABC) -> None:
        try:
            # As urgent as the cycle: a reader that must wait while it holds the interpreter makes the cycle wait too.
            with scheduling(realtime=True):
                self._receive(bus)
        except (can.CanError, OSError) as error:
            self.failure = str(error)
            _LOG.error("CAN bus %s: reading failed: %s", self._settings.channel, error)

    def _receive(self, bus: can.BusABC) -> None:
        while not self._end.is_set():
            message = bus.recv(_POLL_S)
            if message is not None and not message.is_extended_id and not message.is_error_frame:
                self._on_frame(CanFrame(message.arbitration_id, bytes(message.data), message.is_remote_frame))
