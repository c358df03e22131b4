"""One handle of the CAN bus, frames in both directions, read in the cycle or as they come."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

import can

from cell.net.runner import Priority, scheduling
from drive_gateway.canopen.cob_id import ERROR_CONTROL, SDO_TO_NODE, function_code, node_id
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtState, decode_heartbeat
from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus.bus_news import BusNews, SecondMaster
from drive_gateway.gateway.bus.opening import BusError
from drive_gateway.gateway.bus.steady_bus import Opener, SteadyBus, bits_of

_POLL_S = 0.1
"""The reader looks this often whether it should go on; it waits for nothing else."""
TELL_MASTER_S = 0.1
"""A second master is told again after this time."""
_MOST = 512
"""Frames that one `take` reads: a node that babbles must not keep the cycle."""


class BusPort:
    """Context manager: sends frames, and gives each received one to `on_frame`.

    The cycle reads with `take` what has come since the cycle before, which costs it no wake-up and no change of thread
    per frame. A thread reads the frames as they come, and calls `on_frame`, while somebody is in `attend`, because an
    answer is waited for; it also opens a bus again that has failed. Left out are extended and error frames, which are
    no business of CANopen (what the latter mean is `on_news`), and identifiers that this port sends itself: some buses
    give all frames back, and on others somebody sends them who may not, which is told.
    """

    def __init__(
        self,
        settings: BusSettings,
        on_frame: Callable[[CanFrame], None],
        on_news: Callable[[BusNews], None],
        opener: Opener | None = None,
    ) -> None:
        self._settings = settings
        self._opener = opener
        self._on_frame = on_frame
        self._on_news = on_news
        self._bus: SteadyBus | None = None
        self._own: set[int] = set()
        self._received_bits = 0
        self._reading = threading.Lock()
        """Held by whoever reads, so that frames stay in their order."""
        self._attendants = 0
        self._count = threading.Lock()
        self._wanted = threading.Event()
        """The thread has something to do."""
        self._end = threading.Event()
        self._reader: threading.Thread | None = None

    def __enter__(self) -> Self:
        """Open the bus. Raises `BusError`."""
        self._bus = bus = SteadyBus(self._settings, self._on_news, self._opener)
        name = f"can-{self._settings.channel}"
        self._reader = threading.Thread(target=self._read, args=(bus,), name=name, daemon=True)
        self._reader.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        self._wanted.set()
        if self._reader is not None:
            self._reader.join()
        if self._bus is not None:
            self._bus.close()

    def send(self, frame: CanFrame) -> None:
        """Send a frame. One that the driver does not take is told: the drives watch for silence themselves."""
        if not frame.remote:
            self._own.add(frame.id)
        self._open.send(
            can.Message(arbitration_id=frame.id, data=frame.data, is_remote_frame=frame.remote, is_extended_id=False)
        )

    def take(self) -> None:
        """Read what has come, without waiting; nothing is left to do while the thread reads."""
        bus = self._open
        if bus.closed:
            self._wanted.set()
        elif self._reading.acquire(blocking=False):
            try:
                for _ in range(_MOST):
                    message = bus.receive(0.0)
                    if message is None:
                        break
                    self._hand_over(message)
            finally:
                self._reading.release()

    @property
    def bits(self) -> int:
        """Of all frames that were sent and received so far, with worst-case stuffing."""
        return self._open.sent_bits + self._received_bits

    @contextmanager
    def attend(self) -> Iterator[None]:
        """Inside, frames are read as they come."""
        with self._count:
            self._attendants += 1
            self._wanted.set()
        try:
            yield
        finally:
            with self._count:
                self._attendants -= 1

    @property
    def _open(self) -> SteadyBus:
        if self._bus is None:
            raise BusError(self._settings, "the bus is not open", "use the port inside its `with` block")
        return self._bus

    def _read(self, bus: SteadyBus) -> None:
        # As urgent as the cycle: a reader that must wait while it holds the interpreter makes the cycle wait too.
        with scheduling(Priority.BUS):
            while self._wanted.wait() and not self._end.is_set():
                with self._reading:
                    message = bus.receive(_POLL_S)
                    if message is not None:
                        self._hand_over(message)
                with self._count:
                    if not self._attendants and not bus.closed and not self._end.is_set():
                        self._wanted.clear()

    def _hand_over(self, message: can.Message) -> None:
        number = message.arbitration_id
        own = number in self._own and self._open.hears_itself
        if not own:
            self._received_bits += bits_of(message)
        if message.is_extended_id:
            return
        if number not in self._own:
            self._on_frame(CanFrame(number, bytes(message.data), message.is_remote_frame))
        elif not self._open.hears_itself:
            self._tell_of_other(number, bytes(message.data))

    def _tell_of_other(self, number: int, data: bytes) -> None:
        text = f"somebody else sends {number:03X}h, which only this gateway may"
        if function_code(number) == ERROR_CONTROL and decode_heartbeat(data) is not NmtState.OPERATIONAL:
            # Whoever commands a bus is Operational; a new drive is not, and many have this Node-ID from their factory.
            own = node_id(number)
            text = f"a node has Node-ID {own}, the gateway's own: give it another one, or this gateway by gateway_node"
            self._open.disturbed("own Node-ID", text)
            return
        if function_code(number) == SDO_TO_NODE:
            self._open.disturbed("master", f"{text}; its tools read and write objects through the gateway")
            return
        self._open.tell("second master", SecondMaster(text), TELL_MASTER_S)
