"""A handle of a CAN bus that outlives the bus' failures: it tells them, and is opened again until the bus is back."""

import threading
import time
from collections.abc import Callable
from contextlib import suppress

import can
from can.interfaces.udp_multicast import UdpMulticastBus

from drive_gateway.canopen.bus_load import frame_bits
from drive_gateway.config.settings import BusSettings
from drive_gateway.errors import GatewayError
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusNews, remedy_of
from drive_gateway.gateway.bus.opening import BusError, open_bus
from drive_gateway.gateway.bus.own_frames import leave_out_own

Opener = Callable[[BusSettings], can.BusABC]
REOPEN_S = 0.5
"""Between two attempts to open a failed bus."""
_BITS = [frame_bits(length) for length in range(9)]
_BUS_OFF = "bus-off: the CAN controller left the bus after too many errors"
_CLASS_CONTROLLER, _CLASS_ACKNOWLEDGE, _CLASS_BUS_OFF = 0x004, 0x020, 0x040
"""Of an error frame of SocketCAN (linux/can/error.h), which tells the state of this host's own CAN controller."""
_PASSIVE = 0x30
"""In its second data byte: the receiver or the transmitter is error passive."""
_ERRORS_AT_ONCE = 64
"""Error frames that are passed over to find a frame after them."""
UNSENT_S = 2.0
"""A handle that has sent nothing for so long, although it should have, is opened anew."""
TELL_S = 10.0
"""The same trouble of a bus that still works is told again after this time."""


