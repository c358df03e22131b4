"""The gateway's core with byte-level drives on virtual time."""

import struct
from dataclasses import replace

import numpy as np
import pytest

from cell.core import Arrived, Shutdown
from cell.messages import (
    AxisStatus,
    Claim,
    DisableDrives,
    EnableDrives,
    Estop,
    GatewayState,
    PlayoutState,
    Release,
    ResetDrives,
    Run,
    Severity,
    Who,
)
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import RobotDrives
from drive_gateway.gateway.bus.bus_news import BusBack, BusDisturbed, BusFailed, SecondMaster
from drive_gateway.gateway.core import PART_S
from drive_gateway.gateway.effects import DrivesSlow, Frame, TakeBlocks
from drive_gateway.gateway.event_log import MOST_KINDS, TELL_S
from tests.unit.gateway_world import CYCLE_S, TIMES, KindManager, World, axis, block, gateway_settings, s_motion

S = AxisStatus
ENABLED = (S.OPERATION_ENABLED,) * 2
ESTOP = Estop("e1", True, "operator", "test")


def start_move(world: World, owner: int, distance: float = 0.4, duration_s: float = 1.0) -> None:
    """Queue a move and go on until the robot is in the middle of it."""
    before = world.feedback.commanded
    position, velocity = s_motion(duration_s, distance)
    world.send(owner, before + position, velocity)
    world.until(lambda: np.all(np.abs(world.feedback.commanded - before) > 0.3 * abs(distance)))


def moving_world() -> tuple[World, int]:
    world = World()
    owner = world.living = world.enabled()
    start_move(world, owner)
    return world, owner


def stopped_by(world: World, code: str) -> None:
    """The robot brakes by quick stop and ends in fault, with an alarm of that code."""
    world.until(lambda: code in world.codes())
    world.until(lambda: world.feedback.state is PlayoutState.FAULT)
    assert next(event for event in world.events if event.code == code).severity is Severity.ALARM


# Bring-up


def test_bring_up_claim_enable_and_a_played_move_reach_the_drives_count_by_count() -> None:
    world = World()
    owner = world.enabled()
    start = world.feedback.commanded
    move, velocity = s_motion(1.0, 0.4)
    first = world.send(owner, start + move, velocity)
    targets = {}
    while world.feedback.tick < first + len(move):
        world.frames.clear()
        world.cycle()
        rpdo = next(frame for frame in world.frames if frame.id == 0x202)
        targets[world.feedback.tick + 1] = struct.unpack("<Hi", rpdo.data)[1]
    expected = np.rint((start[1] + move[:, 1] - 0.25) * -100_000).astype(int).tolist()
    assert [targets[first + sample] for sample in range(len(move))] == expected
    assert (world.feedback.state, world.feedback.axes) == (PlayoutState.STARVED, ENABLED)
    world.run(0.02)
    np.testing.assert_allclose(world.feedback.position, start + 0.4, atol=1e-5)


def test_each_cycle_begins_with_its_sync_and_then_commands_every_node() -> None:
    world = World()
    world.enabled()
    world.frames.clear()
    world.cycle()
    assert [frame.id for frame in world.frames][:3] == [0x080, 0x201, 0x202]


def test_a_block_that_comes_while_a_cycle_is_worked_off_is_played_in_it() -> None:
    world = World()
    owner = world.enabled()
    world.run(0.1)
    position = world.feedback.commanded + np.array([[0.0, 0.0], [1e-5, 1e-5], [1e-5, 1e-5]])
    tick = world.feedback.tick
    late = block(owner, 99, tick + 2, position, np.zeros((3, 2)))
    sent: list[list[CanFrame]] = []
    for _ in range(2):
        world.now += CYCLE_S
        sent.append([])
        for effect in world.core.step(world.now):
            match effect:
                case Frame(frame):
                    sent[-1].append(frame)
                case TakeBlocks() if len(sent) == 1:
                    # SYNC has left, and nothing else.
                    assert [frame.id for frame in sent[-1]] == [0x080]
                    world.core.receive(late, world.now)
    # The first row is what was queued for its tick; the second one is two counts higher for J1 (200 000 per rad).
    targets = [struct.unpack("<i", frame.data[2:])[0] for frames in sent for frame in frames if frame.id == 0x201]
    assert targets[1] - targets[0] == 2


