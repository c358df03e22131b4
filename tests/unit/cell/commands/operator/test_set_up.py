"""`cell home`, `cell move`, `cell setup clear`, and Ctrl-C in front of an order: what is asked for, and what is not."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from cell.commands import cell_command
from cell.commands.client.cell_view import Snapshot
from cell.commands.client.connection import Connection
from cell.commands.client.state_table import manager_line
from cell.commands.operator import jog as jog_command
from cell.commands.operator import set_up as set_up_command
from cell.config import load_cell
from cell.messages import (
    Body,
    BusCounters,
    Call,
    ClearSetup,
    GatewayState,
    Heard,
    HoldSetup,
    Home,
    ManagerState,
    Mode,
    MoveAxes,
    Presence,
    PressAxis,
    ProgramState,
    ProgramStatus,
    Reply,
    RobotState,
    SetupStatus,
)
from tests.unit.config_world import TWO_ARMS

CELL = load_cell(TWO_ARMS)
GATEWAY = GatewayState(
    "left_bus", "g", 7, 0.004, "virtual", True, "", {}, None, (), BusCounters(1, 0, 0.0, 0, 0, 0, 0.1),
    digest=CELL.digest,
)  # fmt: skip
MANAGER = ManagerState("two_arms", "m", 1, 3, 0.0, CELL.digest)
LEFT = RobotState("left", "b", 5, Mode.READY, ProgramStatus("p", ProgramState.LOADED, 0, ""), *[None] * 4, None)
PRESENCE = Presence("left", "b", 1, 5, None, CELL.digest, Body(False, (0.0, 0.0, 0.0), 1.0), 0.0)


@dataclass
class Line:
    """A running cell of two arms; Ctrl-C is pressed when `pressed_at` says so of what is looked at or asked."""

    digest: str = CELL.digest
    pressed_at: str = ""
    busy: list[str] = field(default_factory=list)
    """While somebody is in set-up, as many orders are refused as there are names."""
    asked: list[tuple[str, Call]] = field(default_factory=list)
    connected_to: list[list[str] | None] = field(default_factory=list)
    stop: threading.Event = field(default_factory=threading.Event)

    def look(self) -> Snapshot:
        if self.pressed_at == "look":
            self.stop.set()
        gateway, presence = replace(GATEWAY, digest=self.digest), replace(PRESENCE, digest=self.digest)
        return Snapshot({"left": LEFT}, {"left": presence}, {"left_bus": gateway}, self._manager())

    def _manager(self) -> ManagerState:
        return replace(MANAGER, setup=SetupStatus(self.busy[0], True) if self.busy else None)

    def wait_for(self, _condition: object, _timeout_s: float) -> Snapshot:
        return self.look()

    def ask(self, to: str, call: Call, _timeout_s: float) -> Reply:
        self.asked.append((to, call))
        if self.pressed_at == "ask":
            self.stop.set()
        if self.busy:
            return Reply(call.id, False, f"left is not set up: {self.busy.pop(0)} is in set-up; one robot at a time")
        return Reply(call.id, True, "said", data="done")

    def publish(self, _message: object) -> None:
        raise AssertionError("nothing is published")

    def say(self, monkeypatch: pytest.MonkeyPatch, *words: str) -> Result:
        world: Any = self

        @contextmanager
        def connect(
            file: Path, endpoint: list[str] | None, stop: threading.Event | None = None
        ) -> Iterator[Connection]:
            if self.pressed_at == "connect":
                self.stop.set()
            self.connected_to.append(endpoint)
            yield Connection(file, CELL, world, world, stop)

        for module in (set_up_command, jog_command):
            monkeypatch.setattr(module, "connect", connect)
            monkeypatch.setattr(module, "stop_event", lambda: self.stop)
        monkeypatch.setattr(set_up_command, "operator_name", lambda: "anna@pc")
        return CliRunner().invoke(cell_command.app, [*words, "-f", str(TWO_ARMS)])

    @property
    def commands(self) -> list[object]:
        return [call.command for _, call in self.asked]


def test_an_order_and_each_hold_are_made_in_view_of_the_gateways_newest_state(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line()
    assert line.say(monkeypatch, "home", "left").exit_code == 0
    assert line.commands == [Home("left", ()), HoldSetup("left", line.asked[0][1].id)]
    assert {(to, call.heard) for to, call in line.asked} == {("gateway/left_bus", Heard("g", 7))}
    assert line.connected_to == [None]


def test_homing_waits_for_its_turn_and_says_for_whom_other_motion_does_not(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(set_up_command, "HOLD_PERIOD_S", 0.0)
    line = Line(busy=["right", "right", "middle"])
    result = line.say(monkeypatch, "home", "left")
    assert result.exit_code == 0
    assert result.output.startswith("left: waits: right is in set-up\nleft: waits: middle is in set-up\nleft: said\n")
    assert line.commands[:4] == [Home("left", ())] * 4
    for words in (("move", "left", "J1=5"), ("home", "left", "--without-manager")):
        line = Line(busy=["right"])
        assert "right is in set-up; one robot at a time" in str(line.say(monkeypatch, *words).exception)
        assert len(line.asked) == 1


def test_ctrl_c_while_homing_waits_for_its_turn_ends_it(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(busy=["right"] * 3, pressed_at="ask")
    assert "broken off before it was sent" in str(line.say(monkeypatch, "home", "left").exception)
    assert line.commands == [Home("left", ())]


@pytest.mark.parametrize(
    "words",
    [("home", "left"), ("move", "left", "J1=5"), ("move", "left", "J1", "--torque", "5", "--for", "1"),
     ("jog", "left", "J1", "+")],
    ids=lambda words: words[0],
)  # fmt: skip
@pytest.mark.parametrize("when", ["connect", "look"])
def test_ctrl_c_in_front_of_an_order_lets_nothing_be_sent(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], when: str
) -> None:
    line = Line(pressed_at=when)
    result = line.say(monkeypatch, *words)
    assert result.exit_code == 1
    assert "broken off before it was sent" in str(result.exception)
    assert line.asked == []


def test_ctrl_c_while_the_gateway_answers_holds_nothing_so_nothing_begins(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(pressed_at="ask")
    result = line.say(monkeypatch, "move", "left", "J1=5")
    assert str(result.exception) == "left: let go of; its drives stop and switch off"
    assert [type(command) for command in line.commands] == [MoveAxes]


def test_without_a_manager_the_gateway_itself_is_connected_to_and_told_so(monkeypatch: pytest.MonkeyPatch) -> None:
    endpoint = CELL.gateways["left_bus"].endpoint
    for words, kind in (
        (("home", "left"), Home),
        (("move", "left", "J1=5"), MoveAxes),
        (("move", "left", "J1", "--torque", "5", "--for", "1"), PressAxis),
    ):
        line = Line()
        assert line.say(monkeypatch, *words, "--without-manager").exit_code == 0
        first = line.commands[0]
        assert isinstance(first, kind)
        assert first.alone
        assert line.connected_to == [[endpoint]]


@pytest.mark.parametrize(
    ("words", "who"),
    [(("home", "left"), "gateway left_bus"), (("move", "left", "J1=5"), "gateway left_bus"),
     (("jog", "left", "J1", "+"), "robot left")],
    ids=lambda words: words[0],
)  # fmt: skip
def test_files_other_than_those_that_run_are_refused_with_both_digests(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], who: str
) -> None:
    line = Line(digest="0123456789abcdef")
    result = line.say(monkeypatch, *words)
    assert result.exit_code == 1
    text = str(result.exception)
    assert text.startswith(f"{who} runs with the configuration 01234567, the files here are {CELL.digest[:8]}; ")
    assert line.asked == []


def test_an_operators_word_about_a_silent_gateway_goes_to_the_manager(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line()
    assert line.say(monkeypatch, "setup", "clear", "left").exit_code == 0
    ((to, call),) = line.asked
    assert (to, call.command, call.heard) == ("manager", ClearSetup("left", "anna@pc"), Heard("m", 3))


def test_the_status_says_who_is_in_set_up_and_who_waits_for_it() -> None:
    state = replace(MANAGER, setup=SetupStatus("left", False, "right has not confirmed yet that it stands"))
    waiting = replace(state, setup_refused={"right": "left is in set-up; one robot at a time"})
    assert manager_line(CELL, waiting) == (
        "manager: epoch 1, left is in set-up (right has not confirmed yet that it stands), "
        "right waits for set-up: left is in set-up; one robot at a time"
    )
    assert manager_line(CELL, replace(MANAGER, setup=SetupStatus("left", True))).endswith(", left is in set-up")
