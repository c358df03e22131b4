"""Counts and back, and the values a drive is prepared with."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_gateway.cia402.preparation import interpolation_period, preparations, supervision
from drive_gateway.cia402.units import AxisUnits
from drive_gateway.config.settings import INT32_MAX
from tests.unit.gateway_world import axis, gateway_settings

AXES = (axis("J1", 1), axis("J2", 2, counts_per_unit=-12345.678, offset=-1.5))
UNITS = AxisUnits(AXES)


@given(st.lists(st.integers(-(2**31), 2**31 - 1), min_size=2, max_size=2))
def test_counts_survive_the_way_to_positions_and_back(counts: list[int]) -> None:
    assert UNITS.counts(UNITS.position(counts)) == counts


@given(st.lists(st.floats(-10.0, 10.0), min_size=2, max_size=2))
def test_a_position_becomes_its_nearest_count(position: list[float]) -> None:
    back = UNITS.position(UNITS.counts(np.array(position)))
    assert np.all(np.abs(back - position) <= 0.5001 / np.array([200_000.0, 12345.678]))


def test_the_bounds_are_those_of_an_int32() -> None:
    counts = UNITS.counts(UNITS.highest)
    assert counts[0] == INT32_MAX
    assert UNITS.lowest[1] < UNITS.highest[1]


@pytest.mark.parametrize(
    ("cycle_s", "period"), [(0.004, (4, -3)), (0.01, (10, -3)), (0.0025, (25, -4)), (0.000125, (125, -6))]
)
def test_the_cycle_is_written_as_value_and_power_of_ten(cycle_s: float, period: tuple[int, int]) -> None:
    assert interpolation_period(cycle_s) == period


def test_a_cycle_that_no_drive_knows_is_refused() -> None:
    with pytest.raises(ValueError, match="allowed are 1 to 255"):
        interpolation_period(1 / 300)


def test_a_drive_is_prepared_in_its_own_units() -> None:
    settings = gateway_settings()
    prepared = [*supervision(AXES[0], settings), *preparations(AXES[0], settings)]
    written = {(item.write.index, item.write.sub): item.write.data for item in prepared}
    assert written == {
        (0x1017, 0): (50).to_bytes(2, "little"),
        (0x1016, 1): (127 << 16 | 200).to_bytes(4, "little"),
        (0x60C2, 1): b"\x04",
        (0x60C2, 2): b"\xfd",
        (0x6060, 0): b"\x08",
        (0x6085, 0): (8_000_000).to_bytes(4, "little"),
        (0x605A, 0): b"\x06\x00",
        (0x6007, 0): b"\x03\x00",
        (0x6065, 0): (10_000).to_bytes(4, "little"),
        (0x6066, 0): (50).to_bytes(2, "little"),
    }
