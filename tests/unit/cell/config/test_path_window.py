"""How far from its path a stopped robot may continue, as the cell file says it."""

from math import radians
from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.config import load_cell
from cell.config.settings import PathWindow
from tests.unit.config_world import CONFIGS, Copy

CELL = "two_arms/cell.yaml"
PROGRAM = "program: programs/left.prog"


def test_window_is_in_the_units_of_the_file_and_has_a_default(tmp_path: Path) -> None:
    wide = Copy(tmp_path).change(CELL, PROGRAM, f"{PROGRAM}\n    path_window: {{turn: 2}}").folder / CELL
    robots = load_cell(wide).robots
    assert robots["left"].path_window == PathWindow(pytest.approx(radians(2.0)), 0.001)
    assert robots["right"].path_window == PathWindow(radians(0.5), 0.001)
    assert load_cell(wide).digest != load_cell(CONFIGS / CELL).digest


@pytest.mark.parametrize("window", ["turn: 5.1", "slide: 21", "turn: 0"])
def test_window_is_small(window: str, tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(CELL, PROGRAM, f"{PROGRAM}\n    path_window: {{{window}}}")
    _, problems = check_cell(copy.folder / CELL)
    assert [str(problem) for problem in problems if f"path_window.{window.split(':')[0]}" in str(problem)] != []
