"""`cell drives` and the tools for one bus, as an operator reads them."""

import math
from contextlib import nullcontext
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from unittest.mock import create_autospec

import pytest
from typer.testing import CliRunner

from cell.commands import drive_gateway_command
from cell.commands.bus_tools import drive_tools
from cell.commands.bus_tools.node_access import NodeAccess
from cell.commands.bus_tools.place import BusPlace, meant_node, place_of
from cell.commands.client.cell_view import Snapshot
from cell.commands.errors import CommandError
from cell.commands.operator.drives import drives_table
from cell.commands.operator.set_up import press_of, target_of
from cell.config import load_cell
from cell.messages import AxisStatus, BusCounters, GatewayState, IoStatus, NodeStatus, PressAxis
from drive_gateway.canopen.nmt import NmtState
from drive_gateway.config import load_drives
from drive_gateway.config.settings import IoSettings
from tests.unit.config_world import TWO_ARMS


def gateway(node: NodeStatus) -> GatewayState:
    counters = BusCounters(100, 2, 0.006, 3, 40, 1, 0.36)
    return GatewayState("left_bus", "b", 1, 0.004, "virtual", True, "", {}, None, (node,), counters)


def test_every_node_is_a_row_with_its_emergency_and_its_meaning() -> None:
    node = NodeStatus(
        1, "left", "J1", "Operational", AxisStatus.FAULT, 0x8611, "following error over its window",
        referenced=False, reference_missing="home it", warning=True, following_error=0.05237,
        outputs={"gripper": True, "laser": False}, current_a=-1.254, temperature_c=45.6,
    )  # fmt: skip
    table = drives_table(load_cell(TWO_ARMS), Snapshot(gateways={"left_bus": gateway(node)}))
    cells = [next(iter(column.cells)) for column in table.columns]
    assert cells[:6] == ["left_bus", "1", "left J1", "Operational", "Fault, warning, gripper on, laser off", "52.37"]
    assert cells[6:8] == ["-1.25", "46"]
    assert cells[8] == "8611h following error over its window; not referenced: home it"
    assert "late cycles 2 of 100, worst 6.0 ms, missing TPDOs 3, blocks 40 taken 1 refused" in str(table.caption)
    assert "gateway right_bus: silent" in str(table.caption)


def test_an_io_node_is_a_row_with_its_outputs_and_inputs_stand_below() -> None:
    io = IoStatus("coupler", 20, "Operational", True, outputs={"left": {"gripper": True}})
    lost = IoStatus("lamps", 21, "unknown", False, problem="node 21 (I/O lamps) was lost")
    inputs = {"left": {"part_present": True, "full": False, "pressure": None}}
    node = NodeStatus(1, "left", "J1", "Operational", AxisStatus.SWITCH_ON_DISABLED)
    seen = replace(gateway(node), io_nodes=(io, lost), inputs=inputs)
    table = drives_table(load_cell(TWO_ARMS), Snapshot(gateways={"left_bus": seen}))
    rows = list(zip(*(column.cells for column in table.columns), strict=True))[1:]
    assert rows == [
        ("left_bus", "20", "I/O coupler", "Operational", "works, left gripper on", "", "", "", ""),
        ("left_bus", "21", "I/O lamps", "unknown", "does not work", "", "", "", "node 21 (I/O lamps) was lost"),
    ]
    assert "inputs of left: part_present on, full off, pressure unknown" in str(table.caption)


def test_an_io_node_is_known_by_its_name_and_its_number_with_the_objects_that_it_has() -> None:
    drives = load_drives(TWO_ARMS.parent / "left_drives.yaml", "left_bus")
    drives = replace(drives, io_nodes=(IoSettings("coupler", 20, input_bytes=1, output_bytes=0),))
    place = BusPlace(drives.bus, drives)
    for name in ("coupler", "20"):
        named = meant_node(place, name)
        assert (named.id, named.axis, named.label) == (20, 1, "node 20 (I/O coupler)")
        shown = [(entry.index, entry.sub) for entry in named.readable if entry.index >= 0x6000 and entry.sub]
        assert shown == [(0x6000, 1)]
    with pytest.raises(CommandError, match=r"6 \(left.J6\), 20 \(I/O coupler\)"):
        meant_node(place, "valves")


def test_states_have_the_names_of_the_standard() -> None:
    assert [status.words for status in AxisStatus] == [
        "Not Ready to Switch On", "Switch On Disabled", "Ready to Switch On", "Switched On", "Operation Enabled",
        "Quick Stop Active", "Fault Reaction Active", "Fault", "Silent",
    ]  # fmt: skip
    assert [state.words for state in NmtState] == ["Boot-up", "Stopped", "Operational", "Pre-operational"]