def test_a_node_is_configured_before_it_is_started() -> None:
    world = World()
    world.ready()
    indices = [index for index, _, _ in world.drives[1].writes]
    assert indices.index(0x6085) < indices.index(0x1400) < indices.index(0x1800)
    assert world.drives[1].objects[0x6060, 0] == b"\x08"
    assert world.drives[1].nmt == 5


def test_a_node_that_does_not_answer_is_named_and_joins_later() -> None:
    world = World()
    world.drives[2].alive = False
    world.until(lambda: world.state is not None and world.state.problem)
    assert "node 2 (left J2) sent no boot-up within 0.5 s" in world.state.problem
    assert "Node-ID" in world.state.problem
    assert world.codes() == ["node_absent"]
    world.drives[2].alive = True
    world.ready()
    assert world.state.problem == ""


def test_a_node_that_keeps_another_value_is_not_started() -> None:
    world = World()
    drive = world.drives[1]
    answer = drive.sdo

    def keeps_its_own(request):  # type: ignore[no-untyped-def]
        outcome = answer(request)
        drive.objects[0x6085, 0] = (77).to_bytes(4, "little")
        return outcome

    drive.sdo = keeps_its_own
    world.until(lambda: world.state is not None and world.state.problem)
    assert "6085h:00 (quick-stop deceleration) as 8000000 and still shows 77" in world.state.problem
    assert drive.nmt == 0x7F


def test_a_refused_object_is_named_with_its_abort_code() -> None:
    world = World()
    world.drives[1].refuse[0x6007, 0] = 0x06020000
    world.until(lambda: world.state is not None and world.state.problem)
    assert "write of 6007h:00" in world.state.problem
    assert "object does not exist" in world.state.problem


def test_the_masters_heartbeat_comes_from_the_cycle() -> None:
    world = World()
    world.run(1.0)
    beats = [frame for frame in world.frames if frame.id == 0x77F]
    assert len(beats) == pytest.approx(1.0 / 0.05, abs=2)
    assert beats[0].data == b"\x05"


# Claims and calls


def test_while_its_owner_lives_a_robot_is_refused_to_others_by_name() -> None:
    world = World()
    world.ready()
    owner = world.claim("a1")
    reply = world.ask(Claim("left", "a2", "d"))
    assert not reply.ok
    assert f"owned by boot a1 (owner {owner})" in reply.text


def test_the_owner_that_asks_again_gets_the_same_grant() -> None:
    world = World()
    world.ready()
    assert world.claim("a1") == world.claim("a1") == 100


def test_a_claim_tells_how_hard_each_drive_brakes_by_itself() -> None:
    world = World(gateway_settings((axis("J1", 1, quick_stop=20.0), axis("J2", 2, quick_stop=17.5))))
    world.ready()
    grant = world.ask(Claim("left", "a1", "d")).claim
    assert grant is not None
    assert grant.quick_stop == (20.0, 17.5)


def test_another_configuration_is_refused() -> None:
    reply = World().ask(Claim("left", "a1", "other"))
    assert not reply.ok
    assert "start both with the same cell file" in reply.text


def test_a_silent_owner_at_rest_loses_its_claim_and_its_boot_never_returns() -> None:
    world = World()
    world.ready()
    first = world.claim("a1")
    world.until(lambda: "claim_ended" in world.codes(), within_s=TIMES.owner_silent_s + 0.1)
    assert world.claim("a2") > first
    world.run(TIMES.owner_silent_s + 0.1)
    assert "was replaced" in world.ask(Claim("left", "a1", "d")).text


def test_hold_blocks_keep_the_claim_of_a_disabled_robot() -> None:
    world = World()
    world.ready()
    owner = world.claim()
    world.living = owner
    world.run(2.0)
    assert (world.feedback.owner, world.feedback.state) == (owner, PlayoutState.FOLLOWING)


