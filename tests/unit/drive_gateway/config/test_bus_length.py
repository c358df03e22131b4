"""Lengths of a bus against its bit rate."""

from pathlib import Path

import pytest

from cell.config import ConfigError
from drive_gateway.config import load_drives
from drive_gateway.config.bus_length import LONGEST
from tests.unit.config_world import DRIVES, Copy
from tests.unit.repository import vectors

ROWS = vectors("bus_lengths.json")["rows"]
OLD = "bitrate: 1000000}\n\ncycle"


def test_the_table_is_that_of_the_thesis() -> None:
    assert [[rate, row.length_m, row.longest_stub_m, row.stubs_m] for rate, row in LONGEST.items()] == ROWS
    assert all(row.stubs_m == 5 * row.longest_stub_m for row in LONGEST.values())


@pytest.mark.parametrize(
    ("keys", "problems"),
    [
        ("length_m: 25, longest_stub_m: 1.5, stubs_m: 7.5", []),
        ("length_m: 26", ["bus.length_m: found 26 at 1000000 bit/s, allowed up to 25, or a bit rate of 800000 bit/s"]),
        ("longest_stub_m: 300", ["bus.longest_stub_m: found 300 at 1000000 bit/s, allowed up to 1.5"]),
        ("stubs_m: 20", ["bus.stubs_m: found 20 at 1000000 bit/s, allowed up to 7.5, or a bit rate of 500000 bit/s"]),
        ("longest_stub_m: 1.5, stubs_m: 1", ["bus.longest_stub_m: found a stub of 1.5 among stubs of 1 in all"]),
    ],
)  # fmt: skip
def test_a_bus_that_is_too_long_is_told_with_the_bit_rate_that_it_can_have(
    tmp_path: Path, keys: str, problems: list[str]
) -> None:
    copy = Copy(tmp_path).change(DRIVES, OLD, OLD.replace("}", f", {keys}}}", 1))
    found: list[str] = []
    try:
        load_drives(copy.drives, "left_bus")
    except ConfigError as error:
        found = [str(problem).partition(".yaml:")[2].partition(": ")[2] for problem in error.problems]
    assert len(found) == len(problems)
    for line, problem in zip(found, problems, strict=True):
        assert line.startswith(problem)
