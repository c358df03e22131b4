"""What `cell up` tells while the cell comes up, and how it treats robots that refuse to run."""

import io
import threading
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest
from rich.console import Console

from cell.commands.client.cell_view import Snapshot
from cell.commands.client.display import Show
from cell.commands.up import orders, supervisor
from cell.commands.up.supervisor import Supervisor
from cell.messages import Call, Event, ManagerState, Mode, ProgramState, ProgramStatus, Reply, RobotState, Run, Severity
from tests.unit.manager_world import settings

ALARM = Event("gateway/bus", 1, Severity.ALARM, "node_silent", "node 3 is silent", "look at its cable")


class Cell:
    """A cell that is seen as a test says, and robots that answer orders."""

    def __init__(self, mode: Mode, answer: Callable[[Call], Reply] = lambda call: Reply(call.id, True, "done")) -> None:
        self.mode, self.program = mode, ProgramState.LOADED
        self.output = io.StringIO()
        self.events: list[object] = []
        self.calls: list[Call] = []
        self.stop = threading.Event()
        self._answer = answer
        console = Console(file=self.output, width=200)
        children = SimpleNamespace(deaths=list, all_dead=lambda: False, page_addresses=list)
        self.show = Show(settings(), console)
        self.supervisor = Supervisor(settings(), children, console, self.stop, threading.Event(), Path("recordings"))  # type: ignore[arg-type]
        self.looks = 0

    def ask(self, _to: str, call: Call, _timeout_s: float) -> Reply:
        self.calls.append(call)
        return self._answer(call)

    def take(self) -> list[object]:
        events, self.events = self.events, []
        return events

    def look(self) -> Snapshot:
        self.looks += 1
        if self.looks > 1000:
            self.stop.set()
        status = ProgramStatus("p", self.program, 1, "")
        return Snapshot(
            robots={
                name: RobotState(name, "b", self.looks, self.mode, status, None, None, None, None, None)
                for name in ("left", "right")
            },
            manager=ManagerState("line", "m", 1, self.looks, 0.0, "digest"),
        )


def test_alarms_and_warnings_that_come_while_the_cell_comes_up_are_shown() -> None:
    cell = Cell(Mode.READY)
    cell.events = [ALARM]
    assert cell.supervisor._bring_up(cell, cell, cell, cell.show, False)  # type: ignore[arg-type]
    assert "alarm: gateway/bus: node 3 is silent; look at its cable" in cell.output.getvalue()


def test_a_robot_that_refuses_to_run_ends_a_run_until_done_with_its_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orders, "PATIENCE_S", 0.5)
    monkeypatch.setattr(orders, "RETRY_S", 0.02)
    cell = Cell(Mode.READY, lambda call: Reply(call.id, False, "it has a negative override"))
    with orders.Orders(cell, Run()) as run:  # type: ignore[arg-type]
        assert cell.supervisor._watch(cell, cell, cell.show, run, True) is None  # type: ignore[arg-type]
    assert not cell.stop.is_set()
    assert "robot left does not run its program: it has a negative override" in cell.output.getvalue()
    assert f"cell run left -f {Path('cell.yaml')}" in cell.output.getvalue()


def test_a_cell_that_stays_tells_it_once_and_orders_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(orders, "PATIENCE_S", 0.2)
    monkeypatch.setattr(orders, "RETRY_S", 0.02)
    monkeypatch.setattr(supervisor, "_WATCH_S", 0.001)
    cell = Cell(Mode.READY, lambda call: Reply(call.id, False, "it has a negative override"))
    with orders.Orders(cell, Run()) as run:  # type: ignore[arg-type]
        cell.supervisor._watch(cell, cell, cell.show, run, False)  # type: ignore[arg-type]
    assert cell.output.getvalue().count("robot left does not run its program") == 1
