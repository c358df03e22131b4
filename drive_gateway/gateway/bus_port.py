"""One handle of the CAN bus, one reader thread, frames in both directions."""

import threading
from collections.abc import Callable
from types import TracebackType
from typing import Self

import can

from cell.net.runner import scheduling
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus import BusError
from drive_gateway.gateway.bus_news import BusNews
from drive_gateway.gateway.steady_bus import SteadyBus

_POLL_S = 0.1
"""The reader looks this often whether it should end; it waits for nothing else."""


class BusPort:
    """Context manager: sends frames, and gives each received one to `on_frame` from its own thread.

    Extended and error frames are no business of CANopen and left out; what the latter mean is `on_news`.
    """

    def __init__(
        self, settings: BusSettings, on_frame: Callable[[CanFrame], None], on_news: Callable[[BusNews], None]
    ) -> None:
        self._settings = settings
        self._on_frame = on_frame
        self._on_news = on_news
        self._bus: SteadyBus | None = None
        self._end = threading.Event()
        self._reader: threading.Thread | None = None

    def __enter__(self) -> Self:
        """Open the bus. Raises `BusError`."""
        self._bus = bus = SteadyBus(self._settings, self._on_news)
        name = f"can-{self._settings.channel}"
        self._reader = threading.Thread(target=self._read, args=(bus,), name=name, daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        if self._reader is not None:
            self._reader.join()
        if self._bus is not None:
            self._bus.close()

    def send(self, frame: CanFrame) -> None:
        """Send a frame. One that the driver does not take is told: the drives watch for silence themselves."""
        if self._bus is None:
            raise BusError(self._settings, "the bus is not open", "use the port inside its `with` block")
        self._bus.send(
            can.Message(arbitration_id=frame.id, data=frame.data, is_remote_frame=frame.remote, is_extended_id=False)
        )

    def _read(self, bus: SteadyBus) -> None:
        # As urgent as the cycle: a reader that must wait while it holds the interpreter makes the cycle wait too.
        with scheduling(realtime=True):
            while not self._end.is_set():
                message = bus.receive(_POLL_S)
                if message is not None and not message.is_extended_id:
                    self._on_frame(CanFrame(message.arbitration_id, bytes(message.data), message.is_remote_frame))
