"""A bus that fails: it is told once, opened again, and told when it is back."""

from collections.abc import Callable

import can
import pytest

from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus import steady_bus
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusNews
from drive_gateway.gateway.bus.steady_bus import SteadyBus

FRAME = can.Message(arbitration_id=0x701, data=b"\x05", is_extended_id=False)
DOWN = can.CanOperationError("Error receiving: Network is down", 100)


class Handle:
    """Gives and takes what the script says; at its end nothing comes any more."""

    def __init__(self, *script: can.Message | Exception | None, full: bool = False) -> None:
        self._script = list(script)
        self._full = full
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
        self.sent.append(message.arbitration_id)

    def shutdown(self) -> None:
        self.open = False


Opened = Callable[..., tuple[SteadyBus, list[BusNews]]]


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> Opened:
    """Makes a bus whose handles are these, one after the other, without pauses."""

    def make(*handles: Handle, interface: str = "socketcan") -> tuple[SteadyBus, list[BusNews]]:
        waiting, news = list(handles), list[BusNews]()
        monkeypatch.setattr(steady_bus, "open_bus", lambda _settings: waiting.pop(0))
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
    assert news == [BusFailed(str(DOWN)), BusBack()]
    assert bus.receive(0.1) is FRAME
    bus.send(FRAME)
    assert not first.open
    assert not still_down.open
    assert good.sent == [0x701]
    bus.close()
    assert not good.open


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