def test_a_claim_does_not_end_while_the_robot_moves() -> None:
    world = World()
    owner = world.enabled()
    start = world.feedback.commanded
    position, velocity = s_motion(2.0, 0.5)
    world.send(owner, start + position, velocity)
    world.run(1.5)
    assert world.feedback.owner == owner
    world.until(lambda: world.feedback.owner == 0)
    np.testing.assert_allclose(world.feedback.position, start + 0.5, atol=1e-4)
    assert world.feedback.axes == ENABLED


def test_a_new_owner_takes_an_enabled_robot_over_from_the_commanded_position() -> None:
    world = World()
    world.enabled("a1")
    world.until(lambda: world.feedback.owner == 0)
    owner = world.claim("a2")
    assert (world.feedback.enabled, world.feedback.block) == (True, 0)
    start_move(world, owner)
    assert world.feedback.state is PlayoutState.PLAYING


def test_release_ends_the_claim_at_rest() -> None:
    world = World()
    world.ready()
    owner = world.claim()
    assert world.ask(Release("left", owner)).ok
    assert world.claim("a2") == owner + 1


def test_only_the_owner_may_enable() -> None:
    world = World()
    world.ready()
    owner = world.claim()
    reply = world.ask(EnableDrives("left", owner + 1))
    assert not reply.ok
    assert f"the present owner is {owner}" in reply.text


def test_a_repeated_call_is_answered_again_and_not_done_again() -> None:
    world = World()
    world.ready()
    owner = world.claim()
    first = world.request(EnableDrives("left", owner), "same")
    second = world.request(EnableDrives("left", owner), "same")
    world.until(lambda: second in world.replies)
    third = world.request(EnableDrives("left", owner), "same")
    world.until(lambda: third in world.replies)
    assert world.replies[first] == world.replies[second] == world.replies[third]
    assert world.codes().count("enabled") == 1


def test_who_and_a_call_for_somebody_else_are_answered() -> None:
    world = World(process="process 1")
    assert "gateway left_bus, boot g1, process 1" in world.ask(Who()).text
    assert "run is no call of a gateway" in world.ask(Run()).text
    assert "no robot right" in world.ask(Claim("right", "a1", "d")).text


# Enabling and disabling


def test_the_target_is_the_measured_position_before_torque_comes() -> None:
    world = World()
    world.ready()
    world.drives[1].position += 5_000
    owner = world.claim()
    world.ask(EnableDrives("left", owner))
    drive = world.drives[1]
    assert drive.target == drive.position
    assert drive.statuses[-4:] == [S.SWITCH_ON_DISABLED, S.READY_TO_SWITCH_ON, S.SWITCHED_ON, S.OPERATION_ENABLED]


def test_a_target_that_is_not_confirmed_gets_no_torque() -> None:
    world = World()
    world.ready()
    world.drives[2].refuse[0x607A, 0] = 0x06020000
    owner = world.claim()
    reply = world.ask(EnableDrives("left", owner))
    assert not reply.ok
    assert "taking over the measured position" in reply.text
    assert all(S.OPERATION_ENABLED not in drive.statuses for drive in world.drives.values())


def test_while_disabled_the_command_follows_the_measured_position() -> None:
    world = World()
    world.ready()
    world.drives[1].position += 10_000
    world.run(0.02)
    np.testing.assert_allclose(world.feedback.commanded, world.feedback.position)
    assert world.feedback.commanded[0] == pytest.approx(0.55)


def test_disabling_goes_down_step_by_step_and_is_refused_in_motion() -> None:
    world, owner = moving_world()
    assert "moves; halt it first" in world.ask(DisableDrives("left", owner)).text
    world.until(lambda: world.feedback.state is PlayoutState.STARVED)
    world.run(0.15)
    assert world.ask(DisableDrives("left", owner)).ok
    assert world.drives[1].statuses[-4:] == [
        S.OPERATION_ENABLED,
        S.SWITCHED_ON,
        S.READY_TO_SWITCH_ON,
        S.SWITCH_ON_DISABLED,
    ]
    assert world.feedback.state is PlayoutState.FOLLOWING


