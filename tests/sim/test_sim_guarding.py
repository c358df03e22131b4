"""Node guarding in place of heartbeats: polled by remote frames, both sides notice when the other falls silent."""

from dataclasses import replace
from itertools import pairwise

from cell.core import Shutdown
from cell.messages import AxisStatus
from drive_gateway.canopen.frame import CanFrame
from tests.sim.gateway_bench import GatewayBench, axis, settings

GUARDED = settings(axis("J1", 1, guarded=True), axis("J2", 2))


def enabled() -> GatewayBench:
    world = GatewayBench(GUARDED)
    world.ready()
    world.enabled()
    return world


def test_a_guarded_node_answers_polls_with_a_toggle_and_sends_no_heartbeat() -> None:
    world = GatewayBench(GUARDED)
    world.ready()
    answers: list[bytes] = []
    world.lost = lambda frame: bool(frame.id == 0x701 and not frame.remote and answers.append(frame.data))
    world.run(1.0)
    assert {bytes([0x05]), bytes([0x85])} == set(answers)
    assert all(first != second for first, second in pairwise(answers))
    polls = [frame for frame in world.frames if frame.id == 0x701 and frame.remote]
    assert len(answers) < len(polls)
    assert not [frame for frame in world.frames if frame.id == 0x702 and frame.remote]


def test_a_node_whose_answers_are_lost_stops_the_robot_by_name() -> None:
    world = enabled()
    world.lost = lambda frame: frame.id == 0x701
    world.until(lambda: "heartbeat_lost" in world.codes(), within_s=1.0)
    assert "node 1 (left J1) did not answer its guarding for 0.2" in world.events[-1].text


def test_a_node_that_repeats_its_toggle_bit_is_not_believed() -> None:
    world = enabled()
    world.lost = lambda frame: frame.id == 0x701
    for _ in range(20):
        world.tell(CanFrame(0x701, b"\x05"))
        world.run(0.02)
    assert "heartbeat_lost" in world.codes()


def test_a_guarded_drive_brakes_by_itself_when_its_master_is_gone() -> None:
    world = GatewayBench(replace(GUARDED, overrun_limit_s=1.0))
    world.ready()
    world.enabled()
    world.alive = False
    world.run(1.0)
    assert world.bus.nodes[1].state.name in ("QUICK_STOP_ACTIVE", "FAULT")
    world.restart_gateway()
    world.ready()
    assert world.feedback.axes[0] in (AxisStatus.SWITCH_ON_DISABLED, AxisStatus.FAULT)


def test_no_node_misses_a_gateway_that_ends_in_order_whichever_way_it_watches() -> None:
    world, emergencies = enabled(), list[CanFrame]()
    world.lost = lambda frame: bool(frame.id in (0x081, 0x082) and emergencies.append(frame))
    world.tell(Shutdown())
    world.until(lambda: world.ended)
    world.alive = False
    world.run(2.0)
    assert emergencies == []
    world.restart_gateway()
    world.ready()
    world.enabled()
    world.alive = False
    world.until(lambda: {frame.id for frame in emergencies} == {0x081, 0x082}, within_s=2.0)
