"""Tools on a bus without a gateway: any node that answers, named by a drives file, by its Node-ID, or by nothing.

Peers are simulated drives of this project and nodes of the `canopen` library.
"""

import struct
import time
from collections.abc import Iterator
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from unittest.mock import create_autospec

import can
import pytest
from typer.testing import CliRunner

from cell.commands import drive_gateway_command
from cell.commands.bus_tools import bus_line, node_access
from cell.config import ConfigError
from drive_gateway.canopen.axes_eds import eds_text
from drive_gateway.canopen.nmt import NmtState
from drive_gateway.config import load_drives
from drive_gateway.config.settings import BusSettings
from drive_gateway.sim.config.load import load_simulation
from drive_gateway.sim.shell import SimulatedDrives
from tests.unit.bus_tool_world import (
    DEADLINE_S,
    DRIVE,
    I32,
    IDENTITY,
    U8,
    U16,
    U32,
    ToolBus,
    local_node,
    lss_slave,
    network_on,
    sending,
    tool_bus,
)
from tests.unit.config_world import CELL, DRIVES, TWO_ARMS, Copy

__all__ = ["tool_bus"]


@pytest.fixture
def drives_file(tmp_path: Path, tool_bus: ToolBus) -> Path:
    """The left arm's drives on the bus of this test."""
    copy = Copy(tmp_path).change(DRIVES, "channel: two_arms_left", f'channel: "{tool_bus.channel}"')
    return copy.drives


@pytest.fixture
def simulated(drives_file: Path, tool_bus: ToolBus) -> Iterator[Path]:
    """The same, and its six drives, booted."""
    settings = load_drives(drives_file, "left_bus")
    settings = replace(settings, bus=BusSettings("virtual", tool_bus.channel, 1_000_000, {}))
    with SimulatedDrives(settings, load_simulation(drives_file)) as drives:
        deadline = time.monotonic() + DEADLINE_S
        while not all(node.nmt is NmtState.PRE_OPERATIONAL for node in drives.nodes):
            assert time.monotonic() < deadline
            time.sleep(0.01)
        yield drives_file


# Which bus, which node


@pytest.mark.usefixtures("simulated")
def test_a_bus_may_be_named_by_options_alone(tool_bus: ToolBus) -> None:
    assert tool_bus.run("read", "1", "6041:00") == "6041h:00  Statusword: 592 (0250h)\n"
    assert tool_bus.run("scan").splitlines()[0].startswith("node 1: device type ")


def test_a_drives_file_alone_names_the_axes_and_lets_other_nodes_be_read(simulated: Path, tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 9, DRIVE):
        assert "592 (0250h)" in tool_bus.run("read", str(simulated), "left.J2", "Statusword")
        assert "1D" in tool_bus.run("read", str(simulated), "9", "1018:01")
        told = tool_bus.run("scan", str(simulated))
    assert "node 1 (left.J1): device type " in told
    identity = "vendor 0000001Dh, product 00000402h, revision 00000001h, serial 00001267h"
    assert f"node 9 (not in the drives file): device type 00020192h, {identity}" in told


