"""`cell output`: what an operator's words become, what he reads, and what he is told when they mean nothing."""

from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from cell.commands import cell_command
from cell.commands.client.cell_view import Snapshot
from cell.commands.client.connection import Connection
from cell.commands.operator import output as output_command
from cell.commands.operator.output import outputs_table
from cell.config import load_cell
from cell.messages import (
    AxisStatus,
    BusCounters,
    Call,
    ForceOutput,
    GatewayState,
    Heard,
    IoStatus,
    NodeStatus,
    Reply,
    SwitchOutput,
)
from drive_gateway.config import RobotDrives, load_drives
from drive_gateway.config.settings import OutputSettings
from tests.unit.config_world import TWO_ARMS

CELL = load_cell(TWO_ARMS)
J6 = NodeStatus(6, "left", "J6", "Operational", AxisStatus.FAULT, outputs={"gripper": True})


def state(node: NodeStatus = J6) -> GatewayState:
    counters = BusCounters(100, 0, 0.0, 0, 0, 0, 0.3)
    state = GatewayState("left_bus", "b", 7, 0.004, "virtual", True, "", {}, None, (node,), counters)
    return replace(state, digest=CELL.digest)


@dataclass
class Line:
    """A running cell of two arms, as `connect` finds it; keeps what was asked."""

    answer: Reply = field(default_factory=lambda: Reply("", True, "left: output gripper is off: node 6 shows it"))
    gateways: dict[str, GatewayState] = field(default_factory=lambda: {"left_bus": state()})
    asked: list[tuple[str, Call]] = field(default_factory=list)

    def ask(self, to: str, call: Call, _timeout_s: float) -> Reply:
        self.asked.append((to, call))
        return self.answer

    def say(self, monkeypatch: pytest.MonkeyPatch, *words: str) -> Result:
        view: Any = SimpleNamespace(wait_for=lambda _condition, _timeout_s: Snapshot(gateways=self.gateways))
        session: Any = self
        operator = Connection(TWO_ARMS, CELL, session, view)
        monkeypatch.setattr(output_command, "connect", lambda _file, _endpoint: nullcontext(operator))
        monkeypatch.setattr(output_command, "operator_name", lambda: "anna@pc")
        return CliRunner().invoke(cell_command.app, ["output", *words, "-f", str(TWO_ARMS)])


@pytest.mark.parametrize(("word", "on"), [("on", True), ("off", False)])
def test_the_robots_gateway_is_asked_in_view_of_its_newest_state(
    monkeypatch: pytest.MonkeyPatch, word: str, on: bool
) -> None:
    line = Line()
    result = line.say(monkeypatch, "left", "gripper", word)
    assert (result.exit_code, result.output) == (0, "left: output gripper is off: node 6 shows it\n")
    ((to, call),) = line.asked
    assert (to, call.command) == ("gateway/left_bus", SwitchOutput("left", "gripper", on, "anna@pc"))
    assert call.heard == Heard("b", 7)


@pytest.mark.parametrize(("words", "on"), [(("on", "--force"), True), (("off", "--force"), False), (("follow",), None)])
def test_an_output_is_forced_until_it_follows(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], on: bool | None
) -> None:
    line = Line()
    assert line.say(monkeypatch, "left", "gripper", *words).exit_code == 0
    ((_, call),) = line.asked
    assert call.command == ForceOutput("left", "gripper", on, "anna@pc")


def test_a_refusal_is_told_in_the_gateways_words(monkeypatch: pytest.MonkeyPatch) -> None:
    refused = Reply("", False, "left has no output griper; its outputs are gripper")
    result = Line(answer=refused).say(monkeypatch, "left", "griper", "on")
    assert result.exit_code == 1
    assert str(result.exception) == "gateway left_bus: left has no output griper; its outputs are gripper"


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("left", "gripper"), "on or off? Nothing was switched: 'gripper'"),
        (("left", "on"), "on or off? Nothing was switched: 'on'"),
        (("left", "gripper", "follow", "--force"), "--force needs on or off; nothing was switched"),
        (("left", "--force"), "--force needs on or off; nothing was switched"),
        (("middle", "gripper", "on"), "no robot 'middle' in "),
        (("middle",), "no robot 'middle' in "),
    ],
)
def test_words_that_mean_nothing_are_told_and_nobody_is_asked(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], told: str
) -> None:
    line = Line()
    result = line.say(monkeypatch, *words)
    assert result.exit_code == 1
    assert str(result.exception).startswith(told)
    assert not line.asked


