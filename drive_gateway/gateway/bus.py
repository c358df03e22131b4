"""The CAN bus as python-can opens it: one handle, frames in both directions, read in the cycle or as they come."""

import logging
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self

import can

from cell.net.runner import scheduling
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import BusSettings
from drive_gateway.errors import GatewayError
from drive_gateway.gateway.own_frames import leave_out_own

_POLL_S = 0.1
"""The reader looks this often whether it should go on; it waits for nothing else."""
_MOST = 512
"""Frames that one `take` reads: a node that babbles must not keep the cycle."""
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
    """Context manager: sends frames, and gives each received one to `on_frame`.

    The cycle reads with `take` what has come since the cycle before, which costs it no wake-up and no change of thread
    per frame. While somebody is in `attend`, because an answer is waited for, a thread reads the frames as they come,
    and `on_frame` is called from there. Left out are extended and error frames, which are no business of CANopen, and
    identifiers that this port sends itself: nobody else may, and some buses give all frames back.
    """

    def __init__(self, settings: BusSettings, on_frame: Callable[[CanFrame], None]) -> None:
        self._settings = settings
        self._on_frame = on_frame
        self._bus: can.BusABC | None = None
        self._sending = threading.Lock()
        self._own: set[int] = set()
        self._mark = 0.0
        self._reading = threading.Lock()
        """Held by whoever reads, so that frames stay in their order."""
        self._attendants = 0
        self._count = threading.Lock()
        self._attended = threading.Event()
        self._end = threading.Event()
        self._reader: threading.Thread | None = None
        self.failure: str | None = None
        """Why nothing can be read any more."""
        self.send_failures = 0

    def __enter__(self) -> Self:
        """Open the bus. Raises `BusError`."""
        self._bus = bus = open_bus(self._settings)
        if self._settings.interface == "udp_multicast":
            self._mark = leave_out_own(bus)
        self._reader = threading.Thread(target=self._read, args=(bus,), name=f"can-{bus.channel_info}", daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        self._attended.set()
        if self._reader is not None:
            self._reader.join()
        if self._bus is not None:
            self._bus.shutdown()

    def send(self, frame: CanFrame) -> None:
        """Send a frame. One that the driver does not take is counted: the drives watch for silence themselves."""
        message = can.Message(
            timestamp=self._mark,
            arbitration_id=frame.id,
            data=frame.data,
            is_remote_frame=frame.remote,
            is_extended_id=False,
        )
        if not frame.remote:
            self._own.add(frame.id)
        try:
            with self._sending:
                self._open.send(message)
        except can.CanError as error:
            self.send_failures += 1
            if self.send_failures == 1:
                _LOG.warning("frame %03Xh was not sent: %s", frame.id, error)

    def take(self) -> None:
        """Read what has come, without waiting; nothing is left to do while the thread of `attend` reads."""
        bus = self._open
        if self.failure is not None or not self._reading.acquire(blocking=False):
            return
        try:
            for _ in range(_MOST):
                message = bus.recv(0.0)
                if message is None:
                    break
                self._hand_over(message)
        except (can.CanError, OSError) as error:
            self._fail(error)
        finally:
            self._reading.release()

    @contextmanager
    def attend(self) -> Iterator[None]:
        """Inside, frames are read as they come."""
        with self._count:
            self._attendants += 1
            self._attended.set()
        try:
            yield
        finally:
            with self._count:
                self._attendants -= 1
                if not self._attendants and not self._end.is_set():
                    self._attended.clear()

    @property
    def _open(self) -> can.BusABC:
        if self._bus is None:
            raise BusError(self._settings, "the bus is not open", "use the port inside its `with` block")
        return self._bus

    def _read(self, bus: can.BusABC) -> None:
        try:
            # As urgent as the cycle: a reader that must wait while it holds the interpreter makes the cycle wait too.
            with scheduling(realtime=True):
                while self._attended.wait() and not self._end.is_set():
                    with self._reading:
                        self._receive(bus)
        except (can.CanError, OSError) as error:
            self._fail(error)

    def _receive(self, bus: can.BusABC) -> None:
        while self._attended.is_set() and not self._end.is_set():
            message = bus.recv(_POLL_S)
            if message is not None:
                self._hand_over(message)

    def _hand_over(self, message: can.Message) -> None:
        number = message.arbitration_id
        if number not in self._own and not message.is_extended_id and not message.is_error_frame:
            self._on_frame(CanFrame(number, bytes(message.data), message.is_remote_frame))

    def _fail(self, error: Exception) -> None:
        self.failure = str(error)
        _LOG.error("CAN bus %s: reading failed: %s", self._settings.channel, error)
