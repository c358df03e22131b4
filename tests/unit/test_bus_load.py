"""The load of the wire: frames counted by hand, and where the limits lie."""

import pytest

from drive_gateway.canopen.pdo_map import process_image
from drive_gateway.config.bus_load import bus_load

# Bits with worst-case stuffing (47 + 8n + floor((33 + 8n) / 4)): SYNC 55, six-byte PDO 115, heartbeat 65.
SYNC, PDO, HEARTBEAT = 55, 115, 65

SIX = [process_image(node) for node in range(1, 7)]


def test_six_drives_at_250_hz_and_1_mbit_are_sync_twelve_pdos_and_seven_heartbeats() -> None:
    per_second = 250 * (SYNC + 12 * PDO) + 10 * 7 * HEARTBEAT
    assert bus_load(SIX, 1_000_000, 0.004, 0.1).cyclic == pytest.approx(per_second / 1_000_000)


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
