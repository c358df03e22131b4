"""Encoder, homing and EDS of an axis in the drives file."""

import math
from pathlib import Path

import pytest
from config_world import DRIVES, Copy

from cell.config import ConfigError
from drive_gateway.config import load_drives

OLD = "following_window: 3, following_time_s: 0.1, simulated_start: 0}\n      J2:"
HOMING = "homing: {method: 17, fast: 10, slow: 1, acceleration: 100, position: -170, order: 2}"


def copy_with(folder: Path, keys: str) -> Copy:
    return Copy(folder).change(DRIVES, OLD, OLD.replace("0}\n", f"0, {keys}}}\n"))


def test_an_incremental_axis_says_how_it_homes(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, f"encoder: incremental, {HOMING}")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert axis.incremental
    assert axis.homing is not None
    assert (axis.homing.method, axis.homing.order) == (17, 2)
    assert axis.homing.position == pytest.approx(math.radians(-170))


def test_an_eds_is_looked_for_beside_the_drives_file(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, "eds: my.eds")
    (copy.drives.parent / "my.eds").write_text("")
    axis = load_drives(copy.drives, "left_bus").robots["left"].axes[0]
    assert Path(axis.eds) == copy.drives.parent / "my.eds"


@pytest.mark.parametrize(
    ("keys", "problem"),
    [
        ("encoder: incremental", "encoder: found incremental without homing, allowed homing beside it, or absolute"),
        ("eds: nowhere.eds", "eds: found no file 'nowhere.eds', allowed an EDS or DCF file beside this one"),
        (HOMING.replace("slow: 1", "slow: 20"), "homing.slow: found 20, allowed 10 or less"),
        (HOMING.replace("fast: 10", "fast: 200"), "homing.fast: found 200, allowed 121 or less"),
    ],
)
def test_each_mistake_is_one_line_at_its_place(tmp_path: Path, keys: str, problem: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy_with(tmp_path, keys).drives, "left_bus")
    assert [str(line).partition(": robots.left.axes.J1.")[2] for line in caught.value.problems] == [problem]
