"""The gateway's handle of its bus: who reads when, what is handed over, and what is left out."""

import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from queue import SimpleQueue
from threading import Event

import can
import pytest

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, BusNews, SecondMaster
from drive_gateway.gateway.bus.bus_port import BusPort
from tests.ports import free_port

DEADLINE_S = 20.0
SYNC, TPDO, RPDO = 0x080, 0x181, 0x201


@contextmanager
def port_and_peer(request: pytest.FixtureRequest) -> Iterator[tuple[BusPort, can.BusABC, SimpleQueue[CanFrame]]]:
    """A port, another node's handle of the same bus, and what the port hands over."""
    got: SimpleQueue[CanFrame] = SimpleQueue()
    settings = BusSettings("virtual", request.node.name, 1_000_000, {})
    news: SimpleQueue[BusNews] = SimpleQueue()
    with (
        can.Bus(interface="virtual", channel=request.node.name) as peer,
        BusPort(settings, got.put, news.put) as port,
    ):
        yield port, peer, got


def send(peer: can.BusABC, *ids: int) -> None:
    for number in ids:
        peer.send(can.Message(arbitration_id=number, data=b"\1", is_extended_id=False))


def ids(got: SimpleQueue[CanFrame]) -> list[int]:
    return [got.get_nowait().id for _ in range(got.qsize())]


def test_a_cycle_takes_what_has_come_in_its_order_and_does_not_wait(request: pytest.FixtureRequest) -> None:
    with port_and_peer(request) as (port, peer, got):
        send(peer, TPDO, TPDO + 2, TPDO + 1)
        assert ids(got) == []
        port.take()
        port.take()
        assert ids(got) == [TPDO, TPDO + 2, TPDO + 1]


def test_while_an_answer_is_waited_for_frames_come_by_themselves(request: pytest.FixtureRequest) -> None:
    with port_and_peer(request) as (port, peer, got):
        with port.attend(), port.attend():
            send(peer, TPDO, TPDO + 1)
            assert [got.get(timeout=DEADLINE_S).id, got.get(timeout=DEADLINE_S).id] == [TPDO, TPDO + 1]
        # Whoever reads now, the cycle or what is left of the thread: nothing is lost and all stays in order.
        many, came = list(range(TPDO, TPDO + 100)), list[int]()
        send(peer, *many)
        deadline = time.monotonic() + DEADLINE_S
        while len(came) < len(many) and time.monotonic() < deadline:
            port.take()
            came += ids(got)
        assert came == many


def test_frames_that_only_this_port_may_send_and_frames_that_are_no_canopen_are_left_out(
    request: pytest.FixtureRequest,
) -> None:
    with port_and_peer(request) as (port, peer, got):
        port.send(CanFrame(RPDO, b"\1"))
        # A poll of a guarded node and its answer have the same identifier.
        port.send(CanFrame(0x701, b"", remote=True))
        send(peer, RPDO, 0x701)
        peer.send(can.Message(arbitration_id=TPDO, is_extended_id=True))
        peer.send(can.Message(is_error_frame=True, is_extended_id=False))
        send(peer, TPDO)
        port.take()
        assert ids(got) == [0x701, TPDO]


def test_a_multicast_bus_gives_a_port_only_what_others_send(monkeypatch: pytest.MonkeyPatch) -> None:
    options = {"port": free_port(), "hop_limit": 0}
    settings = BusSettings("udp_multicast", "239.74.163.2", 1_000_000, options)
    read: list[int] = []
    receive = can.BusABC.recv

    def watched(bus: can.BusABC, timeout: float | None = None) -> can.Message | None:
        message = receive(bus, timeout)
        if message is not None:
            read.append(message.arbitration_id)
        return message

    got: SimpleQueue[CanFrame] = SimpleQueue()
    news: SimpleQueue[BusNews] = SimpleQueue()
    with (
        can.Bus(interface="udp_multicast", channel="239.74.163.2", **options) as peer,
        BusPort(settings, got.put, news.put) as port,
    ):
        monkeypatch.setattr(can.BusABC, "recv", watched)
        port.send(CanFrame(RPDO, b"\1\2"))
        port.send(CanFrame(0x701, b"", remote=True))
        assert [(peer.recv(DEADLINE_S) or can.Message()).arbitration_id for _ in range(2)] == [RPDO, 0x701]
        read.clear()
        send(peer, TPDO)
        deadline = time.monotonic() + DEADLINE_S
        while not read and time.monotonic() < deadline:
            port.take()
        port.take()
        # The kernel has dropped its own: the port has not even read them.
        assert read == ids(got) == [TPDO]