def test_a_drive_that_stays_off_is_named_in_the_answer() -> None:
    world = World()
    world.ready()
    world.drives[2]._next = lambda _word: S.SWITCH_ON_DISABLED  # no enable input
    owner = world.claim()
    reply = world.ask(EnableDrives("left", owner))
    assert not reply.ok
    assert "node 2 (left J2): Switch On Disabled" in reply.text
    world.until(lambda: all(drive.status is S.SWITCH_ON_DISABLED for drive in world.drives.values()))


def test_a_drive_that_does_not_switch_off_is_an_alarm_and_its_node_is_stopped() -> None:
    world = World()
    owner = world.enabled()
    world.drives[2]._next = lambda _word: S.OPERATION_ENABLED
    reply = world.ask(DisableDrives("left", owner))
    assert not reply.ok
    assert "node 2 (left J2): Operation Enabled" in reply.text
    alarm = next(event for event in world.events if event.code == "not_off")
    assert "hard-wired emergency stop" in alarm.remedy
    world.run(0.02)
    assert CanFrame(0, b"\x02\x02") in world.frames
    assert CanFrame(0, b"\x02\x01") not in world.frames


# Faults


def quick_stopped(world: World, node_id: int) -> bool:
    return S.QUICK_STOP_ACTIVE in world.drives[node_id].statuses


def emcy(node_id: int, code: int, register: int = 0x81) -> CanFrame:
    return CanFrame(0x080 + node_id, struct.pack("<HB5x", code, register))


def test_a_storm_of_emergencies_is_told_at_once_and_then_with_its_number() -> None:
    world, _ = moving_world()
    for _ in range(round(11.0 / CYCLE_S)):
        world.tell(emcy(1, 0x4310))
        world.cycle()
    told = [event.text for event in world.events if event.code == "emergency"]
    assert len(told) == 2
    assert "times more in 10 s" in told[1]
    assert int(told[1].split("(")[-1].split()[0]) == pytest.approx(10.0 / CYCLE_S, abs=2)


def test_a_storm_of_ever_other_codes_is_told_with_its_number_too() -> None:
    world, _ = moving_world()
    for code in range(0x1000, 0x1000 + 2000):
        world.tell(emcy(1, code))
        world.cycle()
    assert MOST_KINDS <= world.codes().count("emergency") <= MOST_KINDS + 1
    world.run(10.0)
    assert any("times more in 10 s" in event.text for event in world.events)


def test_an_emergency_that_comes_again_after_a_reset_is_told_again() -> None:
    world, owner = moving_world()
    for number in (1, 2):
        world.tell(emcy(1, 0x4310))
        world.until(lambda number=number: world.codes().count("emergency") == number)
        world.until(lambda: world.ask(ResetDrives("left", owner)).ok)


def test_a_warning_of_a_drive_that_goes_on_is_told_and_stops_nothing() -> None:
    world = World()
    owner = world.enabled()
    world.living = owner
    for _ in range(100):
        world.tell(emcy(1, 0x8120, 0x11))
        world.cycle()
    assert world.feedback.enabled
    [told] = [event for event in world.events if event.code == "drive_warning"]
    assert "8120h: CAN error passive" in told.text
    assert "emergency" not in world.codes()


def test_a_warning_of_a_drive_that_does_not_go_on_is_its_faults_reason() -> None:
    world, _ = moving_world()
    world.tell(*world.drives[1].fail(0x8120))
    stopped_by(world, "drive_fault")
    alarm = next(event for event in world.events if event.code == "drive_fault")
    assert "8120h" in alarm.text


def test_one_error_of_several_that_is_gone_does_not_take_the_others_with_it() -> None:
    world = World()
    world.ready()
    world.tell(emcy(1, 0x4310), emcy(1, 0x8120), emcy(1, 0x0000, 0x09))
    world.run(0.5)
    assert world.state is not None
    assert world.state.nodes[0].emergency_code == 0x4310
    world.tell(emcy(1, 0x0000, 0x00))
    world.run(0.5)
    assert world.state.nodes[0].emergency_code is None


