"""Set-up with real frames: axes home, and move by their drives' own profiles, while an operator holds them."""

from dataclasses import replace

import numpy as np
import pytest

from cell.messages import AxisStatus, Claim, DisableDrives, EnableDrives, Estop, Home, MoveAxes
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import RobotDrives
from tests.sim.gateway_bench import GatewayBench, axis, homing, settings

INCREMENTAL = settings(
    axis("J1", 1, incremental=True, homing=homing(17, 0.1, order=2)),
    axis("J2", 2, counts_per_unit=-80_000.0, incremental=True, homing=homing(23, 0.7)),
    axis("J3", 3),
)


def bench() -> GatewayBench:
    world = GatewayBench(INCREMENTAL)
    world.ready()
    return world


def places(world: GatewayBench) -> np.ndarray:
    """Where the axes really are [rad], whatever their drives believe."""
    axes = world.settings.robots["left"].axes
    return np.array([world.bus.nodes[a.node_id].position / a.counts_per_unit + a.offset for a in axes])


def test_an_incremental_axis_is_not_referenced_and_not_enabled_before_it_has_homed() -> None:
    world = bench()
    assert not world.feedback.referenced
    owner = world.ask(Claim("left", "a1", "d")).claim.owner
    refused = world.ask(EnableDrives("left", owner))
    assert refused.text == "left is not referenced: J1, J2: its encoder is incremental; home it: cell home"


def test_homing_in_order_lets_every_axis_know_where_it_is_and_the_robot_be_enabled() -> None:
    world = bench()
    assert world.set_up(Home("left", ())) == "done"
    assert world.said[0] == "homing of left (J2, then J1) is done"
    assert "setup_done" in world.codes()
    assert world.feedback.referenced
    assert world.feedback.position == pytest.approx(places(world), abs=1e-4)
    world.enabled()


def test_while_it_homes_the_robot_is_unknown_only_its_own_axes_have_torque_and_nobody_may_enable_it() -> None:
    world = bench()
    owner = world.ask(Claim("left", "a1", "d")).claim.owner
    assert world.ask(Home("left", ("J2",))).ok
    world.holder = "left"
    world.until(lambda: world.feedback.axes[1] is AxisStatus.OPERATION_ENABLED)
    assert not world.feedback.referenced
    assert not world.feedback.enabled
    assert world.feedback.axes[0] is world.feedback.axes[2] is AxisStatus.SWITCH_ON_DISABLED
    assert "being set up" in world.ask(EnableDrives("left", owner)).text


def test_a_drive_that_does_not_find_its_home_point_is_named() -> None:
    world = GatewayBench(settings(axis("J1", 1, incremental=True, homing=homing(33, 0.0))))
    world.ready()
    assert world.set_up(Home("left", ())) == "stopped"
    assert world.said[0] == "stopped: node 1 (left J1) did not find its home point (homing error)"


def test_an_axis_that_fails_stops_the_others_of_its_motion() -> None:
    axes = (axis("J1", 1, incremental=True, homing=homing(33, 0.0)), axis("J2", 2, homing=homing(17, 0.1)))
    world = GatewayBench(settings(*axes))
    world.ready()
    start = places(world)[1]
    assert world.set_up(Home("left", ())) == "stopped"
    assert "node 1 (left J1) did not find its home point" in world.said[0]
    assert abs(places(world)[1] - start) < 0.05
    assert set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}


def test_an_emergency_stop_and_a_fault_end_it() -> None:
    for trouble in ("estop", "fault"):
        world = bench()
        assert world.ask(Home("left", ("J1",))).ok
        world.holder = "left"
        world.until(lambda w=world: w.feedback.axes[0] is AxisStatus.OPERATION_ENABLED)
        if trouble == "estop":
            world.tell(Estop("e1", True, "op", "test"))
        else:
            world.bus.nodes[1].raise_emergency(0x4310)
        world.until(lambda w=world: "setup_stopped" in w.codes(), within_s=2.0)
        world.run(0.5)
        assert world.feedback.axes[0] in (AxisStatus.SWITCH_ON_DISABLED, AxisStatus.FAULT)
        assert not world.feedback.referenced
        refused = world.ask(Home("left", ("J1",)))
        assert not refused.ok
        why = "left stays off: emergency stop e1" if trouble == "estop" else "left is in fault (node 1 (left J1)"
        assert refused.text.startswith(why)


