"""`cell zone show` and `set`: what they print, what they order, and what they refuse before anybody is asked."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from cell.commands.operator import zone as module
from cell.config import load_cell
from cell.geometry import SpaceOf
from cell.messages import Command, ManagerState, Place, Reply, SetZone, ZoneGeometry
from tests.unit.repository import ROOT

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
TOLD = ZoneGeometry("handover", 12, (0.9, 2.6, 2.6), (0.0, 0.0, 1.4), UPRIGHT, ("left", "right"))


class Cell:
    """A cell of which the commands hear only this."""

    file = Path("cell.yaml")

    def __init__(self) -> None:
        self.settings = load_cell(ROOT / "cell_configs" / "two_arms" / "cell.yaml")
        self.session = self
        self.asked: list[Command] = []
        self.reply = Reply("1", True, "zone handover: as ordered", data="13")

    def last(self, _pattern: str, _timeout_s: float) -> list[object]:
        return [TOLD, replace(TOLD, zone="belt", shape="sphere", size_m=(0.25,), of=SpaceOf.TCP)]

    def manager_state(self) -> ManagerState:
        return ManagerState("c", "m", 7, 1, 0.0, "d")

    def ask_manager(self, command: Command) -> Reply:
        self.asked.append(command)
        return self.reply


def run(cell: Cell, monkeypatch: pytest.MonkeyPatch, *words: str) -> str:
    """What the command prints; a `CommandError` comes through."""

    @contextmanager
    def connected(*_: object) -> Iterator[Cell]:
        yield cell

    monkeypatch.setattr(module, "connect", connected)
    monkeypatch.setattr(module, "operator_name", lambda: "anna@pc")
    result = CliRunner().invoke(app, ["zone", *words])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.output


def test_show_says_where_each_zone_is_what_counts_in_it_and_for_whom(monkeypatch: pytest.MonkeyPatch) -> None:
    belt, handover = run(Cell(), monkeypatch, "show").splitlines()
    at = "X 0 Y 0 Z 1400 mm, A 0 B 0 C 0 deg"
    assert handover == f"handover: box 900 x 2600 x 2600 mm at {at}, of the body; for left, right; version 12"
    assert belt == f"belt: sphere 250 mm at {at}, of the TCP; for left, right; version 12"
    assert run(Cell(), monkeypatch, "show", "handover") == f"{handover}\n"


def test_set_orders_what_is_named_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell()
    said = run(cell, monkeypatch, "set", "handover", "--pose", "0,0,1500,0,0,0", "--cylinder", "450,2000")
    run(cell, monkeypatch, "set", "handover", "--of", "tcp", "--priority", "left=2", "--priority", "right=0")
    assert "zone handover: as ordered" in said
    assert cell.asked == [
        SetZone("handover", "anna@pc", Place((0.0, 0.0, 1.5), UPRIGHT), "cylinder", (0.45, 2.0)),
        SetZone("handover", "anna@pc", of=SpaceOf.TCP, priority={"left": 2, "right": 0}),
    ]


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("wall", "--sphere", "5"), r"no zone 'wall' in cell\.yaml; its zones are: handover"),
        (("handover",), "nothing to change"),
        (("handover", "--box", "1,2,3", "--sphere", "5"), "--box and --sphere found, allowed is one shape"),
        (("handover", "--box", "1,2"), "--box '1,2' found, allowed 3 lengths above 0 in mm: x, y, z"),
        (("handover", "--sphere", "0"), "--sphere '0' found, allowed 1 length above 0 in mm: radius"),
        (("handover", "--sphere", "nan"), "--sphere 'nan' found"),
        (("handover", "--priority", "left"), "--priority 'left' found, allowed is a robot and 0 to 1000: left=2"),
        (("handover", "--priority", "left=-1"), "--priority 'left=-1' found"),
        (("handover", "--pose", "1,2"), "allowed are six numbers"),
    ],
)
def test_what_is_no_change_is_refused_before_the_manager_is_asked(
    words: tuple[str, ...], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = Cell()
    with pytest.raises(CommandError, match=says):
        run(cell, monkeypatch, "set", *words)
    assert cell.asked == []