def test_an_emergency_message_stops_all_drives_of_the_robot() -> None:
    world, _ = moving_world()
    world.tell(*world.drives[1].fail(0x8611))
    stopped_by(world, "emergency")
    assert quick_stopped(world, 2)
    alarm = next(event for event in world.events if event.code == "emergency")
    assert (alarm.data["node_id"], alarm.data["emergency_code"]) == (1, 0x8611)
    assert "following error" in alarm.text
    assert "node 1 (left J1)" in alarm.text


def test_a_drive_that_faults_without_a_word_stops_the_robot() -> None:
    world, _ = moving_world()
    world.drives[1].fail(0x2320)
    stopped_by(world, "drive_fault")
    assert quick_stopped(world, 2)


def test_a_drive_that_switches_itself_off_stops_the_robot() -> None:
    world, _ = moving_world()
    world.drives[1].status = S.SWITCH_ON_DISABLED
    world.drives[1]._next = lambda _word: S.SWITCH_ON_DISABLED
    stopped_by(world, "left_enabled")
    assert quick_stopped(world, 2)


def test_a_silent_tpdo_stops_the_robot() -> None:
    world, _ = moving_world()
    world.drives[1].quiet_tpdo = True
    stopped_by(world, "tpdo_silent")
    assert quick_stopped(world, 1)
    assert quick_stopped(world, 2)


@pytest.mark.parametrize(
    ("data", "found"),
    [("340200000000", "the newest shows statusword 0234h, which is no state of CiA 402"),
     ("3702", "the newest had 2 bytes instead of 6")],
)  # fmt: skip
def test_tpdos_that_say_nothing_stop_the_robot_and_are_described(data: str, found: str) -> None:
    world, _ = moving_world()
    world.drives[1].quiet_tpdo = True
    world.tell(CanFrame(0x181, bytes.fromhex(data)))
    stopped_by(world, "tpdo_silent")
    assert found in next(event for event in world.events if event.code == "tpdo_silent").text


def test_a_lost_heartbeat_stops_the_robot() -> None:
    world, _ = moving_world()
    world.drives[1].beat = lambda _now: []
    stopped_by(world, "heartbeat_lost")


def test_an_unexpected_boot_up_stops_the_robot() -> None:
    world, _ = moving_world()
    world.tell(*world.drives[1].take(CanFrame(0, b"\x82\x01")))
    stopped_by(world, "unexpected_boot")


def test_a_blocked_axis_stops_the_robot() -> None:
    world, _ = moving_world()
    world.drives[1].stuck = True
    stopped_by(world, "following_error")
    assert "node 1 (left J1)" in next(event for event in world.events if event.code == "following_error").text


def test_a_cycle_that_is_too_late_stops_the_robot() -> None:
    world, _ = moving_world()
    world.cycle(lateness_s=0.03)
    stopped_by(world, "late_cycle")


def test_a_cycle_that_is_a_little_late_is_counted_and_skips_no_sample() -> None:
    world, _ = moving_world()
    commanded = [world.feedback.commanded[0]]
    for lateness_s in (0.0, 0.01, 0.0, 0.0):
        world.cycle(lateness_s)
        commanded.append(world.feedback.commanded[0])
    world.until(lambda: world.state.counters.late_cycles == 1)
    assert np.ptp(np.diff(commanded, n=2)) < 1e-4
    assert world.state.counters.worst_lateness_s == pytest.approx(0.01)


def test_after_a_fault_nothing_moves_before_reset_and_enable() -> None:
    world, owner = moving_world()
    world.tell(*world.drives[1].fail(0x8611))
    stopped_by(world, "emergency")
    at = world.feedback.position
    assert "then reset it" in world.ask(EnableDrives("left", owner)).text
    world.drives[1].cause_present = False
    reply = world.ask(ResetDrives("left", owner))
    assert reply.ok, reply.text
    np.testing.assert_array_equal(world.feedback.position, at)
    assert world.feedback.state is PlayoutState.FOLLOWING
    assert world.ask(EnableDrives("left", owner)).ok


def test_a_reset_says_which_cause_is_still_there() -> None:
    world, owner = moving_world()
    world.tell(*world.drives[1].fail(0x8611))
    stopped_by(world, "emergency")
    reply = world.ask(ResetDrives("left", owner))
    assert not reply.ok
    assert "node 1 (left J1): Fault, 8611h following error" in reply.text
    assert world.feedback.state is PlayoutState.FAULT


