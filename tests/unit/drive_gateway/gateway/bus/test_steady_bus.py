"""A bus that fails: it is told once, opened again, and told when it is back."""

import struct
from collections.abc import Callable

import can
import pytest

from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus import steady_bus
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusNews
from drive_gateway.gateway.bus.opening import BusError
from drive_gateway.gateway.bus.steady_bus import SteadyBus

FRAME = can.Message(arbitration_id=0x701, data=b"\x05", is_extended_id=False)
DOWN = can.CanOperationError("Error receiving: Network is down", 100)


class Handle:
    """Gives and takes what the script says; at its end nothing comes any more."""

    def __init__(
        self,
        *script: can.Message | Exception | None,
        full: bool = False,
        sends: Exception | None = None,
        closes: Exception | None = None,
    ) -> None:
        self._script = list(script)
        self._full = full
        self._sends, self._closes = sends, closes
        self.open = True
        self.sent: list[int] = []

    def recv(self, _timeout: float) -> can.Message | None:
        assert self.open
        item = self._script.pop(0) if self._script else None
        if isinstance(item, Exception):
            raise item
        return item

    def send(self, message: can.Message) -> None:
        assert self.open
        if self._full:
            raise can.CanOperationError("Failed to transmit: No buffer space available", 105)
        if self._sends is not None:
            raise self._sends
        self.sent.append(message.arbitration_id)

    def shutdown(self) -> None:
        self.open = False
        if self._closes is not None:
            raise self._closes


Opened = Callable[..., tuple[SteadyBus, list[BusNews]]]


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    """Makes a bus whose handles are these, one after the other, without pauses."""

    def make(*handles: Handle | Exception, interface: str = "socketcan") -> tuple[SteadyBus, list[BusNews]]:
        waiting, news = list(handles), list[BusNews]()

        def open_next(_settings: BusSettings) -> can.BusABC:
            handle = waiting.pop(0)
            if isinstance(handle, Exception):
                raise handle
            return handle  # type: ignore[return-value]

        monkeypatch.setattr(steady_bus, "open_bus", open_next)
        monkeypatch.setattr(steady_bus, "REOPEN_S", 0.0)
        return SteadyBus(BusSettings(interface, "can0", 1_000_000, {}), news.append), news

    return make


def test_an_interface_that_goes_down_is_told_once_and_opened_until_it_can_be_read(opened: Opened) -> None:
    first, still_down, good = Handle(FRAME, DOWN), Handle(DOWN), Handle(None, FRAME)
    bus, news = opened(first, still_down, good)
    assert bus.receive(0.1) is FRAME
    assert [bus.receive(0.1) for _ in range(2)] == [None, None]
    bus.send(FRAME)
    assert news == [BusFailed(str(DOWN))]
    assert bus.receive(0.1) is None
    bus.send(FRAME)
    assert news == [BusFailed(str(DOWN))]
    assert bus.receive(0.1) is FRAME
    assert news == [BusFailed(str(DOWN)), BusBack()]
    assert not first.open
    assert not still_down.open
    assert good.sent == [0x701]
    bus.close()
    assert not good.open


@pytest.mark.parametrize("heard", [None, FRAME])
def test_an_adapter_that_can_be_opened_is_not_back_before_a_frame_goes_through_it(
    opened: Opened, heard: can.Message | None
) -> None:
    broken = AttributeError("no port")
    bus, news = opened(Handle(sends=broken), Handle(sends=broken), Handle(None, heard))
    for _ in range(3):
        bus.send(FRAME)
        assert bus.receive(0.0) is None
    assert [type(item) for item in news] == [BusDisturbed, BusFailed]
    assert bus.receive(0.0) is None
    if heard is None:
        bus.send(FRAME)
    assert bus.receive(0.0) is heard
    assert [type(item) for item in news] == [BusDisturbed, BusFailed, BusBack]


def error_frame(classes: int, *data: int) -> can.Message:
    return can.Message(arbitration_id=classes, data=bytes(data).ljust(8, b"\0"), is_error_frame=True)


def test_bus_off_lasts_until_a_frame_comes(opened: Opened) -> None:
    bus, news = opened(Handle(error_frame(0x040), None, FRAME))
    assert bus.receive(0.1) is None
    assert [type(item) for item in news] == [BusFailed]
    assert bus.receive(0.1) is FRAME
    assert news[1:] == [BusBack()]


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (error_frame(0x004, 0, 0x20), "error passive"),
        (error_frame(0x004, 0, 0x10), "error passive"),
        (error_frame(0x020), "acknowledges"),
        (error_frame(0x004, 0, 0x08), ""),  # error warning
        (error_frame(0x008, 0, 0, 0x02), ""),  # one bit error
    ],
)
def test_error_frames_of_socketcan_are_told_by_meaning_and_not_each(
    opened: Opened, frame: can.Message, said: str
) -> None:
    bus, news = opened(Handle(frame, frame))
    assert [bus.receive(0.1) for _ in range(2)] == [None, None]
    assert len(news) == bool(said)
    assert all(isinstance(item, BusDisturbed) and said in item.text for item in news)


