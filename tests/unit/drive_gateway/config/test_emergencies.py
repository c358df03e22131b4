"""Meanings of a type of drive's own emergency codes in the drives file."""

from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.canopen.emcy import meaning_of
from drive_gateway.config import load_drives
from tests.unit.config_world import DRIVES, Copy

TABLE = 'emergencies: {cmmp: {"FF01": {meaning: pump stands, remedy: look at it}}}'
SEVERITIES = 'emergencies: {cmmp: {"8110": {severity: warning}, "8120": {severity: fault}, "FF01": {meaning: hot}}}'


def copy_with(folder: Path, table: str, name: str) -> Copy:
    copy = Copy(folder).add(DRIVES, table)
    return copy.change(DRIVES, "{node: 1, gear: 180", f"{{emergencies: {name}, node: 1, gear: 180")


def test_an_axis_has_the_table_of_its_type(tmp_path: Path) -> None:
    axes = load_drives(copy_with(tmp_path, TABLE, "cmmp").drives, "left_bus").robots["left"].axes
    assert axes[0].emergencies == {0xFF01: ("pump stands", "look at it", True)}
    assert axes[1].emergencies == {}


def test_a_table_says_which_codes_stop_the_robot_and_the_rest_is_as_the_standard_has_it(tmp_path: Path) -> None:
    axes = load_drives(copy_with(tmp_path, SEVERITIES, "cmmp").drives, "left_bus").robots["left"].axes
    table = axes[0].emergencies
    assert {code: meaning.stops for code, meaning in table.items()} == {0x8110: False, 0x8120: True, 0xFF01: True}
    assert table[0x8110][:2] == meaning_of(0x8110)[:2]
    assert table[0xFF01] == ("hot", meaning_of(0xFF01).remedy, True)
    assert not meaning_of(0x8120).stops


@pytest.mark.parametrize(
    ("table", "found"),
    [
        (TABLE.replace("cmmp", "other"), "J1.emergencies: found 'cmmp', allowed a table of emergencies: other"),
        ("# none", "J1.emergencies: found 'cmmp', allowed none: the file has no emergencies"),
        (TABLE.replace("FF01", "0010"), "emergencies.cmmp"),
    ],
)
def test_a_table_that_is_not_there_or_a_code_that_is_none_is_refused(tmp_path: Path, table: str, found: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_drives(copy_with(tmp_path, table, "cmmp").drives, "left_bus")
    assert found in str(caught.value)