@pytest.mark.parametrize("by_velocity", [False, True])
def test_axes_move_by_their_own_profiles_and_arrive_together(by_velocity: bool) -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2, counts_per_unit=-80_000.0), axis("J3", 3)))
    world.ready()
    start = places(world)
    moved: dict[int, list[float]] = {0: [], 1: []}
    assert world.ask(MoveAxes("left", {"J1": 0.4, "J2": -0.1}, True, 1.0, by_velocity)).ok
    world.holder, world.said = "left", ("", "moving")
    while world.said[1] == "moving":
        world.cycle()
        for number, times in moved.items():
            if abs(world.feedback.velocity[number]) > 0.01:
                times.append(world.now)
    world.holder = ""
    wanted = start + np.array([0.4, -0.1, 0.0])
    assert places(world) == pytest.approx(wanted, abs=0.01 if by_velocity else 2e-3)
    assert moved[0][0] == pytest.approx(moved[1][0], abs=0.06)
    assert moved[0][-1] == pytest.approx(moved[1][-1], abs=0.06)
    world.run(0.3)
    world.enabled()


def test_the_mode_is_back_at_cyclic_synchronous_position_before_the_robot_is_enabled() -> None:
    world = GatewayBench(settings(axis("J1", 1)))
    world.ready()
    assert world.set_up(MoveAxes("left", {"J1": 0.6}, False, 0.5, False)) == "done"
    world.enabled()
    world.run(0.5)
    assert world.feedback.position == pytest.approx([0.6], abs=2e-3)
    assert not [event for event in world.events if event.severity.value == "alarm"]


@pytest.mark.parametrize(
    ("command", "text"),
    [
        (MoveAxes("left", {"J9": 0.1}, True, 1.0, False), "left has no axis J9; its axes are J1, J2, J3"),
        (MoveAxes("left", {"J1": 0.1}, False, 1.0, False), "J1 of left not referenced; home first"),
        (MoveAxes("left", {"J3": 0.1}, True, 2.0, False), "1 axes at speed 2; allowed are one or more, above 0"),
        (MoveAxes("left", {"J3": 1e200}, True, 1.0, False), "J3 would go by 5.72958e+201 deg; allowed are 2.46083e+06"),
        (MoveAxes("left", {"J3": 1e300}, True, 1.0, True), "allowed are 2.46083e+06, 32 bits of counts"),
        (Home("left", ("J3",)), "node 3 (left J3) has no homing in the drives file"),
    ],
)
def test_what_cannot_be_done_is_refused_with_what_is_allowed(command: Home | MoveAxes, text: str) -> None:
    assert text in bench().ask(command).text


def test_an_axis_moves_when_its_brake_has_had_the_time_to_open() -> None:
    world = GatewayBench(settings(axis("J1", 1, brake_s=0.2)))
    world.ready()
    assert world.ask(MoveAxes("left", {"J1": 0.1}, True, 1.0, False)).ok
    world.holder = "left"
    world.until(lambda: world.feedback.axes[0] is AxisStatus.OPERATION_ENABLED)
    enabled, place = world.now, places(world)[0]
    world.until(lambda: places(world)[0] != place)
    assert 0.2 <= world.now - enabled < 0.25


def test_a_late_cycle_ends_it() -> None:
    """A profile velocity would run on beyond its stop time by as much."""
    world = GatewayBench(settings(axis("J1", 1)))
    world.ready()
    assert world.ask(MoveAxes("left", {"J1": 0.3}, True, 1.0, True)).ok
    world.holder = "left"
    world.until(lambda: world.feedback.velocity[0] > 0.3)
    world.cycle(late_s=0.03)
    world.until(lambda: world.feedback.axes[0] is AxisStatus.QUICK_STOP_ACTIVE, within_s=0.05)
    assert "late_cycle" in world.codes()