def test_a_node_that_was_lost_is_brought_up_again_but_stays_off() -> None:
    world, _ = moving_world()
    world.drives[1].alive = False
    stopped_by(world, "tpdo_silent")
    world.drives[1].alive = True
    world.until(lambda: world.state.ready, within_s=10.0)
    assert world.feedback.state is PlayoutState.FAULT
    assert not world.feedback.enabled


def test_a_bus_that_fails_stops_the_robot_at_once_and_says_so_until_it_is_back() -> None:
    world, _ = moving_world()
    world.tell(BusFailed("Network is down"))
    stopped_by(world, "bus_failed")
    assert quick_stopped(world, 1)
    world.until(lambda: bool(world.state.problem))
    assert "CAN bus virtual:left failed: Network is down; check that the adapter" in world.state.problem
    assert not world.state.ready
    world.tell(BusBack())
    world.until(lambda: world.state.ready)
    assert "bus_back" in world.codes()
    assert world.feedback.state is PlayoutState.FAULT


def test_nodes_that_were_out_of_reach_are_brought_up_as_soon_as_the_bus_is_back() -> None:
    world = World(gateway_settings(boot_timeout_s=30.0))
    world.enabled()
    for drive in world.drives.values():
        drive.alive = False
    world.tell(BusFailed("Network is down"))
    world.run(TIMES.estop_delay_s + 0.5)
    for drive in world.drives.values():
        drive.alive = True
    world.tell(BusBack())
    world.until(lambda: world.state.ready, within_s=2.0)


def test_a_second_master_stops_the_robot_and_keeps_it_off_as_long_as_it_sends() -> None:
    world, owner = moving_world()
    world.tell(SecondMaster("somebody else sends 201h"))
    stopped_by(world, "second_master")
    assert quick_stopped(world, 1)
    told = len(world.codes())
    world.tell(*[SecondMaster("somebody else sends 201h")] * 3)
    world.cycle()
    assert world.codes()[told:] == ["second_master"], "once in a while, where nothing is left to stop"
    assert world.ask(ResetDrives("left", owner)).ok
    world.request(EnableDrives("left", owner))
    world.run(0.02)
    world.tell(SecondMaster("somebody else sends 201h"))
    stopped_by(world, "second_master")


def test_a_bus_that_fails_before_anything_runs_leaves_nothing_to_acknowledge() -> None:
    world = World()
    world.tell(BusFailed("Network is down"), BusBack(), BusDisturbed("no node acknowledges"))
    world.enabled()
    assert {"bus_failed", "bus_back", "bus_disturbed"} < set(world.codes())


def test_a_fault_of_one_robot_leaves_the_other_one_alone() -> None:
    robots = {
        "left": RobotDrives("left", (axis("J1", 1),)),
        "right": RobotDrives("right", (axis("J1", 11),)),
    }
    world = World(gateway_settings(robots=robots))
    world.ready()
    for robot in robots:
        reply = world.ask(Claim(robot, "a", "d"))
        assert world.ask(EnableDrives(robot, reply.claim.owner)).ok
    world.tell(*world.drives[1].fail(0x2320))
    world.until(lambda: "emergency" in world.codes())
    world.run(0.5)
    assert world.drives[11].status is S.OPERATION_ENABLED


# Emergency stop and end


def test_an_emergency_stop_lets_the_agent_brake_then_switches_off_and_confirms() -> None:
    world, _ = moving_world()
    world.tell(ESTOP)
    world.until(lambda: world.state.estop_confirmed == "e1", within_s=3.0)
    assert not any(quick_stopped(world, node_id) for node_id in world.drives)
    assert all(drive.status is S.SWITCH_ON_DISABLED for drive in world.drives.values())


