"""The bus inside the gateway's process: it is computed by whoever reads, and others on its channel miss nothing."""

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from uuid import uuid4

import can
import pytest

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.stuffing import exact_bits
from drive_gateway.config.settings import BusSettings, GatewaySettings
from drive_gateway.sim.config.simulation import Level, Simulation
from drive_gateway.sim.inner_bus import InnerBus
from tests.unit.gateway_world import gateway_settings
from tests.unit.sim_drive_world import AXIS, NODE

DEADLINE_S = 20.0
ON_THE_WIRE = Simulation(wire_time=True)
BITRATE = 10_000
"""[bit/s] So slow that the wire is seen."""
READ_TYPE = can.Message(arbitration_id=0x600 + NODE, data=bytes.fromhex("4000100000000000"), is_extended_id=False)


def settings(bitrate: int = 1_000_000) -> GatewaySettings:
    bus = BusSettings("virtual", f"test-{uuid4()}", bitrate, {})
    return gateway_settings((AXIS,), name="left_bus", bus=bus)


@pytest.fixture
def bus() -> Iterator[InnerBus]:
    with InnerBus(settings(), ON_THE_WIRE) as bus:
        until(bus, lambda message: message.arbitration_id == 0x700 + NODE)
        yield bus


def until(bus: can.BusABC, wanted: Callable[[can.Message], bool]) -> can.Message:
    """The first such frame."""
    deadline = time.monotonic() + DEADLINE_S
    while time.monotonic() < deadline:
        message = bus.recv(0.1)
        if message is not None and wanted(message):
            return message
    raise AssertionError("deadline passed")


def answers(message: can.Message) -> bool:
    return message.arbitration_id == 0x580 + NODE


def test_a_drive_answers_whoever_reads(bus: InnerBus) -> None:
    bus.send(READ_TYPE)
    assert until(bus, answers).data[:4] == bytes.fromhex("43001000")


def test_nothing_comes_without_a_question_but_what_drives_send_by_themselves(bus: InnerBus) -> None:
    assert bus.recv(0.0) is None
    before = time.monotonic()
    assert bus.recv(0.05) is None
    assert time.monotonic() - before >= 0.05


def test_frames_take_their_time_on_the_wire() -> None:
    with InnerBus(settings(BITRATE), ON_THE_WIRE) as bus:
        until(bus, lambda message: message.arbitration_id == 0x700 + NODE)
        sent = time.monotonic()
        bus.send(READ_TYPE)
        until(bus, answers)
        least = 2 * exact_bits(CanFrame(0x600 + NODE, bytes(READ_TYPE.data))) / BITRATE
        assert time.monotonic() - sent >= 0.9 * least


def test_another_handle_of_the_channel_hears_both_sides_and_is_heard(bus: InnerBus) -> None:
    with can.Bus(interface="virtual", channel=bus.channel_id) as peer:
        bus.send(READ_TYPE)
        until(bus, answers)
        assert until(peer, lambda message: message.arbitration_id == READ_TYPE.arbitration_id).data == READ_TYPE.data
        until(peer, answers)
        peer.send(READ_TYPE)
        until(bus, lambda message: message.arbitration_id == READ_TYPE.arbitration_id)
        until(bus, answers)
        until(peer, answers)


def test_it_fits_a_bus_that_nobody_else_can_be_on_and_drives_that_are_soon_computed() -> None:
    inside = settings()
    assert InnerBus.fits(inside, ON_THE_WIRE)
    assert not InnerBus.fits(replace(inside, bus=replace(inside.bus, interface="udp_multicast")), ON_THE_WIRE)
    assert not InnerBus.fits(inside, replace(ON_THE_WIRE, level=Level.FULL))
