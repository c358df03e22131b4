"""The shell of the agent: what it does beside the core's loop."""

import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cell.config import load_cell
from cell.config.points_file import JointPoint, PointsOwner
from robot_agent.agent.operator.loading import ProgramNotRead, ProgramRead, ReadProgram
from robot_agent.agent.operator.teaching import PointNotWritten, PointWritten, WritePoint
from robot_agent.agent.shell import AgentShell
from tests.unit.config_world import TWO_ARMS
from tests.unit.six_axis_arm import arm

OWNER = PointsOwner(("J1",))
DEADLINE_S = 5.0


class Quiet:
    """A session on which nothing arrives."""

    def watch(self, *_keys: str) -> Any:
        return SimpleNamespace(take_arrived=list)

    def queue(self, _key: str) -> Any:
        return SimpleNamespace(take=list)

    def outcomes(self) -> list[object]:
        return []


@pytest.fixture
def shell() -> AgentShell:
    core: Any = SimpleNamespace(link=SimpleNamespace(grant=None, refusal="", refused_by_gateway=False))
    session: Any = Quiet()
    return AgentShell(core, session, load_cell(TWO_ARMS), "left", lambda _text: None, threading.Event())


def news(shell: AgentShell) -> object:
    deadline = time.monotonic() + DEADLINE_S
    while not (found := shell.inbox()):
        assert time.monotonic() < deadline
        time.sleep(0.001)
    return found[0]


def test_a_point_is_written_beside_the_loop_and_the_core_hears_of_it(shell: AgentShell, tmp_path: Path) -> None:
    file = tmp_path / "left.points.yaml"
    shell.perform(WritePoint(3, file, "a", JointPoint((0.5,)), OWNER))
    written = news(shell)
    assert isinstance(written, PointWritten)
    assert (written.id, list(written.settings.points)) == (3, ["a"])
    assert "a: {J1: 28.647" in file.read_text()


@pytest.mark.parametrize(("name", "why"), [("none/left.points.yaml", "cannot be written"), ("", "a folder")])
def test_what_cannot_be_written_is_told_too(shell: AgentShell, tmp_path: Path, name: str, why: str) -> None:
    shell.perform(WritePoint(4, tmp_path / name, "a", JointPoint((0.5,)), OWNER))
    failed = news(shell)
    assert isinstance(failed, PointNotWritten)
    assert (failed.id, why in failed.reason) == (4, True), failed.reason


def test_a_program_is_read_beside_the_loop(shell: AgentShell, tmp_path: Path) -> None:
    cell = load_cell(TWO_ARMS)
    shell.perform(ReadProgram(5, cell, "left", arm(), cell.robots["left"].program))
    read = news(shell)
    assert isinstance(read, ProgramRead)
    assert (read.id, read.program.name) == (5, "left.prog")
    (tmp_path / "bad.prog").write_text("MOVE\n")
    shell.perform(ReadProgram(6, cell, "left", arm(), tmp_path / "bad.prog"))
    refused = news(shell)
    assert isinstance(refused, ProgramNotRead)
    assert "bad.prog:1:1: program: found `MOVE`" in refused.reason
