"""The load of the wire: frames counted by hand, and where the limits lie."""

from typing import Any

import pytest

from drive_gateway.canopen.bus_load import cyclic_load, frame_bits
from drive_gateway.canopen.pdo_map import process_image
from drive_gateway.config.bus_load import bus_load
from tests.unit.repository import vectors

# Bits with worst-case stuffing (47 + 8n + floor((33 + 8n) / 4)): SYNC 55, six-byte PDO 115, heartbeat 65.
SYNC, PDO, HEARTBEAT = 55, 115, 65

VECTORS = vectors("bus_loads.json")
SIX = [process_image(node) for node in range(1, 7)]


def test_six_drives_at_250_hz_and_1_mbit_are_sync_twelve_pdos_and_seven_heartbeats() -> None:
    per_second = 250 * (SYNC + 12 * PDO) + 10 * 7 * HEARTBEAT
    assert bus_load(SIX, 1_000_000, 0.004, 0.1).cyclic == pytest.approx(per_second / 1_000_000)


@pytest.mark.parametrize(("size", "bits"), VECTORS["bits"])
def test_frames_are_at_most_as_long_as_worked(size: int, bits: int) -> None:
    assert frame_bits(size) == bits


@pytest.mark.parametrize("cycle", VECTORS["cycles"], ids=lambda cycle: cycle["what"])
def test_a_cycle_needs_the_worked_bits(cycle: dict[str, Any]) -> None:
    pdo_bits = cycle["pdos"] * frame_bits(cycle["bytes"])
    assert 1e6 * cyclic_load(6, 1_000_000, 1.0, 1e12, pdo_bits) == pytest.approx(cycle["bits"])


@pytest.mark.parametrize(("bitrate", "hertz", "percent"), VECTORS["percent"])
def test_twelve_pdos_of_8_bytes_load_the_wire_as_worked(bitrate: int, hertz: float, percent: float) -> None:
    load = cyclic_load(6, bitrate, 1.0 / hertz, 1e12, 12 * frame_bits(8))
    assert 100.0 * load == pytest.approx(percent, abs=0.5)


def test_a_torque_offset_makes_the_frame_of_the_velocity_offset_longer() -> None:
    # One more frame of six bytes per axis instead of one of four.
    both = [process_image(node, velocity_offset=True, torque_offset=True) for node in range(1, 7)]
    added = bus_load(both, 1_000_000, 0.004, 0.1).cyclic - bus_load(SIX, 1_000_000, 0.004, 0.1).cyclic
    assert added == pytest.approx(250 * 6 * PDO / 1_000_000)


def test_a_tenth_of_the_wire_is_kept_for_sdo_and_emcy() -> None:
    load = bus_load(SIX, 1_000_000, 0.004, 0.1)
    assert load.total == pytest.approx(load.cyclic + 0.1)


@pytest.mark.parametrize(
    ("bitrate", "cycle_s", "high", "refused"),
    [
        (1_000_000, 0.01, False, False),
        (1_000_000, 0.004, False, False),
        (1_000_000, 0.0025, False, False),
        (1_000_000, 0.0022, True, False),
        (1_000_000, 0.002, True, True),
        (1_000_000, 0.001, True, True),
        (500_000, 0.01, False, False),
        (500_000, 0.004, True, True),
    ],
)
def test_above_70_percent_is_high_and_above_80_refused(bitrate: int, cycle_s: float, high: bool, refused: bool) -> None:
    load = bus_load(SIX, bitrate, cycle_s, 0.1)
    assert (load.high, load.refused) == (high, refused)
