"""`cell run` with several robots: one moment for all, and nobody moves when one refuses."""

from pathlib import Path
from types import SimpleNamespace

import pytest

from cell.commands.errors import CommandError
from cell.commands.operator.common_start import run_together
from cell.messages import CellTime, Command, Halt, ManagerState, Reply, Run


class Cell:
    """Robots that answer as they are told; stands for an operator's connection."""

    def __init__(self, refusing: str = "", manager: bool = True) -> None:
        self.file = Path("cell.yaml")
        self.asked: list[tuple[str, Command]] = []
        self._refusing = refusing
        state = ManagerState("c", "m", 1, 1, 100.0, "digest") if manager else None
        self.view = SimpleNamespace(wait_for=lambda *_: SimpleNamespace(manager=state))

    def check_robot(self, robot: str) -> None:
        if robot not in ("left", "right"):
            raise CommandError(f"no robot {robot}")

    def ask_robot(self, robot: str, command: Command) -> Reply:
        self.asked.append((robot, command))
        return Reply("id", robot != self._refusing, "is in mode disabled" if robot == self._refusing else "done")


def test_all_robots_get_the_same_moment() -> None:
    cell = Cell()
    run_together(cell, ["left", "right"], 2.0, 6.0)  # type: ignore[arg-type]
    assert cell.asked == [(robot, Run(CellTime("m", 102.0), 6.0)) for robot in ("left", "right")]


def test_when_one_refuses_those_that_were_ordered_are_halted() -> None:
    cell = Cell(refusing="right")
    with pytest.raises(CommandError, match="right refuses: is in mode disabled"):
        run_together(cell, ["left", "right"], 2.0)  # type: ignore[arg-type]
    assert [robot for robot, command in cell.asked if isinstance(command, Halt)] == ["left"]


@pytest.mark.parametrize(
    ("robots", "manager", "text"),
    [
        (["left", "left"], True, "left a second time"),
        (["left", "up"], True, "no robot up"),
        (["left", "right"], False, "goes by its clock"),
    ],
)
def test_what_cannot_be_ordered_is_refused_before_anybody_is_asked(robots: list[str], manager: bool, text: str) -> None:
    cell = Cell(manager=manager)
    with pytest.raises(CommandError, match=text):
        run_together(cell, robots, 2.0)  # type: ignore[arg-type]
    assert cell.asked == []