class SteadyBus:
    """One thread calls `receive`, any may call `send`. What happens to the bus goes to `on_news`, from either.

    An interface that goes down, an adapter that is unplugged or garbles, and a controller in bus-off are failures,
    whatever the driver raises. Of all but the last a handle does not recover with every driver, so another one is
    opened every `REOPEN_S` until a frame goes out or comes in through it. Frames that find no room, because nobody
    acknowledges any, are none.
    `opener` makes a handle; python-can by the settings where it is left out.

    Raises:
        BusError: the bus cannot be opened (when it is made; later that is a failure like others).
    """

    def __init__(self, settings: BusSettings, on_news: Callable[[BusNews], None], opener: Opener | None = None) -> None:
        self._settings = settings
        self._open = opener or open_bus
        self._on_news = on_news
        self._lock = threading.Lock()
        self._mark = 0.0
        self.hears_itself = False
        """Its own frames come back to it."""
        self.sent_bits = 0
        """Of all frames that the driver took, with worst-case stuffing."""
        self._bus: can.BusABC | None = self._opened()
        self._failed = False
        self._bus_off = False
        self._passed = False
        """A frame went out through this handle."""
        self._reopen_at = 0.0
        self._unsent = 0
        self._unsent_since: float | None = None
        """Since then no frame was sent; `None`: the newest was."""
        self._old: can.BusABC | None = None
        """A handle that is of no use any more, until it is closed."""
        self._broken = ""
        """Why the handle is of no use any more, found by whoever sends."""
        self._quiet_until: dict[str, float] = {}

    def receive(self, timeout_s: float) -> can.Message | None:
        """The next data or remote frame; `None` when none comes in time or the bus has failed."""
        bus = self._reopened(timeout_s) if self._bus is None else self._bus
        if bus is None:
            return None
        try:
            message = self._read(bus, timeout_s)
        except Exception as error:  # python-can has its own kinds, drivers and serial ports raise others
            self._broken = self._broken or _reason(error)
            message = None
        if self._broken:
            self._drop(self._broken)
            return None
        if self._unsent_since is not None and time.monotonic() - self._unsent_since > UNSENT_S:
            # Some drivers say of an adapter that is gone only that nothing can be sent; opening tells.
            self._let_go()
            return None
        if self._failed and (message is not None or (self._passed and not self._bus_off)):
            self._failed = self._bus_off = False
            self._on_news(BusBack())
        return message

    def send(self, message: can.Message) -> None:
        """Send a frame. One that the driver does not take is lost: who waits for it watches for silence itself."""
        with self._lock:
            told = self._failed
            try:
                if self._bus is not None:
                    message.timestamp = self._mark
                    self._bus.send(message)
                    self.sent_bits += bits_of(message)
                    self._unsent_since, self._passed = None, True
                return
            except (can.CanError, OSError) as error:
                problem = _reason(error)
            except Exception as error:
                problem = self._broken = _reason(error)
            if self._unsent_since is None:
                self._unsent_since = time.monotonic()
            if told:
                return
            self._unsent += 1
        text = f"frames are not sent, {self._unsent} so far, the newest {message.arbitration_id:03X}h: {problem}"
        self.disturbed("unsent", text)

    @property
    def closed(self) -> bool:
        """It has failed and is not open again."""
        return self._bus is None

    def close(self) -> None:
        self._let_go()
        self._close_old()

    def _let_go(self) -> None:
        """Nothing goes through the handle any more. It is closed by whoever opens the next: that may take long."""
        with self._lock:
            self._bus, self._old = None, self._bus or self._old

    def _close_old(self) -> None:
        bus, self._old = self._old, None
        if bus is not None:
            # An adapter that is gone may not even let itself be closed.
            with suppress(Exception):
                bus.shutdown()

    def _drop(self, text: str) -> None:
        self._let_go()
        self._bus_off = False
        self._reopen_at = time.monotonic() + REOPEN_S
        self._fail(text)

    def _read(self, bus: can.BusABC, timeout_s: float) -> can.Message | None:
        """The next data or remote frame; error frames and what is no frame are passed over."""
        for _ in range(_ERRORS_AT_ONCE):
            try:
                message = bus.recv(timeout_s)
            except can.CanOperationError as error:
                if not _foreign(bus, error):
                    raise
                self.disturbed("foreign", f"somebody sends datagrams to its group that are no frames: {error}")
            else:
                if message is None or not message.is_error_frame:
                    return message
                self._judge(message)
            timeout_s = 0.0
        return None

    def _judge(self, message: can.Message) -> None:
        found = _meaning(message) if self._settings.interface == "socketcan" else ""
        if found == _BUS_OFF:
            # The same handle is good again when the controller is; a frame is the sign of it.
            self._bus_off = True
            self._fail(found)
        elif found:
            self.disturbed(found, found)

    def disturbed(self, kind: str, text: str) -> None:
        """Tell trouble of a bus that works; of each kind once in a while."""
        self.tell(kind, BusDisturbed(text), TELL_S)

    def tell(self, kind: str, news: BusNews, quiet_s: float) -> None:
        """Tell what may come with every frame; nothing of the same kind for so long after it."""
        now = time.monotonic()
        if now >= self._quiet_until.get(kind, 0.0):
            self._quiet_until[kind] = now + quiet_s
            self._on_news(news)

    def _fail(self, text: str) -> None:
        if not self._failed:
            self._failed = True
            self._on_news(BusFailed(text))

    def _opened(self) -> can.BusABC:
        """A handle; its own frames come back to it only where that cannot be helped."""
        try:
            bus = self._open(self._settings)
        except GatewayError:
            raise
        except Exception as error:
            raise BusError(self._settings, _reason(error), remedy_of(self._settings)) from error
        if isinstance(bus, UdpMulticastBus):
            self._mark = leave_out_own(bus)
            self.hears_itself = not self._mark
        return bus

    def _reopened(self, timeout_s: float) -> can.BusABC | None:
        """A new handle when it is time for one; else the time that the caller would have waited for a frame passes."""
        left_s = self._reopen_at - time.monotonic()
        if left_s > 0.0:
            time.sleep(min(left_s, timeout_s))
            return None
        self._reopen_at = time.monotonic() + REOPEN_S
        self._close_old()
        try:
            bus = self._opened()
        except GatewayError as error:
            self._fail(error.found if isinstance(error, BusError) else str(error))
            return None
        with self._lock:
            self._bus, self._broken, self._unsent_since, self._passed = bus, "", None, False
        return bus


def bits_of(message: can.Message) -> int:
    """Bits of a frame on the wire with worst-case stuffing; an extended identifier has 20 more, 5 stuffed ones too."""
    bits = _BITS[0 if message.is_remote_frame else min(len(message.data), 8)]
    return bits + 25 if message.is_extended_id else bits


def _reason(error: Exception) -> str:
    """For people; the kinds of python-can and the system speak for themselves."""
    text = str(error)
    return text if text and isinstance(error, (can.CanError, OSError)) else f"{type(error).__name__}: {text}"


def _foreign(bus: can.BusABC, error: can.CanOperationError) -> bool:
    """Only a datagram could not be read; python-can keeps what it found in it as cause."""
    return isinstance(bus, UdpMulticastBus) and not isinstance(error.__cause__, OSError | None)


def _meaning(message: can.Message) -> str:
    """The error that people should know of, for an error frame of `socketcan`; empty for all others.

    Single errors on the wire are repeated by the controller itself and say nothing; those that last lead to these.
    """
    classes = message.arbitration_id
    if classes & _CLASS_BUS_OFF:
        return _BUS_OFF
    if classes & _CLASS_CONTROLLER and len(message.data) > 1 and message.data[1] & _PASSIVE:
        return "the CAN controller is error passive, most of its frames meet errors"
    if classes & _CLASS_ACKNOWLEDGE:
        return "no node acknowledges the frames of this host"
    return ""