def test_a_stranger_on_the_multicast_group_is_no_failed_bus() -> None:
    options = {"port": free_port(), "hop_limit": 0}
    settings = BusSettings("udp_multicast", "239.74.163.3", 1_000_000, options)
    got: SimpleQueue[CanFrame] = SimpleQueue()
    news: SimpleQueue[BusNews] = SimpleQueue()
    with (
        can.Bus(interface="udp_multicast", channel="239.74.163.3", **options) as peer,
        BusPort(settings, got.put, news.put) as port,
    ):
        for garbage in (b"\xff\xfe garbage", b"\x81\xa1x\x01", b"\x01", bytes(4000)):
            peer._multicast.send(garbage)  # type: ignore[attr-defined]
        send(peer, TPDO)
        deadline = time.monotonic() + DEADLINE_S
        while got.empty() and time.monotonic() < deadline:
            port.take()
        assert ids(got) == [TPDO]
    told = [news.get_nowait() for _ in range(news.qsize())]
    assert [type(item) for item in told] == [BusDisturbed]
    assert "are no frames" in told[0].text  # type: ignore[union-attr]


@pytest.mark.parametrize("error", [ValueError("no hex"), AttributeError("no port"), OSError(5, "I/O error")])
def test_no_adapter_ends_the_loop_that_reads_it(request: pytest.FixtureRequest, error: Exception) -> None:
    """A handle that raises in all it does, while an answer is waited for and while none is."""

    class Broken(can.BusABC):
        def __init__(self) -> None:
            super().__init__("x")

        def recv(self, _timeout: float | None = None) -> can.Message | None:
            raise error

        def send(self, _message: can.Message, _timeout: float | None = None) -> None:
            raise error

        def shutdown(self) -> None:
            self._is_shutdown = True
            raise error

    works = Event()

    def opener(settings: BusSettings) -> can.BusABC:
        if news.empty():
            return Broken()
        if not works.is_set():
            raise error
        return can.Bus(interface="virtual", channel=settings.channel)

    got: SimpleQueue[CanFrame] = SimpleQueue()
    news: SimpleQueue[BusNews] = SimpleQueue()
    settings = BusSettings("virtual", request.node.name, 1_000_000, {})
    with (
        can.Bus(interface="virtual", channel=request.node.name) as peer,
        BusPort(settings, got.put, news.put, opener) as port,
    ):
        for _ in range(3):
            port.send(CanFrame(SYNC, b""))
            port.take()
            with port.attend():
                port.take()
        works.set()
        deadline = time.monotonic() + DEADLINE_S
        while got.empty() and time.monotonic() < deadline:
            port.take()
            send(peer, TPDO)
        assert not got.empty()
    told = [news.get_nowait() for _ in range(news.qsize())]
    assert [type(item) for item in told if not isinstance(item, BusDisturbed)] == [BusFailed, BusBack]


def test_a_node_that_babbles_cannot_keep_the_cycle(request: pytest.FixtureRequest) -> None:
    with port_and_peer(request) as (port, peer, got):
        send(peer, *[TPDO] * 1000)
        port.take()
        first = len(ids(got))
        assert 0 < first < 1000
        port.take()
        assert first + len(ids(got)) == 1000


