"""An endless axis in the drives file."""

from math import tau
from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.config import load_drives
from tests.unit.config_world import DRIVES, Copy

OLD = "{node: 1, gear: 180"
SLOW = "tpdo_timeout_s: "


def copy_with(folder: Path, keys: str, gear: str = "180") -> Copy:
    return Copy(folder).change(DRIVES, OLD, f"{{endless: true, {keys}node: 1, gear: {gear}")


def mistakes(copy: Copy) -> list[str]:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy.drives, "left_bus")
    return [str(line).partition(": robots.left.axes.J1.")[2] for line in caught.value.problems]


def test_its_turn_is_counted_through_the_gear(tmp_path: Path) -> None:
    axis = load_drives(copy_with(tmp_path, "").drives, "left_bus").robots["left"].axes[0]
    assert axis.modulus == 131072 * 180
    assert axis.modulus == pytest.approx(axis.counts_per_unit * tau)
    assert axis.wrapped(-1) == axis.modulus - 1
    assert axis.nearest(5, to=axis.modulus - 5) == axis.modulus + 5
    assert axis.nearest(axis.modulus - 5, to=5) == -5


@pytest.mark.parametrize(
    ("keys", "gear", "problem"),
    [
        ("limits: [-170, 170], ", "180", "endless: found an endless axis with limits, allowed a rotary axis without"),
        (
            "",
            "180.000001",
            "endless: found 131072 counts times a gear of 180 in a turn, allowed a whole number of counts",
        ),
        ("", "18000", "endless: found 131072 counts times a gear of 18000 in a turn, allowed a whole number of counts"),
    ],
)
def test_each_mistake_is_told(tmp_path: Path, keys: str, gear: str, problem: str) -> None:
    found = mistakes(copy_with(tmp_path, keys, gear))
    assert any(line.startswith(problem) for line in found), found


def test_a_turn_that_could_pass_unseen_is_refused(tmp_path: Path) -> None:
    copy = copy_with(tmp_path, "")
    unheard_s = float(copy.drives.read_text().split(SLOW)[1].split()[0])
    copy.change(DRIVES, "offset: 0, speed: 121,", f"offset: 0, speed: {181 / unheard_s:g},")
    assert any(f"allowed {180 / unheard_s:g} or less, half a turn within" in line for line in mistakes(copy))
