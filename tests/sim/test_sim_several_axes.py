"""A robot whose six axes sit on three nodes, with three, two and one drives: what befalls a node stops them all."""

import struct

import numpy as np
import pytest

from cell.messages import (
    AxisStatus,
    Claim,
    EnableDrives,
    Home,
    MoveAxes,
    ReadObject,
    ResetDrives,
    ScanBus,
    SetpointBlock,
    WriteObject,
)
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import NO_REMOTE
from drive_gateway.config.settings import EncoderSettings, InputSettings
from drive_gateway.sim.drives.power_state import DriveState
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, homing, settings

COUNTS = 100_000.0
START = 25_000
PLACES = {"J1": (1, 1), "J2": (1, 2), "J3": (1, 3), "J4": (4, 1), "J5": (4, 2), "J6": (6, 1)}
"""Node and axis of each joint; the identifiers of nodes 2, 3 and 5 belong to the further axes."""
AXES = settings(*(axis(name, node, number=number) for name, (node, number) in PLACES.items()))
DISTANCE = np.array([0.6, -0.5, 0.4, 0.3, -0.2, 0.1])
MOVE_S = 1.5


def positions(world: GatewayBench) -> np.ndarray:
    """Of the simulated axes themselves [counts], in the order of the joints."""
    return np.array([world.bus.nodes[node].drives[number - 1].position for node, number in PLACES.values()])


def states(world: GatewayBench) -> set[DriveState]:
    return {world.bus.nodes[node].drives[number - 1].state for node, number in PLACES.values()}


def moving() -> GatewayBench:
    world = GatewayBench(AXES)
    world.ready()
    owner = world.enabled()
    s = np.arange(0.0, MOVE_S + CYCLE_S / 2, CYCLE_S) / MOVE_S
    position = world.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), DISTANCE)
    velocity = np.outer(30 * s**2 * (1 - s) ** 2 / MOVE_S, DISTANCE)
    first = world.feedback.tick + 5
    world.tell(SetpointBlock("left", owner, 1, 0, first, CYCLE_S, len(s), position, velocity))
    world.until(lambda: world.feedback.block == 1)
    return world


def recover(world: GatewayBench) -> None:
    owner = world.ask(Claim("left", "after", "d")).claim.owner
    reset = world.ask(ResetDrives("left", owner))
    assert reset.ok, reset.text
    enabled = world.ask(EnableDrives("left", owner))
    assert enabled.ok, enabled.text


def stands(world: GatewayBench) -> None:
    """Every axis comes to rest, far from its target, and stays there."""
    world.run(1.0)
    stopped = positions(world)
    world.run(0.2)
    np.testing.assert_allclose(positions(world), stopped, atol=1.0)
    assert (np.abs(stopped - START) < 0.95 * np.abs(DISTANCE) * COUNTS).all()
    assert DriveState.OPERATION_ENABLED not in states(world)


def test_each_node_is_reset_configured_and_started_once_and_each_axis_written_at_its_own_objects() -> None:
    world = GatewayBench(AXES)
    world.ready()
    commands = [frame.data for frame in world.frames if frame.id == 0x000]
    assert sorted(commands) == sorted(bytes((word, node)) for word in (0x82, 0x01) for node in (1, 4, 6))
    written = [
        (request.index, request.sub, request.data)
        for request in world.requests
        if request.node_id == 1 and request.data
    ]
    indices = [index for index, _, _ in written]
    assert indices.index(0x1016) < indices.index(0x6085) < indices.index(0x6885) < indices.index(0x7085)
    assert [indices.count(index) for index in (0x1016, 0x1017, 0x6060, 0x6860, 0x7060)] == [1, 1, 1, 1, 1]
    for record, cob_id in ((0x1400, 0x201), (0x1440, 0x202), (0x1480, 0x203), (0x1800, 0x181), (0x1880, 0x183)):
        linked = [data for index, sub, data in written if (index, sub) == (record, 1)]
        assert struct.unpack("<I", linked[-1])[0] & ~NO_REMOTE == cob_id
    assert (0x1640, 2, struct.pack("<I", 0x687A0020)) in written
    assert (0x1A80, 1, struct.pack("<I", 0x70410010)) in written