def test_a_robot_that_still_moves_when_the_gateways_own_timer_ends_is_stopped_by_its_drives() -> None:
    world = World()
    owner = world.enabled()
    start_move(world, owner, distance=2.0, duration_s=8.0)
    world.tell(ESTOP)
    world.run(TIMES.estop_delay_s - 0.05)
    assert not quick_stopped(world, 1)
    world.until(lambda: quick_stopped(world, 1) and quick_stopped(world, 2), within_s=0.1)
    world.until(lambda: world.state.estop_confirmed == "e1", within_s=1.0)
    assert world.drives[1].status is S.SWITCH_ON_DISABLED


def test_a_drive_under_local_control_is_not_switched_on_and_the_operator_is_told_why() -> None:
    world = World()
    world.ready()
    owner = world.claim()
    world.drives[2].local = True
    reply = world.ask(EnableDrives("left", owner))
    assert not reply.ok
    assert reply.text.startswith("left got no further than switching on: node 1 (left J1): Switched On")
    assert "node 2 (left J2): Switch On Disabled, under local control (statusword bit 9 is 0); look" in reply.text


def test_a_drive_that_keeps_another_target_at_the_hand_over_gets_no_torque_to_move_with() -> None:
    world = World()
    world.ready()
    owner = world.claim()
    drive, answer = world.drives[2], world.drives[2].sdo
    old = struct.pack("<i", drive.position + 20_000)
    drive.sdo = lambda ask: replace(answer(ask), data=old) if (ask.index, ask.data) == (0x607A, None) else answer(ask)
    reply = world.ask(EnableDrives("left", owner))
    assert reply.text.startswith("left got no further than taking over the measured position: ")
    assert S.OPERATION_ENABLED not in drive.statuses


def test_enabling_waits_until_the_stop_is_cleared_by_its_own_id() -> None:
    world = World()
    world.manager = KindManager()
    world.ready()
    owner = world.claim()
    world.tell(ESTOP)
    assert "emergency stop e1 by operator is active" in world.ask(EnableDrives("left", owner)).text
    world.tell(Estop("other", False, "manager", ""))
    assert not world.ask(EnableDrives("left", owner)).ok
    world.run(0.3)
    world.tell(Estop("e1", False, "manager", ""), ESTOP)
    world.cycle()
    assert world.ask(EnableDrives("left", owner)).ok


def test_with_several_stops_nothing_is_enabled_before_the_last_is_cleared() -> None:
    world = World()
    world.manager = KindManager()
    world.ready()
    owner = world.claim()
    world.tell(ESTOP, Estop("e2", True, "bert", "door open, person inside"))
    world.until(lambda: world.state.estop_confirmed == "e1")
    world.run(0.01)
    world.tell(Estop("e1", False, "manager", ""))
    world.cycle()
    assert "emergency stop e2 by bert is active" in world.ask(EnableDrives("left", owner)).text
    world.until(lambda: world.state.estop_confirmed == "e2")
    world.run(0.01)
    world.tell(Estop("e2", False, "manager", ""))
    world.cycle()
    assert world.ask(EnableDrives("left", owner)).ok


def test_a_fault_under_an_emergency_stop_loses_its_voltage_at_rest() -> None:
    world, _ = moving_world()
    world.tell(*world.drives[1].fail(0x8611))
    stopped_by(world, "emergency")
    assert world.drives[2].status is S.QUICK_STOP_ACTIVE
    world.tell(ESTOP)
    world.until(lambda: world.state.estop_confirmed == "e1")
    assert world.drives[2].status is S.SWITCH_ON_DISABLED


def test_a_shutdown_plays_out_switches_off_and_leaves_the_nodes_pre_operational() -> None:
    world, owner = moving_world()
    before = world.feedback.commanded
    world.tell(Shutdown())
    world.until(lambda: world.finished, within_s=3.0)
    assert world.feedback.commanded[0] > before[0] + 0.1
    assert not quick_stopped(world, 1)
    assert all((drive.status, drive.nmt) == (S.SWITCH_ON_DISABLED, 0x7F) for drive in world.drives.values())
    assert world.feedback.owner in (0, owner)


def test_a_refused_block_is_told_once() -> None:
    world = World()
    owner = world.enabled()
    for sequence in range(1, 11):
        world.tell(block(owner, sequence, 1, np.tile(world.feedback.commanded, (3, 1)), np.zeros((3, 2))))
        world.cycle()
    (told,) = (event for event in world.events if event.code == "block_refused")
    assert told.severity is Severity.INFO, "one late block is an everyday matter"
    assert world.feedback.refused == 10