@pytest.mark.parametrize("attended", [False, True])
def test_a_bus_that_cannot_be_read_any_more_is_told_and_opened_again(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch, attended: bool
) -> None:
    def gone(_bus: can.BusABC, _timeout: float | None = None) -> None:
        raise can.CanOperationError("the adapter was unplugged")

    monkeypatch.setattr("drive_gateway.gateway.bus.steady_bus.REOPEN_S", 0.0)
    got: SimpleQueue[CanFrame] = SimpleQueue()
    news: SimpleQueue[BusNews] = SimpleQueue()
    settings = BusSettings("virtual", request.node.name, 1_000_000, {})
    with can.Bus(interface="virtual", channel=request.node.name) as peer, BusPort(settings, got.put, news.put) as port:
        with monkeypatch.context() as unplugged, port.attend() if attended else nullcontext():
            unplugged.setattr("can.interfaces.virtual.VirtualBus.recv", gone)
            port.take()
            assert news.get(timeout=DEADLINE_S) == BusFailed("the adapter was unplugged")
        deadline = time.monotonic() + DEADLINE_S
        while news.empty() and time.monotonic() < deadline:
            port.take()
            port.send(CanFrame(SYNC, b""))
        assert news.get_nowait() == BusBack()
        send(peer, TPDO)
        while got.empty() and time.monotonic() < deadline:
            port.take()
        assert ids(got) == [TPDO]


def test_a_second_master_is_told(request: pytest.FixtureRequest) -> None:
    got: SimpleQueue[CanFrame] = SimpleQueue()
    news: SimpleQueue[BusNews] = SimpleQueue()
    settings = BusSettings("virtual", request.node.name, 1_000_000, {})
    with can.Bus(interface="virtual", channel=request.node.name) as peer, BusPort(settings, got.put, news.put) as port:
        port.send(CanFrame(SYNC, b""))
        send(peer, SYNC, SYNC)
        port.take()
        assert news.get_nowait() == SecondMaster("somebody else sends 080h, which only this gateway may")
        assert news.empty()
        port.send(CanFrame(0x601, bytes(8)))
        send(peer, 0x601)
        port.take()
        told = news.get_nowait()
        assert isinstance(told, BusDisturbed), "an SDO commands no motion"
        assert "somebody else sends 601h" in told.text


def test_a_new_drive_with_the_gateways_own_node_id_is_no_second_master(request: pytest.FixtureRequest) -> None:
    got: SimpleQueue[CanFrame] = SimpleQueue()
    news: SimpleQueue[BusNews] = SimpleQueue()
    settings = BusSettings("virtual", request.node.name, 1_000_000, {})
    with can.Bus(interface="virtual", channel=request.node.name) as peer, BusPort(settings, got.put, news.put) as port:
        port.send(CanFrame(0x77F, b"\5"))
        for state in (0x00, 0x7F):
            peer.send(can.Message(arbitration_id=0x77F, data=[state], is_extended_id=False))
        port.take()
        told = news.get_nowait()
        assert isinstance(told, BusDisturbed)
        assert "a node has Node-ID 127, the gateway's own: give it another one" in told.text
        assert news.empty()
        peer.send(can.Message(arbitration_id=0x77F, data=[5], is_extended_id=False))
        port.take()
        assert isinstance(news.get_nowait(), SecondMaster), "a master is Operational"


def test_the_bits_of_all_frames_are_counted_whoever_sends_them_and_whatever_they_are(
    request: pytest.FixtureRequest,
) -> None:
    with port_and_peer(request) as (port, peer, _):
        port.send(CanFrame(SYNC, b""))
        port.send(CanFrame(RPDO, bytes(8)))
        peer.send(can.Message(arbitration_id=TPDO, data=bytes(6), is_extended_id=False))
        peer.send(can.Message(arbitration_id=TPDO, data=b"", is_extended_id=True))
        port.take()
        # Worst case of the wire with 0, 8, 6 bytes, and 0 after a 29-bit identifier (Davis et al. 2007, eq. 1).
        assert port.bits == 55 + 135 + 115 + 80
