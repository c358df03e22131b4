"""`cell reset`: what it clears, and that one silent robot does not keep it from the others."""

from pathlib import Path
from typing import cast

import pytest

from cell.commands.client.connection import Connection, ask_each
from cell.commands.errors import CommandError
from cell.commands.operator import reset
from cell.messages import Command, Estop, ManagerState, Reply, ResetEstop, ResetRobot

TRIAL, DOOR = Estop("e1", True, "anna@pc", "trial"), Estop("e2", True, "bert@pc", "door open")


class Cell:
    """A cell of which an operator's commands see and hear only this; `silent` robots do not answer."""

    file = Path("cell.yaml")

    def __init__(self, *shown: Estop, silent: tuple[str, ...] = (), left: tuple[Estop, ...] = ()) -> None:
        self._shown = shown
        self._silent = silent
        self._left = left
        self.asked: list[object] = []
        self.view = self

    def wait_for(self, _condition: object, _timeout_s: float) -> None:
        """Nobody's presence changes here."""

    def manager_state(self) -> ManagerState:
        return ManagerState("c", "m1", 1, 1, 0.0, "digest", estops=self._shown)

    def ask_manager(self, command: Command) -> Reply:
        self.asked.append(command)
        return Reply("1", not self._left, "still in force: a stop" if self._left else "cleared")

    def ask_robot(self, robot: str, _command: Command) -> Reply:
        self.asked.append(robot)
        if robot in self._silent:
            raise CommandError(f"robot {robot} does not answer", f"start it with: robot-agent cell.yaml {robot}")
        return Reply("1", True, f"{robot} has no fault")


def operator(cell: Cell) -> Connection:
    return cast(Connection, cell)


def test_sends_the_ids_of_the_stops_that_it_shows(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(reset, "operator_name", lambda: "carl@pc")
    cell = Cell(TRIAL, DOOR)
    reset._clear_stops(operator(cell), ("left",))
    assert cell.asked == [ResetEstop("carl@pc", ("e1", "e2"))]
    told = capsys.readouterr().out
    assert "clearing the emergency stop by anna@pc: trial\n" in told
    assert "clearing the emergency stop by bert@pc: door open\n" in told


def test_asks_for_nothing_when_no_stop_is_shown() -> None:
    cell = Cell()
    reset._clear_stops(operator(cell), ("left",))
    assert cell.asked == []


def test_ends_with_the_stops_that_are_still_in_force() -> None:
    with pytest.raises(CommandError, match="still in force: a stop"):
        reset._clear_stops(operator(Cell(TRIAL, left=(DOOR,))), ("left",))


def test_goes_on_after_a_silent_robot_and_names_all_that_did_not_answer(capsys: pytest.CaptureFixture[str]) -> None:
    cell = Cell(silent=("left", "third"))
    with pytest.raises(CommandError, match="robot left does not answer\nrobot third does not answer") as failed:
        ask_each(operator(cell), ("left", "right", "third"), ResetRobot())
    assert cell.asked == ["left", "right", "third"]
    assert "right has no fault" in capsys.readouterr().out
    assert "robot-agent cell.yaml left" in failed.value.next_step
    assert "robot-agent cell.yaml third" in failed.value.next_step