def test_many_late_blocks_are_a_warning() -> None:
    world = World()
    owner = world.enabled()
    for sequence in range(1, round(TELL_S / CYCLE_S) + 10):
        world.tell(block(owner, sequence, 1, np.tile(world.feedback.commanded, (3, 1)), np.zeros((3, 2))))
        world.cycle()
    told = [event for event in world.events if event.code == "block_refused"]
    assert [event.severity for event in told] == [Severity.INFO, Severity.WARNING]
    assert "times more in 10 s)" in told[1].text


def test_the_tick_counts_syncs() -> None:
    world = World()
    world.ready()
    world.run(10 * CYCLE_S)
    assert world.feedback.tick == sum(frame.id == 0x080 for frame in world.frames)


def test_simulated_drives_that_do_not_keep_up_are_an_event() -> None:
    world = World()
    world.tell(DrivesSlow("too slow", "use fewer axes"))
    world.cycle()
    (event,) = world.events
    assert (event.code, event.severity, event.text) == ("simulation_slow", Severity.WARNING, "too slow")


# Whoever lives, and the last words


def test_an_old_block_that_comes_again_and_again_is_no_sign_of_life_of_its_owner() -> None:
    world = World()
    owner = world.enabled()
    world.hold(owner)
    old = world._back[-1]
    world.run(0.2)
    for _ in range(round((TIMES.owner_silent_s + 0.5) / CYCLE_S)):
        world.tell(old)
        world.cycle()
    assert "claim_ended" in world.codes()
    assert world.feedback.owner == 0


def test_a_stray_block_of_a_high_sequence_does_not_silence_the_owner() -> None:
    world = World()
    owner = world.enabled()
    world.hold(owner)
    newest = world._back[-1]
    world.tell(replace(newest, sequence=newest.sequence + 100_000, velocity=newest.velocity + 1.0))
    world.living = owner
    world.run(TIMES.owner_silent_s + 0.5)
    assert "block_refused" in world.codes()
    assert world.feedback.owner == owner


def test_one_lost_answer_at_the_hand_over_is_asked_for_again() -> None:
    world = World()
    world.ready()
    drive, lost = world.drives[1], []
    answer = drive.sdo

    def sdo(request: Sdo) -> SdoDone:
        if request.index == 0x607A and request.data is None and not lost:
            lost.append(request)
            return SdoDone(request.request_id, b"", None, "No SDO response received within 0.5 s")
        return answer(request)

    drive.sdo = sdo
    world.enabled()
    assert lost


def test_a_drive_that_answers_nothing_any_more_does_not_keep_a_gateway_from_ending() -> None:
    world = World()
    world.ready()
    answer = world.drives[1].sdo
    world.drives[1].sdo = lambda request: (
        SdoDone("1/0", b"", None, "lost") if request.data == bytes(4) and request.index == 0x1016 else answer(request)
    )
    world.tell(Shutdown())
    world.until(lambda: world.finished, within_s=PART_S + 1.0)


class FarManager(KindManager):
    """A manager whose clock is 1000 s ahead, behind ways that take up to half a cycle each."""

    AHEAD_S = 1000.0

    def answer(self, state: GatewayState, now: float) -> Arrived:
        there, back = np.random.default_rng(self.sequence).uniform(0.0, CYCLE_S / 2.0, 2).tolist()
        said = super().answer(state, now).message
        return Arrived(replace(said, cell_time=now + there + self.AHEAD_S), now + there + back)  # type: ignore[type-var]


def test_it_tells_how_far_cell_time_is_ahead_of_its_clock_and_how_far_that_is_wrong_at_most() -> None:
    world = World()
    world.ready()
    assert world.state.clock is None
    world.manager = FarManager()
    world.until(lambda: world.state.clock is not None)
    for _ in range(10):
        world.run(0.25)
        clock = world.state.clock
        assert clock is not None
        assert abs(clock.offset_s - FarManager.AHEAD_S) <= clock.error_s < CYCLE_S + 0.003