@pytest.mark.parametrize("words", [(), ("left", "gripper", "open"), ("left", "gripper", "on", "off")])
def test_a_wrong_command_line_asks_nobody(monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]) -> None:
    line = Line()
    assert line.say(monkeypatch, *words).exit_code == 2
    assert not line.asked


@pytest.mark.parametrize("words", [("left", "gripper", "on"), ("left",)])
def test_a_gateway_that_is_silent_is_named_with_the_command_that_starts_it(
    monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    line = Line(gateways={})
    result = line.say(monkeypatch, *words)
    assert result.exit_code == 1
    assert str(result.exception) == "gateway left_bus does not answer"
    assert not line.asked


def test_a_robot_without_outputs_says_which_file_would_name_them(monkeypatch: pytest.MonkeyPatch) -> None:
    result = Line(gateways={"right_bus": state()}).say(monkeypatch, "right")
    assert result.exit_code == 0
    assert result.output.replace("\n", "").startswith("robot right has no digital outputs; its `outputs` in ")
    assert "right_drives.yaml" in result.output


def test_files_other_than_those_of_the_gateway_list_nothing_and_keep_nobody_from_switching(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is switched is named, and the gateway knows its names: a part is freed with old files, too."""
    line = Line(gateways={"left_bus": replace(state(), digest="0123456789abcdef")})
    listed = line.say(monkeypatch, "left")
    assert listed.exit_code == 1
    assert f"configuration 01234567, the files here are {CELL.digest[:8]}" in str(listed.exception)
    assert line.say(monkeypatch, "left", "gripper", "off").exit_code == 0


def drives() -> RobotDrives:
    left = load_drives(TWO_ARMS.parent / "left_drives.yaml", "left_bus").robots["left"]
    return replace(left, outputs=(*left.outputs, OutputSettings("laser", "J1", 3)))


def rows(node: NodeStatus) -> list[tuple[Any, ...]]:
    return list(zip(*(column.cells for column in outputs_table(drives(), state(node)).columns), strict=True))


def test_each_output_is_listed_with_its_state_what_a_stop_makes_of_it_and_the_drive_that_carries_it() -> None:
    assert rows(J6) == [
        ("gripper", "on", "keep", "J6", "6", "16", "Operational", "Fault"),
        ("laser", "unknown to its gateway", "off", "J1", "", "3", "", ""),
    ]


def test_an_output_of_an_io_node_is_listed_with_its_node_and_unknown_while_that_does_not_work() -> None:
    left = replace(drives(), outputs=(OutputSettings("valve", "", 9, keep=True, io="coupler"),))
    works = IoStatus("coupler", 20, "Operational", True, outputs={"left": {"valve": True}})
    for io, found in ((works, "on"), (replace(works, operational=False), "unknown")):
        table = outputs_table(left, replace(state(), io_nodes=(io,)))
        (row,) = zip(*(column.cells for column in table.columns), strict=True)
        assert row == ("valve", found, "keep", "I/O coupler", "20", "9", "Operational", "")


def test_of_a_silent_drive_nobody_knows_what_its_outputs_do() -> None:
    assert rows(replace(J6, nmt="unknown", drive=AxisStatus.SILENT))[0][1] == "unknown"


def test_a_forced_output_says_by_whom() -> None:
    table = outputs_table(drives(), replace(state(), forced={"left": {"gripper": "anna@pc"}}))
    assert next(iter(table.columns[1].cells)) == "on, forced by anna@pc"
