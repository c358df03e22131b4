"""However a good configuration is spoilt: problems with an address, never another exception."""

import random
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruamel.yaml import YAML

from cell.commands.checks import check_cell
from cell.config import Severity
from tests.unit.config_world import CELL, DRIVES, ROBOT, Copy

ODD_VALUES = [
    None,
    True,
    -1,
    0,
    3,
    10**30,
    10**400,
    1e308,
    5e-324,
    1e9,
    1.5,
    float("nan"),
    float("inf"),
    "",
    "text",
    "\0",
    "tcp/a:1",
    [],
    [1],
    {},
    {"X": 1},
]


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Copy:
    return Copy(tmp_path_factory.mktemp("mutations"))


def _nodes(value: object) -> list[object]:
    """All mappings and lists that hold something."""
    children = value.values() if isinstance(value, dict) else value if isinstance(value, list) else []
    own = [value] if isinstance(value, dict | list) and value else []
    return own + [node for child in children for node in _nodes(child)]


def _spoil(tree: object, rng: random.Random) -> None:
    """Drop, rename or replace one thing anywhere."""
    node = rng.choice(_nodes(tree))
    key = rng.choice(list(node) if isinstance(node, dict) else list(range(len(node))))
    match rng.choice(("drop", "rename", "replace")):
        case "drop":
            del node[key]
        case "rename" if isinstance(node, dict):
            node[rng.choice(["", "x", "Ä", f"{key}2", "J9", "0"])] = node.pop(key)
        case _:
            node[key] = rng.choice(ODD_VALUES)


@settings(max_examples=20, deadline=None)
@given(name=st.sampled_from([CELL, ROBOT, DRIVES]), seed=st.integers(0, 2**32), count=st.integers(1, 4))
def test_a_spoilt_file_gives_problems_with_an_address_and_nothing_else(
    copy: Copy, name: str, seed: int, count: int
) -> None:
    file = copy.folder / name
    good = file.read_text()
    yaml = YAML(typ="safe", pure=True)
    tree, rng = yaml.load(good), random.Random(seed)
    for _ in range(count):
        _spoil(tree, rng)
    try:
        with file.open("w") as out:
            yaml.dump(tree, out)
        bundle, problems = check_cell(copy.cell)
    finally:
        file.write_text(good)
    assert (bundle is None) == any(problem.severity is Severity.ERROR for problem in problems)
    for problem in problems:
        assert isinstance(problem.file, Path)
        assert problem.line >= 1
        assert problem.column >= 1
        assert "\n" not in str(problem)


@settings(max_examples=20, deadline=None)
@given(name=st.sampled_from([CELL, ROBOT, DRIVES]), start=st.floats(0, 1), length=st.integers(1, 30))
def test_a_hole_in_the_text_gives_problems_and_nothing_else(copy: Copy, name: str, start: float, length: int) -> None:
    file = copy.folder / name
    good = file.read_text()
    at = int(start * len(good))
    try:
        file.write_text(good[:at] + good[at + length :])
        bundle, problems = check_cell(copy.cell)
    finally:
        file.write_text(good)
    assert bundle is not None or problems


MOST_NUMBERS = 20
"""Of longer files every few numbers will do: most keys are there for each axis."""
NUMBERS = ["1e308", "-1e308", "5e-324", "1" + "0" * 400, "1e9", "-1e9", "1e-9", "0", "-0.0"]


@pytest.mark.parametrize("name", [CELL, ROBOT, DRIVES])
def test_no_number_is_too_large_or_too_small_to_be_judged(copy: Copy, name: str) -> None:
    file = copy.folder / name
    good = file.read_text()
    numbers = [match.span(1) for match in re.finditer(r"(?<=[\[:,] )(-?\d+(?:\.\d+)?)(?=[\],}\s])", good)]
    try:
        for index, (start, end) in enumerate(numbers[:: 1 + len(numbers) // MOST_NUMBERS]):
            file.write_text(good[:start] + NUMBERS[index % len(NUMBERS)] + good[end:])
            bundle, problems = check_cell(copy.cell)
            assert bundle is not None or problems
    finally:
        file.write_text(good)
