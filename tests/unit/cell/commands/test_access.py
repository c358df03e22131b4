"""The level of an account: what its commands are refused for, and that nothing keeps a stop from going out."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.access import VARIABLE, granted, require
from cell.commands.cell_command import COMMANDS, app
from cell.commands.client.page_server import page_server
from cell.commands.drive_gateway_command import app as gateway_app
from cell.commands.errors import CommandError
from cell.commands.processes.process import run_process
from cell.config import load_cell
from cell.view.gate import Level
from tests.unit.config_world import TWO_ARMS
from tests.unit.repository import ROOT

DRIVES = str(TWO_ARMS.parent / "left_drives.yaml")


@pytest.fixture
def level(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv(VARIABLE, request.param)
    return str(request.param)


def refused(*words: str) -> str:
    """What a command says instead of doing anything."""
    error = CliRunner().invoke(app, words).exception
    assert isinstance(error, CommandError)
    return f"{error}; {error.next_step}"


def test_without_a_setting_everything_is_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    assert granted() is Level.CONFIGURE
    monkeypatch.setenv(VARIABLE, "")
    require(Level.CONFIGURE, "cell set")


@pytest.mark.parametrize(("level", "word"), [("watch", "run"), ("operate", "set")], indirect=["level"])
def test_an_order_above_the_level_is_refused_with_what_is_allowed_and_reaches_nobody(level: str, word: str) -> None:
    text = refused(word, "left", "-f", "no_such_file.yaml")
    assert f"{word} needs the level" in text
    assert f"this account has {level} (ZENCELL_ACCESS); nothing was sent; allowed here: " in text


@pytest.mark.parametrize("level", ["watch"], indirect=True)
@pytest.mark.usefixtures("level")
def test_subcommands_of_two_words_and_help_know_the_level(tmp_path: Path) -> None:
    assert "zone clear needs the level operate" in refused("zone", "clear", "handover", "-f", str(tmp_path))
    assert CliRunner().invoke(app, ["run", "--help"]).exit_code == 0


@pytest.mark.parametrize("level", ["watch"], indirect=True)
@pytest.mark.usefixtures("level")
def test_files_and_stops_are_for_everybody() -> None:
    assert CliRunner().invoke(app, ["schema", "cell"]).exit_code == 0
    assert "no_such_file" in refused("halt", "left", "-f", "no_such_file.yaml")
    assert (COMMANDS["estop"].level, COMMANDS["halt"].level) == (Level.WATCH, Level.WATCH)


@pytest.mark.parametrize("level", ["watch"], indirect=True)
@pytest.mark.usefixtures("level")
def test_tools_of_a_bus_read_and_do_not_write_and_no_process_starts(tmp_path: Path) -> None:
    error = CliRunner().invoke(gateway_app, ["nmt", DRIVES, "left.J1", "reset-node"]).exception
    assert "drive-gateway nmt needs the level configure" in str(error)
    with pytest.raises(CommandError, match="robot-left needs the level operate"):
        run_process("robot-left", load_cell(TWO_ARMS), tmp_path, None, False, lambda _folder, _stop: 0)


@pytest.mark.parametrize("level", ["operate"], indirect=True)
@pytest.mark.usefixtures("level")
def test_a_page_goes_no_further_than_the_account() -> None:
    with pytest.raises(CommandError, match="page for level configure"), page_server("127.0.0.1", 0, Level.CONFIGURE):
        pass


@pytest.mark.parametrize("level", ["Watch", "admin"], indirect=True)
def test_a_setting_that_is_no_level_is_told_whatever_is_asked(level: str) -> None:
    assert f"ZENCELL_ACCESS={level} in the environment, allowed are watch, operate, configure" in refused(
        "schema", "cell"
    )


def test_the_documents_name_every_command_at_its_level() -> None:
    rows = re.findall(r"^\| \*(watch|operate|configure)\* \|([^|]*)\|", (ROOT / "docs/operating.md").read_text(), re.M)
    told = {word: level for level, cells in rows for word in re.findall(r"`([a-z ]+)`", cells)}
    assert told == {word: command.level.name.lower() for word, command in COMMANDS.items()}