def test_error_frames_of_other_interfaces_mean_something_else(opened: Opened) -> None:
    bus, news = opened(Handle(error_frame(0x040)), interface="pcan")
    assert bus.receive(0.1) is None
    assert news == []


def test_frames_that_find_no_room_are_counted_and_told_from_time_to_time(
    opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, news = opened(Handle(full=True))
    for _ in range(3):
        bus.send(FRAME)
    monkeypatch.setattr(steady_bus, "TELL_S", 0.0)
    bus._quiet_until.clear()
    bus.send(FRAME)
    texts = [item.text for item in news if isinstance(item, BusDisturbed)]
    assert len(news) == len(texts) == 2
    assert "1 so far, the newest 701h" in texts[0]
    assert "No buffer space available" in texts[0]
    assert "4 so far" in texts[1]


WHATEVER = (
    OSError(19, "No such device"),
    ValueError("invalid literal for int() with base 16: b'ZZZ'"),
    struct.error("unpack requires a buffer of 8 bytes"),
    AttributeError("'NoneType' object has no attribute 'read'"),
    RuntimeError(),
    can.CanOperationError("the adapter was unplugged"),
)
"""What serial adapters, gs_usb and PCAN were seen to raise."""


@pytest.mark.parametrize(
    ("where", "error"),
    [
        (where, error)
        for where in ("recv", "send", "recv and shutdown", "construction", "shutdown")
        for error in WHATEVER
        # A frame that finds no room is told as such.
        if where != "send" or not isinstance(error, OSError | can.CanError)
    ],
)
def test_whatever_a_driver_raises_wherever_is_a_failed_bus_with_its_reason_and_good_again_when_it_works(
    opened: Opened, where: str, error: Exception
) -> None:
    good = Handle(FRAME)
    closes = error if "shutdown" in where else None
    bad = Handle(sends=error) if where == "send" else Handle(error if "recv" in where else DOWN, closes=closes)
    bus, news = opened(bad, *([error, error] if where == "construction" else []), good)
    bus.send(FRAME)
    bus.receive(0.0)
    failed = [item.text for item in news if isinstance(item, BusFailed)]
    assert len(failed) == 1
    if where != "construction" and where != "shutdown":
        assert str(error) in failed[0]
        assert failed[0].strip(" :")
    while not any(isinstance(item, BusBack) for item in news):
        bus.send(FRAME)
        assert bus.receive(0.0) in (None, FRAME)
    assert len([item for item in news if isinstance(item, BusFailed)]) == 1
    bus.send(FRAME)
    assert good.sent[-1] == 0x701
    bus.close()


def test_a_bus_off_controller_that_is_unplugged_is_opened_again(opened: Opened) -> None:
    bus, news = opened(Handle(error_frame(0x040), None, AttributeError("gone")), Handle(FRAME))
    assert bus.receive(0.0) is None
    assert bus.receive(0.0) is None
    assert [type(item) for item in news] == [BusFailed]
    assert bus.receive(0.0) is FRAME
    assert [type(item) for item in news] == [BusFailed, BusBack]


def test_an_adapter_that_only_cannot_send_any_more_is_opened_again_and_fails_when_that_fails(
    opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(steady_bus, "UNSENT_S", 0.0)
    gone = can.CanInitializationError("no device found")
    bus, news = opened(Handle(full=True), Handle(full=True), gone, good := Handle())
    while not any(isinstance(item, BusBack) for item in news):
        bus.send(FRAME)
        bus.receive(0.0)
    assert [type(item) for item in news] == [BusDisturbed, BusFailed, BusBack]
    assert "no device found" in news[1].text  # type: ignore[union-attr]
    bus.send(FRAME)
    assert good.sent


def test_a_bus_that_raises_at_the_start_says_what_to_do(opened: Opened) -> None:
    with pytest.raises(BusError, match="AttributeError: no dll; check that the adapter is plugged in"):
        opened(AttributeError("no dll"), interface="pcan")


def test_a_handle_that_takes_long_to_close_does_not_keep_the_cycle_that_finds_it_broken(
    opened: Opened, monkeypatch: pytest.MonkeyPatch
) -> None:
    bus, _ = opened(bad := Handle(DOWN), Handle())
    monkeypatch.setattr(steady_bus, "REOPEN_S", 0.5)
    assert bus.receive(0.0) is None
    assert bus.closed
    assert bad.open, "closing is the work of the thread that opens the next"
    bus.close()
    assert not bad.open