def test_six_axes_on_three_nodes_are_enabled_and_follow_one_motion_together() -> None:
    world = moving()
    assert states(world) == {DriveState.OPERATION_ENABLED}
    assert set(world.feedback.axes) == {AxisStatus.OPERATION_ENABLED}
    world.run(0.5 * MOVE_S)
    shares = (positions(world) - START) / (DISTANCE * COUNTS)
    assert 0.2 < shares[0] < 0.8
    np.testing.assert_allclose(shares, shares[0], atol=1e-3)
    world.run(0.5 * MOVE_S + 0.1)
    np.testing.assert_allclose(positions(world), START + DISTANCE * COUNTS, atol=2.0)
    heartbeats = {number for number in range(1, 128) if world.bus.nodes.get(number) is not None}
    assert heartbeats == {1, 4, 6}
    assert [(node.node_id, node.axis) for node in world.state.nodes] == [(PLACES[name][0], name) for name in PLACES]


@pytest.mark.parametrize(("node", "number"), [(1, 3), (4, 2), (6, 1)])
def test_the_emergency_of_a_node_stops_all_axes_of_the_robot(node: int, number: int) -> None:
    world = moving()
    world.run(0.4)
    world.bus.nodes[node].raise_emergency(0x4310, axis=number)
    stands(world)
    assert world.bus.nodes[node].drives[number - 1].state is DriveState.FAULT
    alarms = [event for event in world.events if event.code == "emergency"]
    assert len(alarms) == 1
    assert f"node {node} (left" in alarms[0].text
    assert "4310h" in alarms[0].text
    # The emergency itself does not say which axis; 603Fh of each axis does.
    axis = {(1, 3): "node 1 axis 3 (left J3)", (4, 2): "node 4 axis 2 (left J5)"}.get((node, number))
    told = f"{axis} has the error 4310h: motor over-temperature"
    assert [event.text for event in world.events if event.code == "axis_error"] == ([f"left: {told}"] if axis else [])
    shown = {status.axis for status in world.state.nodes if status.emergency_code == 0x4310}
    assert shown == {{1: "J3", 4: "J5", 6: "J6"}[node]}
    assert (axis or "node 6 (left J6)") in world.ask(MoveAxes("left", {"J1": 0.1}, True, 1.0, False)).text
    recover(world)


def test_a_lost_heartbeat_of_a_node_stops_all_axes_of_the_robot_and_it_comes_back_as_one() -> None:
    world = moving()
    world.run(0.3)
    world.lost = lambda frame: frame.id == 0x704
    stands(world)
    alarms = [event for event in world.events if event.code == "heartbeat_lost"]
    assert [event.text.partition(" sent")[0] for event in alarms] == ["left: node 4 (left J4, J5)"]
    world.lost = lambda _frame: False
    world.ready()
    recover(world)


def test_a_node_whose_cable_is_out_stops_all_its_drives_by_itself() -> None:
    world = moving()
    world.run(0.3)
    world.bus.nodes[1].silence()
    stands(world)
    world.bus.nodes[1].silence(False)
    world.ready()
    recover(world)


def test_the_lost_process_data_of_one_axis_name_that_axis() -> None:
    world = moving()
    world.run(0.3)
    world.lost = lambda frame: frame.id == 0x182
    stands(world)
    silent = [event.text for event in world.events if event.code == "tpdo_silent"]
    assert len(silent) == 1
    assert silent[0].startswith("left: node 1 axis 2 (left J2) sent no TPDO")


def test_the_set_up_of_one_axis_leaves_the_other_drives_of_its_node_off() -> None:
    world = GatewayBench(AXES)
    world.ready()
    before = positions(world)
    assert world.set_up(MoveAxes("left", {"J2": 0.1, "J5": -0.1}, True, 1.0, False)) == "done"
    moved = (positions(world) - before) / COUNTS
    np.testing.assert_allclose(moved, [0.0, 0.1, 0.0, 0.0, -0.1, 0.0], atol=2e-4)


def test_what_the_gateway_keeps_of_a_further_axis_is_not_for_write() -> None:
    world = GatewayBench(AXES)
    world.ready()
    assert world.ask(ReadObject(1, 0x6864, 0)).data == struct.pack("<i", START).hex()
    for index in (0x6840, 0x707A, 0x6885):
        refused = world.ask(WriteObject(1, index, 0, "0000"))
        assert not refused.ok
        assert "the gateway's" in refused.text


