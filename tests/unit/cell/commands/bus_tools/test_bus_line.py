"""A tool on a bus without a gateway: it listens first, and sends nothing where somebody masters the bus."""

import threading
import time
from collections.abc import Iterator

import can
import pytest

from cell.commands.bus_tools.bus_line import BusLine
from cell.commands.bus_tools.place import BusPlace
from cell.commands.errors import CommandError
from drive_gateway.config.settings import BusSettings


@pytest.fixture
def bus(request: pytest.FixtureRequest) -> Iterator[tuple[BusPlace, can.BusABC]]:
    place = BusPlace(BusSettings("virtual", request.node.name, 1_000_000, {}))
    with can.Bus(interface="virtual", channel=request.node.name) as peer:
        yield place, peer


def repeat(peer: can.BusABC, number: int, end: threading.Event) -> None:
    """Somebody sends a frame ten times a second."""
    while not end.wait(0.1):
        peer.send(can.Message(arbitration_id=number, data=b"\5", is_extended_id=False))


@pytest.mark.parametrize(
    ("number", "what"),
    [
        (0x080, "SYNC (080h)"),
        (0x77F, "a master's heartbeat (77Fh)"),
        (0x000, "an NMT command (000h)"),
        (0x201, "a command to a drive (201h)"),
        (0x601, "access to a node's objects (601h)"),
    ],
)
def test_where_a_master_is_heard_nothing_is_sent_though_no_gateway_answers(
    bus: tuple[BusPlace, can.BusABC], number: int, what: str
) -> None:
    place, peer = bus
    end = threading.Event()
    thread = threading.Thread(target=repeat, args=(peer, number, end))
    thread.start()
    try:
        with (
            pytest.raises(CommandError, match="nothing was sent") as refused,
            BusLine(place, "drive-gateway read"),
        ):
            pass
    finally:
        end.set()
        thread.join()
    assert what in str(refused.value)
    assert peer.recv(0.0) is None


def test_what_nodes_say_by_themselves_is_no_master(bus: tuple[BusPlace, can.BusABC]) -> None:
    place, peer = bus
    for number in (0x181, 0x081, 0x701, 0x581):
        peer.send(can.Message(arbitration_id=number, data=b"\5", is_extended_id=False))
    before = time.monotonic()
    with BusLine(place, "drive-gateway read"):
        assert time.monotonic() - before >= 1.0
