"""Meanings of a type of drive's own emergency codes in the drives file."""

from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.config import load_drives
from tests.unit.config_world import DRIVES, Copy

TABLE = 'emergencies: {cmmp: {"FF01": {meaning: pump stands, remedy: look at it}}}'


def copy_with(folder: Path, table: str, name: str) -> Copy:
    copy = Copy(folder).add(DRIVES, table)
    return copy.change(DRIVES, "{node: 1, gear: 180", f"{{emergencies: {name}, node: 1, gear: 180")


def test_an_axis_has_the_table_of_its_type(tmp_path: Path) -> None:
    axes = load_drives(copy_with(tmp_path, TABLE, "cmmp").drives, "left_bus").robots["left"].axes
    assert axes[0].emergencies == {0xFF01: ("pump stands", "look at it")}
    assert axes[1].emergencies == {}


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