def test_an_object_of_a_further_axis_is_written_while_all_are_off_and_a_scan_names_each_axis() -> None:
    world = GatewayBench(AXES)
    world.ready()
    write = WriteObject(1, 0x7081, 0, "39300000")
    written = world.ask(write)
    assert written.ok, written.text
    assert world.ask(ReadObject(1, 0x7081, 0)).data == "39300000"
    assert world.ask(ReadObject(1, 0x6081, 0)).data != "39300000"
    assert world.ask(ScanBus()).text.splitlines()[:3] == [
        "node 1 (left J1): Switch On Disabled",
        "node 1 axis 2 (left J2): Switch On Disabled",
        "node 1 axis 3 (left J3): Switch On Disabled",
    ]
    world.enabled()
    assert "disable it first" in world.ask(write).text


def test_two_axes_with_one_error_say_that_it_is_gone_when_both_are_reset() -> None:
    world = GatewayBench(AXES)
    world.ready()
    node = world.bus.nodes[1]
    sent: list[CanFrame] = []
    node.raise_emergency(0x4310, axis=1)
    node.raise_emergency(0x4310, axis=2)
    sent += node.step(world.now + 0.001)
    for cob_id, gone in ((0x201, []), (0x202, [b"\0" * 8])):
        for word in (0x00, 0x80):
            node.receive(CanFrame(cob_id, struct.pack("<Hi", word, START)), world.now)
            sent += node.receive(CanFrame(0x080, b""), world.now)
        told = [frame.data for frame in sent if frame.id == 0x081]
        assert told[1:] == gone


def test_a_node_whose_supply_fails_in_motion_stops_the_robot_and_is_configured_again_with_all_its_axes() -> None:
    world = moving()
    world.run(0.4)
    before = len(world.requests)
    world.bus.nodes[1].power_cycle()
    stands(world)
    alarms = [event for event in world.events if event.code == "unexpected_boot"]
    assert [event.text for event in alarms] == [
        "left: node 1 (left J1, J2, J3) restarted by itself and lost its configuration"
    ]
    world.ready()
    written = {(request.node_id, request.index) for request in world.requests[before:] if request.data}
    assert {(1, 0x1017), (1, 0x6085), (1, 0x6885), (1, 0x7085)} <= written
    assert {node for node, _ in written} == {1}
    recover(world)


def test_the_axes_of_a_node_home_each_by_its_own_method_and_are_all_lost_with_its_supply() -> None:
    world = GatewayBench(
        settings(
            axis("J1", 1, incremental=True, homing=homing(17, 0.3, order=2)),
            axis("J2", 1, number=2, incremental=True, homing=homing(18, 0.7)),
            axis("J3", 1, number=3),
        )
    )
    world.ready()
    assert world.set_up(Home("left", ())) == "done"
    assert world.said[0] == "homing of left (J2, then J1) is done"
    assert world.feedback.referenced
    drives = world.bus.nodes[1].drives
    places = [drive.position / COUNTS + 0.25 for drive in drives]
    np.testing.assert_allclose(world.feedback.position, places, atol=1e-4)
    world.bus.nodes[1].power_cycle()
    world.until(lambda: not world.state.ready)
    world.ready()
    assert [node.axis for node in world.state.nodes if not node.referenced] == ["J1", "J2"]


def test_the_encoder_of_one_axis_is_judged_by_itself() -> None:
    check = EncoderSettings(counts_per_turn=20_000, window=1_000, serial=(0x2810, 1), status=None, battery_mask=0)
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 1, number=2, absolute=check)))
    world.ready()
    world.bus.nodes[1].exchange_encoder(4711, axis=2)
    world.bus.nodes[1].power_cycle()
    world.until(lambda: not world.state.ready)
    world.ready()
    assert [node.axis for node in world.state.nodes if not node.referenced] == ["J2"]


def test_a_door_at_the_inputs_of_one_axis_takes_the_torque_of_the_whole_robot() -> None:
    guarded = [axis("J1", 1), axis("J2", 1, number=2, inputs=InputSettings(door=(18,))), axis("J3", 4)]
    world = GatewayBench(settings(*guarded))
    world.ready()
    world.enabled()
    world.bus.nodes[1].set_input(18, False, axis=2)
    world.until(lambda: set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}, within_s=0.4)
    opened = [event.text for event in world.events if event.code == "door_open"]
    assert opened == ["left: node 1 axis 2 (left J2): guard door (60FDh bit 18) is open"]
