"""Units of a drive's speeds and ramps, as the drives file says them and as 60A9h and 60AAh do."""

from pathlib import Path

import pytest

from drive_gateway.config import load_drives
from drive_gateway.config.drive_units import COUNTS, drive_units
from tests.unit.config_world import DRIVES, Copy

PER_TURN, PER_METRE = 4096, 200_000.0


@pytest.mark.parametrize(
    ("velocity", "code"),
    [
        ("rpm", 0x00B44700),
        ("0.1 rpm", 0xFFB44700),
        ("0.001 rpm", 0xFDB44700),
        ("rev/s", 0x00B40300),
        ("counts/s", 0x00B50300),
        ("deg/s", 0x00410300),
        ("rad/s", 0x00100300),
        ("mm/s", 0xFD010300),
        ("m/s", 0x00010300),
    ],
)
def test_a_unit_of_the_file_is_that_of_60a9h(velocity: str, code: int) -> None:
    units = drive_units(velocity, "counts/s^2", PER_TURN, PER_METRE)
    assert units.shown_velocity(code) == pytest.approx(units.velocity)


@pytest.mark.parametrize(
    ("acceleration", "code"),
    [
        ("rpm/s", 0x00C00300),
        ("0.1 rpm/s", 0xFFC00300),
        ("counts/s^2", 0x00B55700),
        ("deg/s^2", 0x00415700),
        ("mm/s^2", 0xFD015700),
    ],
)
def test_a_unit_of_the_file_is_that_of_60aah(acceleration: str, code: int) -> None:
    units = drive_units("counts/s", acceleration, PER_TURN, PER_METRE)
    assert units.shown_acceleration(code) == pytest.approx(units.acceleration)


@pytest.mark.parametrize("code", [0, 0x00AC0300, 0x00B40000, 0x00B45700])
def test_a_drive_that_says_no_unit_that_is_known_says_nothing(code: int) -> None:
    assert drive_units("rpm", "rpm/s", PER_TURN, 0.0).shown_velocity(code) is None


def test_speeds_are_the_nearest_whole_numbers_of_the_unit() -> None:
    units = drive_units("rpm", "rpm/s", PER_TURN, 0.0)
    assert units.speed(PER_TURN * 100.4 / 60.0) == 100
    assert units.ramp(PER_TURN * 10.6) == 636
    assert COUNTS.speed(-12.4) == -12


def test_a_length_is_no_unit_of_an_axis_that_turns() -> None:
    with pytest.raises(ValueError, match="an axis that turns"):
        drive_units("mm/s", "counts/s^2", PER_TURN, 0.0)


@pytest.mark.parametrize("units", ["velocity_unit: rpm, acceleration_unit: rpm/s", "acceleration_unit: 0.1 rpm/s"])
def test_turns_of_the_shaft_are_units_of_an_axis_that_turns(tmp_path: Path, units: str) -> None:
    """The letters m/s at the end of rpm/s are no length."""
    copy = Copy(tmp_path).change(DRIVES, "{node: 1, gear: 180", f"{{{units}, node: 1, gear: 180")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert axis.units.acceleration_name in units
