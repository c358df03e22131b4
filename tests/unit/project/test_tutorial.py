"""`docs/tutorial.md`: the files, program lines, commands and options that it names are there."""

import re
import shlex

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.config.load import load_cell
from tests.unit.repository import ROOT

CELL = ROOT / "cell_configs" / "pick_and_place"
PAGE = (ROOT / "docs" / "tutorial.md").read_text()
COMMANDS = [
    line
    for block in re.findall(r"^```\n(.*?)^```", PAGE, re.M | re.S)
    for line in block.splitlines()
    if line.startswith("cell ")
]


def test_the_files_that_it_names_are_those_of_the_cell() -> None:
    named = set(re.findall(r"`([\w./]+\.(?:yaml|prog))`", PAGE.split("**`cell.yaml`**")[0]))
    assert named == {str(path.relative_to(CELL)) for path in CELL.rglob("*") if path.suffix in (".yaml", ".prog")}
    for link in re.findall(r"\]\((\w+\.md)\)", PAGE):
        assert (ROOT / "docs" / link).exists(), link


def test_the_program_lines_that_it_explains_are_in_the_program() -> None:
    program = (CELL / "programs" / "left.prog").read_text()
    table = PAGE.split("## The program of the left arm")[1].split("##")[0]
    rows = [row.split(" | ")[0] for row in table.splitlines() if row.startswith("| `")]
    named = [words for row in rows for words in re.findall("`(.*?)`", row)]
    assert len(named) > 10
    assert [words for words in named if not re.search(rf"^{re.escape(words)}\s*(;.*)?$", program, re.M)] == []


@pytest.mark.parametrize("command", sorted(set(COMMANDS)))
def test_its_commands_and_their_options_exist(command: str) -> None:
    words = shlex.split(command)[1:]
    path = words[:2] if words[0] in ("simulate", "frame") else words[:1]
    shown = CliRunner().invoke(app, [*path, "--help"], env={"COLUMNS": "200", "NO_COLOR": "1"})
    assert shown.exit_code == 0, shown.output
    for option in (word for word in words if word.startswith("--")):
        assert option in shown.output


def test_its_robots_points_and_frames_are_those_of_the_cell() -> None:
    cell = load_cell(CELL / "cell.yaml")
    assert set(cell.frames) == {"tray", "stand"}
    assert set(cell.meetings) == {"laid", "taken"}
    assert set(cell.zones) == {"handover"}


def test_the_cell_is_good() -> None:
    result = CliRunner().invoke(app, ["check", str(CELL / "cell.yaml")], env={"COLUMNS": "200"})
    assert result.exit_code == 0, result.output
