"""Every command explains itself, and a user's mistake never ends in a traceback."""

import itertools
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click.testing
import pytest
import typer
from typer.testing import CliRunner

from cell.commands import cell_command, drive_gateway_command, robot_agent_command
from cell.commands.subcommands import explained
from tests.unit.repository import ROOT

APPS = {"cell": cell_command.app, "robot-agent": robot_agent_command.app, "drive-gateway": drive_gateway_command.app}
MODULES = {"cell": "main", "robot-agent": "robot_agent", "drive-gateway": "drive_gateway"}


def command_paths(app: typer.Typer) -> Iterator[tuple[str, ...]]:
    """The words of every command of `app`, the empty tuple for itself."""
    yield ()
    command = typer.main.get_command(app)
    for name in sorted(getattr(command, "commands", {})):
        yield (name,)
        for below in sorted(getattr(command.commands[name], "commands", {})):
            yield (name, below)


ALL = [(tool, words) for tool, app in APPS.items() for words in command_paths(app)]


@pytest.mark.parametrize(("tool", "words"), ALL, ids=[" ".join((tool, *words)) for tool, words in ALL])
def test_help_shows_an_example(tool: str, words: tuple[str, ...]) -> None:
    result = CliRunner().invoke(APPS[tool], [*words, "--help"])
    assert result.exit_code == 0
    assert "Example: " in result.output


@pytest.mark.parametrize(("tool", "words"), ALL, ids=[" ".join((tool, *words)) for tool, words in ALL])
def test_help_is_as_wide_as_the_terminal(tool: str, words: tuple[str, ...]) -> None:
    """Every word of the text that would still fit on a line stands on it."""
    width = 90
    command = explained(APPS[tool]) if tool != "cell" else typer.main.get_command(APPS[tool])
    result = click.testing.CliRunner().invoke(command, [*words, "--help"], env={"COLUMNS": str(width)})
    text = result.output.split("╭")[0].split("\n\n", 2)[-1]
    for paragraph in re.split(r"\n *\n", text):
        lines = [line.strip() for line in paragraph.strip().splitlines()]
        ragged = [
            line for line, after in itertools.pairwise(lines) if len(line) + 1 + len(after.split()[0]) <= width - 2
        ]
        assert ragged == []


@pytest.mark.parametrize("name", ["cell.yaml", "my cell's file.yaml"])
def test_a_recommended_command_names_the_file_as_a_shell_takes_it(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_text((ROOT / "cell_configs/two_arms/cell.yaml").read_text().replace("127.0.0.1:745", "127.0.0.1:1"))
    result = complaint("cell", "status", "-f", str(file))
    commands = re.findall(r"cell up .*(?=, or)", result.stderr)
    assert [shlex.split(command) for command in commands] == [["cell", "up", str(file)]]


def complaint(tool: str, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", f"cell.commands.{MODULES[tool]}", *words],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
        stdin=subprocess.DEVNULL,
    )


@pytest.mark.parametrize(
    ("tool", "words"),
    [
        ("cell", ("up", "missing.yaml")),
        ("cell", ("manager", "missing.yaml")),
        ("cell", ("status",)),
        ("cell", ("estop", "-f", "missing.yaml")),
        ("robot-agent", ("missing.yaml", "left")),
        ("drive-gateway", ("run", "missing.yaml", "left_bus")),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else value,
)
def test_a_missing_cell_file_is_named_with_the_next_step(tool: str, words: tuple[str, ...]) -> None:
    result = complaint(tool, *words)
    assert result.returncode == 1
    assert ".yaml: no such cell file" in result.stderr
    assert "next: " in result.stderr
    assert "Traceback" not in result.stderr + result.stdout


def test_a_wrong_command_line_is_exit_code_2() -> None:
    result = complaint("cell", "run")
    assert result.returncode == 2
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize("tool", MODULES)
def test_nothing_is_imported_before_ctrl_c_is_in_good_hands(tool: str) -> None:
    """A Ctrl-C in the most of a second that the imports take would otherwise end in a traceback."""
    lines = f"import sys; import cell.commands.{MODULES[tool]}; print(*sorted(sys.modules))"
    imported = subprocess.run(
        [sys.executable, "-c", lines], cwd=ROOT, capture_output=True, text=True, timeout=60, check=True
    ).stdout.split()
    assert {name for name in imported if name.startswith("cell")} == {
        "cell",
        "cell.commands",
        "cell.commands.start",
        f"cell.commands.{MODULES[tool]}",
    }
    assert "numpy" not in imported


def test_an_emergency_stop_that_cannot_be_sent_points_to_the_hard_wired_one(tmp_path: Path) -> None:
    broken = tmp_path / "cell.yaml"
    broken.write_text("cell: [")
    result = complaint("cell", "estop", "-f", str(broken))
    assert result.returncode == 1
    assert "NO emergency stop was sent" in result.stderr
    assert "next: use the hard-wired emergency stop" in result.stderr


@pytest.mark.parametrize("words", [["left", "-50"], ["left", "-.5"], ["left", "-12.5", "--connect", "x"]])
def test_a_number_below_zero_is_no_option(tmp_path: Path, words: list[str]) -> None:
    """As events tell people to type it: they ask for no `--` before it, and options may follow."""
    result = CliRunner().invoke(cell_command.app, ["override", *words, "-f", str(tmp_path / "none.yaml")])
    assert "none.yaml" in str(result.exception) + result.output
    assert "No such option" not in result.output
