"""`cell replay` and `cell report`: what they say of a recording, and of what is none."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from cell.messages import ManagerState, Mode
from cell.recording.summary import Heard
from tests.unit.cell.recording.recordings import BEGIN, FAULT, LEFT, record

MANAGER = ManagerState("two_arms", "m", 1, 1, 0.0, "d")


def heard() -> list[Heard]:
    """A robot that runs for 2 s and then has a fault for 1 s, and its manager."""
    states = [(replace(LEFT, sequence=i), BEGIN + 0.1 * i) for i in range(20)]
    faulty = [(replace(LEFT, sequence=i, mode=Mode.FAULT), BEGIN + 0.1 * i) for i in range(20, 31)]
    managers = [(MANAGER, BEGIN + 0.1 * i + 0.01) for i in range(31)]
    return sorted([*states, *faulty, *managers, (FAULT, BEGIN + 2.0)], key=lambda each: each[1])


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return record(tmp_path / "fault.mcap", heard())


def output(*words: str) -> str:
    result = CliRunner().invoke(app, list(words), catch_exceptions=False)
    assert result.exit_code == 0
    return result.output


def refusal(*words: str) -> str:
    with pytest.raises(CommandError) as refused:
        CliRunner().invoke(app, list(words), catch_exceptions=False, standalone_mode=False)
    return f"{refused.value.what}; {refused.value.next_step}"


@pytest.mark.parametrize(("at", "mode"), [((), "fault"), (("--at", "end"), "fault"), (("--at", "1.5"), "running")])
def test_a_state_of_the_recording_is_told_to_programs(file: Path, at: tuple[str, ...], mode: str) -> None:
    lines = [json.loads(line) for line in output("replay", str(file), "--json", *at).splitlines()]
    told = {(line["kind"], line["name"]): line for line in lines}
    assert told["robot", "left"]["mode"] == mode
    assert told["robot", "right"] == {"kind": "robot", "name": "right", "silent": True}
    assert told["manager", "two_arms"]["epoch"] == 1


def test_a_replay_shows_what_changed_and_ends(file: Path) -> None:
    shown = output("replay", str(file), "--speed", "100")
    assert "Z alarm: robot/left: J2 is hot [fault]" in shown
    assert "left: fault, line 6 ML X=100" in shown
    assert shown.endswith("fault.mcap ends here\n")


def test_a_report_has_numbers_and_a_page_that_needs_no_network(file: Path, tmp_path: Path) -> None:
    page = tmp_path / "fault.html"
    lines = output("report", str(file), "-o", str(page)).splitlines()
    assert "robot left: moves 2.0 s (67 %), fault 1.0 s (33 %)" in lines
    assert any(line.endswith("alarm: robot/left: J2 is hot [fault]") for line in lines)
    text = page.read_text()
    assert "Plotly.newPlot" in text
    assert '<script src="' not in text


@pytest.mark.parametrize("command", ["replay", "report"])
def test_what_is_no_recording_is_refused_in_one_sentence(tmp_path: Path, command: str) -> None:
    other = tmp_path / "other.mcap"
    assert "other.mcap cannot be read: No such file" in refusal(command, str(other))
    other.write_text("hello, world")
    assert "other.mcap is no MCAP file" in refusal(command, str(other))


@pytest.mark.parametrize("at", ["yesterday", "99", "-1", "nan"])
def test_a_moment_outside_of_the_recording_is_refused(file: Path, at: str) -> None:
    assert "allowed are 0 to 3.0 s, and end" in refusal("replay", str(file), "--at", at)


def test_an_empty_recording_is_refused_by_report(tmp_path: Path) -> None:
    assert "nothing to report" in refusal("report", str(record(tmp_path / "a.mcap", [])))


@pytest.mark.parametrize(
    "words", [("replay", "a.mcap"), ("report", "a.mcap"), ("record", "a.mcap")], ids=lambda words: words[0]
)
def test_without_the_group_its_name_is_told(monkeypatch: pytest.MonkeyPatch, words: tuple[str, str]) -> None:
    for module in ("cell.recording.reader", "cell.recording.writer"):
        monkeypatch.setitem(__import__("sys").modules, module, None)
    assert "pip install 'zencell[record]'" in refusal(*words)


def test_without_plotly_the_numbers_are_printed_and_the_group_is_told(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "cell.commands.files.report_page", None)
    assert "pip install 'zencell[view]'" in refusal("report", str(file), "-o", str(tmp_path / "a.html"))