def test_while_a_robot_is_set_up_no_other_one_of_its_bus_has_torque() -> None:
    other = RobotDrives("right", (axis("J1", 3),))
    both = settings(axis("J1", 1))
    world = GatewayBench(replace(both, robots={**both.robots, "right": other}))
    world.ready()
    owner = world.ask(Claim("right", "r1", "d")).claim.owner
    move = MoveAxes("left", {"J1": 0.3}, True, 1.0, False)
    assert world.ask(EnableDrives("right", owner)).ok
    refused = world.ask(move)
    assert refused.text == "set-up needs every other robot disabled, right is not: cell disable right"
    assert world.ask(DisableDrives("right", owner)).ok
    assert world.ask(move).ok
    refused = world.ask(EnableDrives("right", owner))
    assert refused.text == "right stays off: left is being set up; one robot at a time"
    assert world.ask(replace(move, robot="right")).text == "left is being set up; one robot at a time"
    world.until(lambda: "setup_stopped" in world.codes(), within_s=2.0)
    owner = world.ask(Claim("right", "r1", "d")).claim.owner
    assert world.ask(EnableDrives("right", owner)).ok


def test_an_enabled_robot_is_not_set_up() -> None:
    world = GatewayBench(settings(axis("J1", 1)))
    world.ready()
    world.enabled()
    assert world.ask(MoveAxes("left", {"J1": 0.1}, True, 1.0, False)).text == "left is on; disable it first"


def test_every_drive_goes_back_to_the_mode_of_blocks_after_a_motion_of_its_own() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2)))
    world.ready()
    assert world.set_up(MoveAxes("left", {"J1": 0.1, "J2": 0.1}, True, 1.0, False)) == "done"
    world.run(0.3)
    for node in (1, 2):
        assert world.bus.sdo(Sdo("x", node, 0x6061, 0, None), world.now).data == b"\x08"


def test_a_drive_that_does_not_take_its_mode_back_is_told_once_and_keeps_the_robot_off() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2)))
    world.ready()
    sdo, asked = world.bus.sdo, 0

    def refusing(request: Sdo, now: float) -> SdoDone:
        nonlocal asked
        if (request.index, request.data) == (0x6060, b"\x08"):
            asked += 1
            return SdoDone(request.request_id, b"", 0x06090030, "abort 06090030h")
        return sdo(request, now)

    world.bus.sdo = refusing
    assert world.set_up(MoveAxes("left", {"J1": 0.02}, True, 1.0, False)) == "done"
    world.run(2.0)
    told = [event.text for event in world.events if event.code == "mode_refused"]
    why = "node 1 (left J1) does not take mode of operation 8: 6061h:00 shows 1 and answers abort 06090030h"
    assert told == [why]
    assert asked < 30
    assert (world.state.ready, world.state.problem) == (False, why)
    owner = world.ask(Claim("left", "a", "d")).claim.owner
    assert world.ask(EnableDrives("left", owner)).text == f"left stays off: {why}"
    world.bus.sdo = sdo
    world.until(lambda: world.state.ready, within_s=0.5)
    assert world.ask(EnableDrives("left", owner)).ok


def test_a_drive_that_is_being_prepared_is_written_nothing_more_when_its_motion_is_stopped() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2)))
    world.ready()
    assert world.ask(MoveAxes("left", {"J1": 0.1}, True, 1.0, False)).ok
    world.holder = "left"
    world.until(lambda: any(request.data is not None and request.index == 0x60FF for request in world.requests))
    world.tell(Estop("e1", True, "op", "test"))
    world.until(lambda: "setup_stopped" in world.codes(), within_s=0.1)
    written = len(world.requests)
    world.run(0.5)
    assert {request.index for request in world.requests[written:] if request.data is not None} == {0x6060}