def test_a_scan_names_the_nodes_of_the_file_that_do_not_answer(drives_file: Path, tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 1, DRIVE):
        assert "no answer from node 2 (left.J2), node 3 (left.J3)" in tool_bus.refused("scan", str(drives_file))


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("read", "none.yaml", "1"), "none.yaml: no such cell file or drives file; name a cell file"),
        (("read", "{drives}", "0"), "no node '0' on the bus of gateway left_drives; its nodes are 1 (left.J1)"),
        (("read", "{drives}", "left.J9"), "others have their Node-ID; a Node-ID is 1 to 127"),
        (("read", "{drives}", "1", "speedometer"), "'speedometer' is no object of"),
        (("write", "{drives}", "1", "607A", "fast"), "'fast' is no whole number"),
        (("write", "{drives}", "1", "607A", "-99999999999"), "does not fit 607Ah:00"),
        (("write", "{drives}", "1", "2F00", "1", "--type", "INT"), "no data type INT; use one of INTEGER8"),
        (("write", "{drives}", "1", "607A", "1", "--type", "INTEGER8"), "whose type is known; leave it out"),
        (("write", "{drives}", "1", "2F00", "1"), "whose type is not known; allowed: an EDS that describes it, or"),
        (("read", "{drives}", "1", "--bitrate", "500000"), "--bitrate beside a file, which says it"),
        (("compare", "{drives}", "1"), "no DCF is named; name one with --dcf"),
        (("compare", "{drives}", "1", "--dcf", "x.eds"), "x.eds: cannot be read"),
        (("plan", "{drives}", "17"), "node 17 is not in the drives file; its nodes are 1, 2, 3, 4, 5, 6"),
        (("check", "none.yaml"), "none.yaml: no such drives file"),
        (("node-id", "{drives}", "200"), "Node-ID 200; a Node-ID is 1 to 127"),
        (("node-id", "{drives}", "5", "--vendor", "1"), "--product, --revision, --serial missing"),
        (("dump", "{drives}", "--log", "x.pdf"), "x.pdf: unknown format"),
        (("dump", "{drives}", "--log", "none.asc"), "none.asc cannot be read"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_a_wrong_word_is_one_sentence_before_anything_is_sent(
    drives_file: Path, tool_bus: ToolBus, words: tuple[str, ...], told: str
) -> None:
    assert told in tool_bus.refused(*(word.replace("{drives}", str(drives_file)) for word in words))


def test_a_node_that_lives_but_answers_no_sdo_is_in_the_scan(tool_bus: ToolBus) -> None:
    with sending(tool_bus.channel, 0x709, b"\4"):
        assert tool_bus.run("scan") == "node 9: has a heartbeat and answers no SDO; it may be stopped (`nmt`)\n"
    assert "no node answers; check power" in tool_bus.refused("scan")


def test_a_cell_file_of_any_form_is_taken_with_its_gateway_and_a_broken_file_is_told(tmp_path: Path) -> None:
    file = tmp_path / "cell.yaml"
    file.write_text("{cell: x, gateways: {a: {endpoint: tcp/127.0.0.1:1, drives: none.yaml}}}")
    told = CliRunner().invoke(drive_gateway_command.app, ["read", str(file), "a", "1"])
    assert "units" in str(told.exception)
    file.write_text("cell: [")
    told = CliRunner().invoke(drive_gateway_command.app, ["read", str(file), "a", "1"])
    assert isinstance(told.exception, ConfigError)
    assert f"{file}:1:" in str(told.exception)


def test_a_silent_node_is_told_with_what_to_check(tool_bus: ToolBus) -> None:
    told = tool_bus.refused("read", "5", "6041")
    assert "6041h:00 of node 5: No SDO response received within 0.5 s; check power, wiring, bit rate" in told


# Who has the bus


@pytest.mark.parametrize(
    ("words", "instead"),
    [
        (("scan",), "drive-gateway scan CELL GATEWAY ...; or end that master first"),
        (("read", "1", "6041"), "drive-gateway read CELL GATEWAY ..."),
        (("write", "1", "6081", "5"), "drive-gateway write CELL GATEWAY ..."),
        (("restore", "1"), "drive-gateway restore CELL GATEWAY ..."),
        (("nmt", "1", "start"), "a gateway starts its nodes by itself"),
        (("node-id", "5"), "a gateway never changes a Node-ID"),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
@pytest.mark.parametrize(
    ("number", "data", "what"),
    [(0x080, b"", "SYNC"), (0x77F, b"\5", "a master's heartbeat")],
    ids=["SYNC", "heartbeat"],
)
def test_beside_a_master_nothing_is_sent_and_its_own_command_is_named(
    tool_bus: ToolBus, words: tuple[str, ...], instead: str, number: int, data: bytes, what: str
) -> None:
    with sending(tool_bus.channel, number, data) as peer:
        told = tool_bus.refused(*words)
        assert peer.recv(0.0) is None
    assert f"has a master: {what} ({number:03X}h) is heard; nothing was sent; " in told
    assert instead in told


def test_a_master_that_guards_its_nodes_by_remote_frames_is_one(tool_bus: ToolBus) -> None:
    with sending(tool_bus.channel, 0x705, b"", remote=True):
        assert "node guarding (remote frame 705h) is heard; nothing was sent" in tool_bus.refused("scan")


def test_a_new_drive_with_node_id_127_is_no_master(tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 127, DRIVE), sending(tool_bus.channel, 0x77F, b"\x7f"):
        assert "0240h" in tool_bus.run("read", "127", "6041")


@pytest.mark.parametrize("words", [("nmt", "1", "stop"), ("node-id", "5")], ids=" ".join)
def test_what_only_a_master_may_do_is_refused_while_the_gateway_runs(
    tool_bus: ToolBus, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...]
) -> None:
    monkeypatch.setattr(node_access, "running_gateway", lambda _place: nullcontext(object()))
    told = tool_bus.refused(words[0], str(TWO_ARMS), "left_bus", *words[1:])
    assert told.startswith("gateway left_bus runs and is the master of its bus; nothing was sent; a gateway ")


def test_a_bus_that_fails_is_told_and_not_its_nodes(tool_bus: ToolBus, monkeypatch: pytest.MonkeyPatch) -> None:
    bus = create_autospec(can.BusABC, instance=True)
    bus.fileno.side_effect = NotImplementedError
    bus.recv.side_effect = can.CanOperationError("Network is down")
    monkeypatch.setattr(bus_line, "open_bus", lambda _settings: bus)
    told = tool_bus.refused("read", "1", "6041")
    assert told.startswith(f"CAN bus virtual:{tool_bus.channel}: Network is down; check that the adapter")
    bus.send.assert_not_called()


# Writing


def test_a_value_below_zero_needs_no_further_sign(tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 5, DRIVE) as node:
        assert tool_bus.run("write", "5", "607A:00", "-5") == "607Ah:00  Target position in counts: -5 (FFFFFFFBh)\n"
        assert node.data_store[0x607A][0] == struct.pack("<i", -5)
        assert "-6" in tool_bus.run("write", "5", "607A:00", "--", "-6")


def test_an_object_of_no_eds_is_written_with_its_type(tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 5, {**DRIVE, (0x2F00, 0): (U16, 0)}) as node:
        tool_bus.run("write", "5", "2F00", "0x0102", "--type", "unsigned16")
        assert node.data_store[0x2F00][0] == b"\2\1"


@pytest.mark.parametrize("word", [0x0233, 0x0237, 0x0217, 0x021F], ids=hex)
def test_while_a_drive_has_torque_nothing_is_written_unless_motion_is_wanted(tool_bus: ToolBus, word: int) -> None:
    with local_node(tool_bus.channel, 5, {**DRIVE, (0x6041, 0): (U16, word)}) as node:
        for item in ("6081", "607A", "6040"):
            told = tool_bus.refused("write", "5", item, "1")
            assert f"node 5 has its power stage on (statusword {word:04X}h); a write is refused" in told
        assert node.data_store == {}
        tool_bus.run("write", "5", "607A", "1", "--may-move")
        assert node.data_store == {0x607A: {0: b"\1\0\0\0"}}


def test_a_drive_is_not_switched_on_and_its_outputs_are_not_switched_by_accident(tool_bus: ToolBus) -> None:
    outputs = {(0x60FE, 0): (U8, 2), (0x60FE, 1): (U32, 0), (0x60FE, 2): (U32, 0)}
    with local_node(tool_bus.channel, 5, {**DRIVE, **outputs}) as node:
        assert "this controlword switches its torque on" in tool_bus.refused("write", "5", "6040", "0x0F")
        assert "it switches outputs, a brake or a gripper" in tool_bus.refused("write", "5", "60FE:01", "1")
        assert node.data_store == {}
        tool_bus.run("write", "5", "6040", "0x80")
        tool_bus.run("write", "5", "60FE:01", "1", "--may-move")
        assert {*node.data_store} == {0x6040, 0x60FE}


def test_of_a_node_that_is_no_drive_the_profile_is_let_alone_and_the_rest_is_written(tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 5, {**IDENTITY, (0x6200, 0): (U8, 0), (0x2F00, 0): (U8, 0)}) as node:
        told = tool_bus.refused("write", "5", "6200", "1", "--type", "UNSIGNED8")
        assert "shows no statusword (6041h), so what this moves or switches is not known" in told
        tool_bus.run("write", "5", "2F00", "1", "--type", "UNSIGNED8")
        assert {*node.data_store} == {0x2F00}


def test_parameters_are_stored_and_restored_by_their_signatures(tool_bus: ToolBus) -> None:
    memory = {(index, sub): (U32, 1) for index in (0x1010, 0x1011) for sub in (1, 2, 3)}
    with local_node(tool_bus.channel, 5, {**DRIVE, **memory}) as node:
        assert "node 5 has stored its parameters (all)" in tool_bus.run("store", "5")
        assert "at its next start" in tool_bus.run("restore", "5", "--parameters", "application")
        assert node.data_store == {0x1010: {1: b"save"}, 0x1011: {3: b"load"}}


@pytest.mark.usefixtures("simulated")
def test_a_drive_that_cannot_restore_says_so(tool_bus: ToolBus) -> None:
    assert "1011h:01 of node 1: abort 06020000h, object does not exist" in tool_bus.refused("restore", "1")


# Network management


def test_a_reset_shows_in_the_boot_up_and_a_start_in_the_heartbeat(simulated: Path, tool_bus: ToolBus) -> None:
    assert tool_bus.run("nmt", str(simulated), "left.J1", "reset-node") == "node 1 (left.J1): boot-up\n"
    tool_bus.run("write", "1", "1017", "50")
    assert tool_bus.run("nmt", "1", "start") == "node 1: Operational\n"
    assert tool_bus.run("nmt", "1", "stop") == "node 1: Stopped\n"
    assert tool_bus.run("nmt", "1", "pre-operational") == "node 1: Pre-operational\n"


@pytest.mark.usefixtures("simulated")
def test_all_nodes_are_ordered_at_once(tool_bus: ToolBus) -> None:
    told = tool_bus.run("nmt", "all", "reset-communication")
    assert sorted(told.splitlines()) == [f"node {number}: boot-up" for number in range(1, 7)]


def test_a_node_without_a_heartbeat_confirms_nothing(tool_bus: ToolBus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cell.commands.bus_tools.network_orders.CONFIRM_S", 0.1)
    with local_node(tool_bus.channel, 5, DRIVE) as node:
        told = tool_bus.refused("nmt", "5", "start")
        assert "node 5: nothing was heard within 0.1 s that confirms start; it may have obeyed all the same" in told
        assert node.nmt.state == "OPERATIONAL"


def test_stopped_nodes_are_ordered_by_all_though_they_answer_nothing(tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 5, {**DRIVE, (0x1017, 0): (U16, 20)}) as node:
        node.nmt.start_heartbeat(20)
        assert tool_bus.run("nmt", "all", "stop") == "node 5: Stopped\n"
        node.network.unsubscribe(0x605)
        assert tool_bus.run("nmt", "all", "pre-operational") == "node 5: Pre-operational\n"
        assert "does not tell whether it has torque" in tool_bus.refused("nmt", "all", "reset-node")


def test_where_nobody_is_heard_an_order_to_all_says_so(tool_bus: ToolBus, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cell.commands.bus_tools.network_orders.CONFIRM_S", 0.1)
    assert "no node answers, nor was anything heard within 0.1 s" in tool_bus.refused("nmt", "all", "start")


def test_no_drive_loses_its_torque_by_nmt_unless_that_is_wanted(tool_bus: ToolBus) -> None:
    with local_node(tool_bus.channel, 5, {**DRIVE, (0x6041, 0): (U16, 0x0237)}) as node:
        state = node.nmt.state
        for order in ("stop", "reset-node", "reset-communication"):
            assert f"statusword 0237h); NMT {order} is refused" in tool_bus.refused("nmt", "5", order)
        assert node.nmt.state == state
    assert "does not tell whether it has torque" in tool_bus.refused("nmt", "6", "reset-node")


# Errors


def test_the_history_of_errors_is_shown_with_what_the_codes_mean(drives_file: Path, tool_bus: ToolBus) -> None:
    history = {(0x1003, 0): (U8, 2), (0x1003, 1): (U32, 0x00078611), (0x1003, 2): (U32, 0x3210)}
    with local_node(tool_bus.channel, 1, {**DRIVE, **history, (0x1001, 0): (U8, 0x21)}) as node:
        told = tool_bus.run("errors", str(drives_file), "1").splitlines()
        assert told[0] == "node 1 (left.J1): error register 21h (generic, profile)"
        assert told[1].startswith("  1  8611h  maker's 0007h  following error over its window; ")
        assert told[2].startswith("  2  3210h  maker's 0000h  DC link over-voltage; ")
        assert "the history is deleted" in tool_bus.run("errors", "1", "--clear")
        assert node.data_store[0x1003][0] == b"\0"


@pytest.mark.usefixtures("simulated")
def test_a_drive_without_errors_has_an_empty_history(tool_bus: ToolBus) -> None:
    assert tool_bus.run("errors", "1").splitlines() == ["node 1: error register 00h (no error)", "its history is empty"]


# Layer setting services


NEW = (0x1D, 0x402, 0x10000, 4711)


def test_the_only_node_gets_a_new_node_id_and_stores_it(tool_bus: ToolBus) -> None:
    with lss_slave(tool_bus.channel, 127, NEW) as slave:
        assert tool_bus.run("node-id") == "Node-ID 127: vendor 1Dh, product 402h, revision 10000h, serial 1267h\n"
        told = tool_bus.run("node-id", "5", "--may-move")
        assert "Node-ID 5 is set, stored; it holds after: drive-gateway nmt ... 127 reset-communication" in told
        assert (slave.pending, slave.stored, slave.configuring) == (5, 5, False)


def test_one_of_several_nodes_is_named_by_its_identity(tool_bus: ToolBus) -> None:
    with lss_slave(tool_bus.channel, 0xFF, NEW) as first, lss_slave(tool_bus.channel, 0xFF, (*NEW[:3], 4712)) as second:
        assert "2 nodes answer by LSS; nothing was changed; name one by --vendor" in tool_bus.refused("node-id", "5")
        names = ("--vendor", "1Dh", "--product", "0x402", "--revision", "65536", "--serial")
        told = tool_bus.run("node-id", "5", "--no-store", *names, "4712")
        assert told.splitlines()[0].startswith("Node-ID none yet: vendor 1Dh")
        assert "not stored: it is gone with the supply; it holds now" in told
        assert (first.pending, second.pending, second.stored) == (0xFF, 5, 0xFF)
        assert "no node with the identity 1Dh, 402h, 10000h, 5h answers" in tool_bus.refused("node-id", *names, "5")


def test_a_node_that_cannot_store_and_a_node_id_that_is_taken_are_told(tool_bus: ToolBus) -> None:
    with lss_slave(tool_bus.channel, 0xFF, NEW) as slave, local_node(tool_bus.channel, 6, DRIVE):
        slave.store_error = 1
        assert "the node refuses by LSS: it cannot store by LSS" in tool_bus.refused("node-id", "5")
        slave.pending = 0xFF
        assert "node 6 answers already; no two nodes of a bus" in tool_bus.refused("node-id", "6")
        assert slave.pending == 0xFF


def test_where_nobody_has_lss_that_is_said(tool_bus: ToolBus) -> None:
    assert "no node answers by LSS; check power" in tool_bus.refused("node-id")


# Files


def test_a_dcf_is_compared_with_what_the_drive_holds(tmp_path: Path, tool_bus: ToolBus) -> None:
    text = eds_text()
    for index, value in (("6081", "100"), ("607A", "-7"), ("6085", "9"), ("6041", "1")):
        text = text.replace(f"[{index}]\n", f"[{index}]\nParameterValue={value}\n", 1)
    dcf = tmp_path / "my.dcf"
    dcf.write_text(text)
    with local_node(tool_bus.channel, 5, {**DRIVE, (0x607A, 0): (I32, -7), (0x6081, 0): (U32, 99)}):
        told = tool_bus.refused("compare", "5", "--dcf", str(dcf))
    lines = told.splitlines()
    assert lines[0].startswith("6081h:00  Profile velocity")
    assert "differs: file 100 (00000064h), drive 99 (00000063h)  [the gateway writes it: nothing:" in lines[0]
    assert "6085h:00" in lines[1]
    assert "drive: 6085h:00 of node 5: abort 06020000h, object does not exist" in lines[1]
    assert lines[2] == "node 5 and my.dcf: 1 the same, 1 differ, 1 cannot be read"


def test_the_plan_is_what_the_gateway_writes_object_by_object(drives_file: Path, tool_bus: ToolBus) -> None:
    told = tool_bus.run("plan", str(drives_file), "left.J1")
    assert told.startswith("node 1 (left.J1): NMT reset communication, and after its boot-up:\n")
    assert "  write, check  1017h:00  Producer heartbeat time in ms = 100 (0064h)  [heartbeat of the node]\n" in told
    period = "Communication cycle period = 4000 (00000FA0h)  [communication cycle period in us, unless the node has no"
    assert f"  write, check  1006h:00  {period} such object]\n" in told
    counter = "unless the node has no such counter, or has it right]\n"
    assert f"  write, check  1019h:00  Synchronous counter overflow value = 0 (00h)  [SYNC counter, {counter}" in told
    assert "not in " not in told
    assert told.endswith("  NMT start\n")
    assert tool_bus.run("plan", str(TWO_ARMS), "left_bus", "left.J1") == told
    assert tool_bus.run("plan", str(drives_file)).count("NMT start") == 6


def test_the_plan_has_io_nodes_and_a_scan_misses_them(simulated: Path, tool_bus: ToolBus) -> None:
    text = simulated.read_text(encoding="utf-8")
    simulated.write_text(text.replace("robots:\n", "io_nodes: {coupler: {node: 20, input_bytes: 1}}\nrobots:\n", 1))
    told = tool_bus.run("plan", str(simulated), "coupler")
    assert told.startswith("node 20 (I/O coupler): NMT reset communication, and after its boot-up:\n")
    assert "[device profile]" in told
    assert tool_bus.run("plan", str(simulated)).count("NMT start") == 7
    assert "no answer from node 20 (I/O coupler)" in tool_bus.refused("scan", str(simulated))


def test_a_drives_file_is_checked_alone(tmp_path: Path, tool_bus: ToolBus) -> None:
    copy = Copy(tmp_path)
    assert "left_drives is good: virtual two_arms_left, 1000 kbit/s, 6 nodes, 6 axes" in tool_bus.run(
        "check", str(copy.drives)
    )
    copy.change(DRIVES, "cycle_s: 0.004", "cycle_s: 0.0041239")
    told = tool_bus.refused("check", str(copy.drives))
    assert copy.place(DRIVES, "cycle_s: §0.0041239") in told
    assert "allowed 1 to 255 times 1 ms" in told
    assert "cell.yaml:" in tool_bus.refused("check", str(copy.folder / CELL))


def test_the_library_as_a_master_is_heard_as_one(tool_bus: ToolBus) -> None:
    with network_on(tool_bus.channel) as network:
        network.sync.start(0.02)
        try:
            assert "SYNC (080h) is heard" in tool_bus.refused("scan")
        finally:
            network.sync.stop()
