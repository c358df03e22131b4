"""Encoder, homing and EDS of an axis in the drives file."""

import math
from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.canopen.axes_eds import eds_text
from drive_gateway.config import load_drives
from drive_gateway.config.settings import EncoderSettings
from tests.unit.config_world import DRIVES, Copy

OLD = "following_window: 3, following_time_s: 0.1}\n      J2:"
HOMING = "homing: {method: 17, fast: 10, slow: 1, acceleration: 100, position: -170, order: 2}"


def copy_with(folder: Path, keys: str) -> Copy:
    return Copy(folder).change(DRIVES, OLD, OLD.replace("}\n", f", {keys}}}\n"))


def test_an_incremental_axis_says_how_it_homes(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, f"encoder: incremental, {HOMING}")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert axis.incremental
    assert axis.homing is not None
    assert (axis.homing.method, axis.homing.order) == (17, 2)
    assert axis.homing.position == pytest.approx(math.radians(-170))


@pytest.mark.parametrize("method", [-128, -1, 3, 14, 22, 30, 37])
def test_every_homing_method_of_the_standard_and_of_a_maker_can_be_said(tmp_path: Path, method: int) -> None:
    copy = copy_with(tmp_path, HOMING.replace("method: 17", f"method: {method}"))
    homing = load_drives(copy.drives, "left_bus").robots["left"].axes[0].homing
    assert homing is not None
    assert homing.method == method


def test_an_axis_says_in_which_units_its_drive_takes_speeds_and_ramps(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, "velocity_unit: 0.1 rpm, acceleration_unit: deg/s^2, rest_window: 0.05")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert axis.units.velocity == pytest.approx(131072 / 600)
    assert axis.units.acceleration == pytest.approx(131072 / 360)
    assert axis.rest_window == pytest.approx(math.radians(0.05))


def test_an_absolute_axis_says_how_it_is_checked(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, 'encoder_check: {window: 0.5, serial: "2010:01", status: "2010:02", battery_mask: 1}')
    encoder = load_drives(copy.drives, "left_bus").robots["left"].axes[0].absolute
    assert encoder == EncoderSettings(131072, 32768, (0x2010, 1), (0x2010, 2), 1)
    untold = load_drives(copy.drives, "left_bus").robots["left"].axes[1].absolute
    assert untold == EncoderSettings(131072, 8192)


@pytest.mark.parametrize(
    ("method", "direction", "position"), [(17, 1, -175), (18, 1, 175), (17, -1, 175), (18, -1, -175)]
)
def test_a_limit_switch_where_homing_finds_it_is_in_si(
    tmp_path: Path, method: int, direction: int, position: int
) -> None:
    homing = HOMING.replace("method: 17", f"method: {method}").replace("-170", f"{position}")
    copy = copy_with(tmp_path, f"limits: [-170, 170], limit_switches: [-175, 175], {homing}")
    copy.change(DRIVES, "direction: 1, offset: 0, speed: 121", f"direction: {direction}, offset: 0, speed: 121")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert axis.limit_switches == pytest.approx((math.radians(-175), math.radians(175)))


def test_an_eds_is_looked_for_beside_the_drives_file(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, "eds: my.eds")
    (copy.drives.parent / "my.eds").write_text(eds_text())
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert Path(axis.eds) == copy.drives.parent / "my.eds"


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ("encoder: incremental", "encoder: found incremental without homing, allowed homing beside it, or absolute"),
        (
            "eds: nowhere.eds",
            "eds: found nowhere.eds: cannot be read: No such file or directory, allowed an EDS or DCF",
        ),
        (
            "inputs: {enable: [16], door: [16]}",
            "inputs: found bit 16 twice, allowed one or more bits, each of them once",
        ),
        ("inputs: {}", "inputs: found no bit, allowed one or more bits, each of them once"),
        ("limits: [10, -10]", "limits: found 10 to -10, allowed the lower one first"),
        (
            "limits: [-40000, 10]",
            "limits: found -40000 to 10, allowed within -32768 to 32768, 32 bits of encoder counts",
        ),
        (
            "encoder_check: {window: 2}",
            "encoder_check.window: found 2, allowed less than 1, half a turn of the motor",
        ),
        (
            'encoder_check: {status: "2010:02"}',
            "encoder_check: found no battery_mask, allowed both status and battery_mask, or none",
        ),
        (
            f"encoder: incremental, encoder_check: {{}}, {HOMING}",
            "encoder_check: found a check of an incremental encoder, allowed encoder: absolute",
        ),
        ("limit_switches: [170, -170]", "limit_switches: found 170 to -170, allowed the lower one first"),
        (
            "limits: [-170, 170], limit_switches: [-165, 175]",
            "limit_switches: found -165 to 175, allowed none within the limits, -170 to 170",
        ),
        (
            f"limit_switches: [-175, 175], {HOMING}",
            "homing.position: found -170, allowed -175, where the limit switch is that homing finds",
        ),
        (
            "limit_switches: [-175, 175], inputs: {door: [1]}",
            "inputs: found bit 0 or 1, allowed other bits: these are the limit switches",
        ),
        (HOMING.replace("method: 17", "method: 31"), "homing.method: found 31, allowed 1 to 14, 17 to 30, 33, 34, 35"),
        ("velocity_unit: furlongs", "velocity_unit: found 'furlongs', allowed one of counts/s, rpm, rev/s, deg/s"),
        ("velocity_unit: 0 rpm", "velocity_unit: found '0 rpm', allowed one of counts/s, rpm"),
        ("acceleration_unit: rpm", "acceleration_unit: found 'rpm', allowed one of counts/s^2, rpm/s"),
        ("velocity_unit: mm/s", "velocity_unit: found 'mm/s', allowed a unit of angles or counts"),
        (f"velocity_unit: 100 rpm, {HOMING}", "homing.slow: found 1, allowed 3.333 to"),
        (HOMING.replace("slow: 1", "slow: 20"), "homing.slow: found 20, allowed 10 or less"),
        (HOMING.replace("fast: 10", "fast: 200"), "homing.fast: found 200, allowed 30.25 or less, a quarter"),
        (
            HOMING.replace("acceleration: 100", "acceleration: 200"),
            "homing.acceleration: found 200, allowed 115.5 or less, a quarter",
        ),
    ],
)
def test_each_mistake_is_one_line_at_its_place(tmp_path: Path, keys: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy_with(tmp_path, keys).drives, "left_bus")
    [line] = [str(line).partition(": robots.left.axes.J1.")[2] for line in caught.value.problems]
    assert line.startswith(problem)
