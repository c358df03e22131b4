"""Output of `cell up` where there is no terminal."""

import dataclasses
import io

import pytest
from rich.console import Console

from cell.commands.client import display as show
from cell.commands.client.cell_view import Snapshot
from cell.commands.client.display import Show
from cell.config import load_cell
from cell.messages import Mode, ProgramState, ProgramStatus, RobotState
from tests.unit.repository import ROOT

CELL = load_cell(ROOT / "cell_configs" / "two_arms" / "cell.yaml")
PROGRAM = ProgramStatus("left.prog", ProgramState.RUNNING, 6, "WAIT 0.5")
WAITING = RobotState("left", "b", 1, Mode.RUNNING, PROGRAM, None, None, None, 0.0, None, waiting_for="WAIT, 0.4 s left")


def test_a_countdown_is_not_repeated_line_by_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(show, "PERIOD_S", 0.0)
    out = io.StringIO()
    with Show(CELL, Console(file=out)) as shown:
        for left_s in ("0.4", "0.3", "0.2"):
            state = dataclasses.replace(WAITING, waiting_for=f"WAIT, {left_s} s left")
            shown.update(Snapshot(robots={"left": state}))
    assert out.getvalue().splitlines().count("left: running, line 6 WAIT 0.5, waits: WAIT, 0.4 s left") == 1
    assert out.getvalue().count("left:") == 1