def refused(*words: str) -> str:
    result = CliRunner().invoke(drive_gateway_command.app, list(words))
    assert result.exit_code == 1
    return str(result.exception)


def test_an_axis_that_is_not_on_the_bus_is_named_with_those_that_are() -> None:
    text = refused("read", str(TWO_ARMS), "left_bus", "right.J1", "6041")
    assert text.startswith("no node 'right.J1' on the bus of gateway left_bus; its nodes are 1 (left.J1), 2 (left.J2)")


def test_a_virtual_bus_without_its_gateway_says_where_it_lives(tmp_path: Path) -> None:
    text = refused("scan", str(TWO_ARMS.parent / "left_drives.yaml"))
    assert "it lives in its gateway's process" in text
    assert "unknown format" in refused("log", str(TWO_ARMS), "left_bus", str(tmp_path / "x.pdf"))


def test_a_read_only_object_and_a_value_that_does_not_fit_are_refused_before_anything_is_sent() -> None:
    assert refused("write", str(TWO_ARMS), "left_bus", "1", "6041", "5") == "6041h:00 Statusword is read-only"
    assert "allowed: 1 to 255" in refused("write", str(TWO_ARMS), "left_bus", "1", "60C2:1", "300")


def test_an_object_that_can_only_be_written_is_not_read_back(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes = create_autospec(NodeAccess, instance=True)
    monkeypatch.setattr(drive_tools, "node_access", lambda _place, _command, _may_move: nullcontext(nodes))
    eds = Path(str(files("drive_gateway.sim") / "cia402_drive.eds"))
    drive_tools.write(place_of(TWO_ARMS, "left_bus", None, None, None), "2", "2020:06", "1", eds=eds)
    nodes.write.assert_called_once_with(2, 0x2020, 6, b"\x01")
    nodes.read.assert_not_called()
    assert capsys.readouterr().out == "2020h:06  Fault on command, Blocked axis: is written\n"


def test_bytes_to_a_file_need_one_object_and_a_domain_needs_a_file(tmp_path: Path) -> None:
    without_object = refused("read", str(TWO_ARMS), "left_bus", "1", "-o", str(tmp_path / "all"))
    assert without_object == "--output takes the bytes of one object"
    missing = refused("write", str(TWO_ARMS), "left_bus", "1", "2001", f"@{tmp_path / 'none'}")
    assert "none cannot be read" in missing


def test_a_scan_of_a_cell_file_asks_for_one_of_its_gateways() -> None:
    assert "is a cell file: name one of its gateways, too: left_bus, right_bus" in refused("scan", str(TWO_ARMS))


def test_a_target_is_in_degrees_or_for_an_axis_that_slides_in_millimetres() -> None:
    drives = load_drives(TWO_ARMS.parent / "left_drives.yaml", "left_bus").robots["left"]
    sliding = replace(drives, axes=(replace(drives.axes[0], linear=True), *drives.axes[1:]))
    assert target_of(drives, "J1=90") == ("J1", pytest.approx(math.pi / 2))
    assert target_of(sliding, "J1=90") == ("J1", pytest.approx(0.09))
    with pytest.raises(CommandError, match="robot left has no axis J9; its axes are J1, J2"):
        target_of(drives, "J9=1")
    for word in ("J1", "J1=far", "J1=nan", "J1=inf"):
        with pytest.raises(CommandError, match="is no target of an axis"):
            target_of(drives, word)


def test_a_torque_is_given_to_one_axis_whose_way_is_in_degrees_or_mm() -> None:
    turning = load_drives(TWO_ARMS.parent / "left_drives.yaml", "left_bus").robots["left"]
    sliding = replace(turning, axes=(replace(turning.axes[0], linear=True), *turning.axes[1:]))
    assert press_of(turning, ["J1"], 50.0, 2.0, 1.0) == PressAxis(
        "left", "J1", 50.0, 2.0, pytest.approx(math.radians(1))
    )
    assert press_of(sliding, ["J1"], -50.0, 2.0, 1.0) == PressAxis("left", "J1", -50.0, 2.0, pytest.approx(0.001))
    for words in (["J1=5"], ["J1", "J2"], []):
        with pytest.raises(CommandError, match="it takes one axis, without a value"):
            press_of(turning, words, 50.0, 2.0, 1.0)
    with pytest.raises(CommandError, match="robot left has no axis J9; its axes are J1, J2"):
        press_of(turning, ["J9"], 50.0, 2.0, 1.0)
