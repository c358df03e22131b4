"""A node on its bus: network states and what they gate, process data, heartbeats, emergencies."""

import struct

import pytest

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.nmt import NmtState
from drive_gateway.sim.drives.power_state import DriveState
from tests.unit.sim_drive_world import LAG_S, NODE, QUICK_STOP, START, Bench, Refused

READ_DEVICE_TYPE = bytes.fromhex("4000100000000000")
HEARTBEAT_OF_MASTER = 0x77F
DISABLE, SHUTDOWN, RESET = 0x00, 0x06, 0x80


def booted() -> Bench:
    bench = Bench()
    bench.boot()
    return bench


def enabled(**changes: int) -> Bench:
    bench = Bench()
    bench.prepare(**changes)
    bench.enable()
    return bench


# Network management


def test_node_says_boot_up_once_and_is_pre_operational() -> None:
    bench = booted()
    assert bench.sent == [CanFrame(0x703, b"\0")]
    assert bench.node.nmt is NmtState.PRE_OPERATIONAL


def test_node_hears_nothing_while_it_initialises() -> None:
    bench = Bench()
    assert bench.send(0x600 + NODE, READ_DEVICE_TYPE) == []


@pytest.mark.parametrize(("command", "state"), [(0x01, 5), (0x02, 4), (0x80, 0x7F)])
def test_command_of_the_master_leads_to_its_state(command: int, state: int) -> None:
    bench = booted()
    bench.nmt(command)
    assert bench.node.nmt == state


def test_command_to_another_node_is_ignored() -> None:
    bench = booted()
    bench.send(0x000, bytes((0x01, NODE + 1)))
    assert bench.node.nmt is NmtState.PRE_OPERATIONAL


def test_command_to_node_zero_is_for_all() -> None:
    bench = booted()
    bench.send(0x000, b"\x01\x00")
    assert bench.node.nmt is NmtState.OPERATIONAL


def test_sdo_is_not_answered_in_stopped() -> None:
    bench = booted()
    bench.nmt(0x02)
    assert bench.send(0x600 + NODE, READ_DEVICE_TYPE) == []


def test_pdo_is_not_taken_in_pre_operational() -> None:
    bench = Bench()
    bench.prepare()
    bench.nmt(0x80)
    bench.send(0x200 + NODE, struct.pack("<Hi", SHUTDOWN, 7))
    assert bench.send(0x080, b"") == []
    assert bench.read(0x607A) == 0


def test_reset_of_the_communication_keeps_the_parameters_of_the_drive() -> None:
    bench = Bench()
    bench.prepare()
    bench.nmt(0x82)
    bench.boot()
    assert (bench.read(0x6085), bench.read(0x1400, 1)) == (QUICK_STOP, 0x80000200 + NODE)


def test_reset_of_the_node_restores_all_power_on_values() -> None:
    bench = Bench()
    bench.prepare()
    bench.nmt(0x81)
    bench.boot()
    assert (bench.read(0x6085), bench.read(0x6061)) == (100_000, 0)
    assert bench.sent_on(0x703)[-1] == b"\0"


# Process data


def test_tpdo_answers_each_sync_with_statusword_and_position() -> None:
    bench = Bench()
    bench.prepare()
    assert bench.send(0x080, b"") == [CanFrame(0x183, struct.pack("<Hi", 0x0250, START))]


def test_tpdo_of_type_three_answers_every_third_sync() -> None:
    bench = Bench()
    bench.prepare(x1800_2=3)
    assert [len(bench.send(0x080, b"")) for _ in range(7)] == [0, 0, 1, 0, 0, 1, 0]


def test_acyclic_tpdo_answers_a_sync_after_a_change() -> None:
    bench = Bench()
    bench.prepare(x1800_2=0)
    counts = [len(bench.send(0x080, b"")) for _ in range(2)]
    bench.write(0x6040, 0, SHUTDOWN, 2)
    assert [*counts, len(bench.send(0x080, b""))] == [1, 0, 1]


def test_event_tpdo_comes_by_its_timer() -> None:
    bench = booted()
    bench.write(0x1800, 5, 40, 2)
    bench.write(0x1800, 1, 0x183, 4)
    bench.nmt(0x01)
    bench.wait(0.2)
    assert len(bench.sent_on(0x183)) == 5


def test_event_tpdo_keeps_its_inhibit_time() -> None:
    bench = booted()
    bench.write(0x1800, 3, 100, 2)
    bench.write(0x1800, 1, 0x183, 4)
    bench.nmt(0x01)
    words = iter([SHUTDOWN, DISABLE] * 25)
    bench.wait(0.05, lambda: bench.write(0x6040, 0, next(words), 2))
    assert 4 <= len(bench.sent_on(0x183)) <= 6


def test_remote_frame_gets_a_tpdo_that_allows_it() -> None:
    bench = booted()
    bench.write(0x1800, 1, 0x183, 4)
    bench.nmt(0x01)
    assert bench.send(0x183, b"", remote=True) == [CanFrame(0x183, b"\x50\x02")]


def test_synchronous_rpdo_waits_for_the_sync() -> None:
    bench = Bench()
    bench.prepare()
    bench.send(0x200 + NODE, struct.pack("<Hi", SHUTDOWN, START))
    before = bench.node.state
    bench.send(0x080, b"")
    assert (before, bench.node.state) == (DriveState.SWITCH_ON_DISABLED, DriveState.READY_TO_SWITCH_ON)


def test_event_driven_rpdo_acts_at_once() -> None:
    bench = Bench()
    bench.prepare(x1400_2=255)
    bench.send(0x200 + NODE, struct.pack("<Hi", SHUTDOWN, START))
    assert bench.node.state is DriveState.READY_TO_SWITCH_ON


def test_short_rpdo_is_told_once_and_does_nothing() -> None:
    bench = Bench()
    bench.prepare()
    for _ in range(3):
        bench.send(0x200 + NODE, b"\x06")
        bench.send(0x080, b"")
    assert bench.sent_on(0x083) == [bytes.fromhex("1082110000000000")]
    assert bench.node.state is DriveState.SWITCH_ON_DISABLED


# Heartbeats


def test_heartbeat_comes_in_its_period_with_the_state() -> None:
    bench = booted()
    bench.write(0x1017, 0, 100, 2)
    bench.wait(1.0)
    bench.nmt(0x02)
    bench.wait(0.1)
    assert bench.sent_on(0x703) == [b"\0"] + [b"\x7f"] * 10 + [b"\x04"]


def beating() -> Bench:
    """Enabled, with the master's heartbeat watched for 0.1 s."""
    bench = Bench()
    bench.boot()
    bench.write(0x1016, 1, 0x7F << 16 | 100, 4)
    bench.prepare()
    bench.send(HEARTBEAT_OF_MASTER, b"\x05")
    bench.enable()
    return bench


def test_lost_heartbeat_is_told_and_leaves_operational() -> None:
    bench = beating()
    bench.write(0x2000, 0, 255, 1)
    bench.wait(0.15)
    assert bench.sent_on(0x083) == [bytes.fromhex("3081110000000000")]
    assert bench.node.nmt is NmtState.PRE_OPERATIONAL


@pytest.mark.parametrize(
    ("option", "state"),
    [(1, DriveState.FAULT), (2, DriveState.SWITCH_ON_DISABLED), (3, DriveState.QUICK_STOP_ACTIVE)],
)
def test_lost_heartbeat_stops_the_axis_as_6007h_says(option: int, state: DriveState) -> None:
    bench = beating()
    bench.write(0x6007, 0, option, 2)
    target = bench.node.position
    for _ in range(100):
        target += 40.0
        bench.wait(0.004)
        bench.send(0x080, b"")
        bench.send(0x200 + NODE, struct.pack("<Hi", 0x0F, round(target)))
    position = bench.node.position
    bench.wait(0.2)
    assert bench.node.state is state
    assert bench.node.position == position


def test_heartbeat_that_returns_is_told() -> None:
    bench = beating()
    bench.wait(0.15)
    bench.write(0x6040, 0, 0, 2)
    bench.send(HEARTBEAT_OF_MASTER, b"\x05")
    bench.write(0x6040, 0, RESET, 2)
    bench.wait(0.01)
    assert bench.sent_on(0x083)[-1] == bytes(8)
    assert bench.read(0x1001) == 0


def test_fault_is_not_reset_while_the_heartbeat_is_missing() -> None:
    bench = beating()
    bench.write(0x6007, 0, 1, 2)
    bench.write(0x2000, 0, 255, 1)
    bench.wait(0.15)
    bench.write(0x6040, 0, 0, 2)
    bench.write(0x6040, 0, RESET, 2)
    assert bench.node.state is DriveState.FAULT
    assert bench.sent_on(0x083) == [bytes.fromhex("3081110000000000")] * 2


def test_master_that_was_never_heard_is_not_missed() -> None:
    bench = booted()
    bench.write(0x1016, 1, 0x7F << 16 | 100, 4)
    bench.wait(1.0)
    assert bench.sent_on(0x083) == []


# Errors and injected faults


def test_error_history_keeps_the_newest_first() -> None:
    bench = booted()
    for code in (0x3210, 0x4310):
        bench.node.raise_emergency(code)
    bench.wait(0.001)
    assert [bench.read(0x1003, sub) for sub in (0, 1, 2)] == [2, 0x4310, 0x3210]


def test_error_history_is_deleted_by_zero_only() -> None:
    bench = booted()
    bench.node.raise_emergency(0x3210)
    with pytest.raises(Refused, match="06090030"):
        bench.write(0x1003, 0, 1, 1)
    bench.write(0x1003, 0, 0, 1)
    assert (bench.read(0x1003, 0), bench.read(0x1003, 1)) == (0, 0)


def test_emergency_waits_while_the_node_is_stopped() -> None:
    bench = booted()
    bench.nmt(0x02)
    bench.node.raise_emergency(0x3210)
    in_stopped = bench.wait(0.01)
    bench.nmt(0x80)
    assert in_stopped == []
    assert bench.sent_on(0x083) == [bytes.fromhex("1032050000000000")]


def test_fault_outlives_a_reset_of_the_communication() -> None:
    bench = booted()
    bench.node.raise_emergency(0x3210)
    bench.nmt(0x82)
    bench.sent.clear()
    bench.boot()
    assert bench.node.state is DriveState.FAULT
    assert bench.sent_on(0x083) == [bytes.fromhex("1032050000000000")]


def test_silent_node_neither_hears_nor_is_heard() -> None:
    bench = booted()
    bench.node.silence()
    bench.node.raise_emergency(0x3210)
    assert bench.wait(0.05) + bench.send(0x600 + NODE, READ_DEVICE_TYPE) == []
    bench.node.silence(False)
    assert len(bench.send(0x600 + NODE, READ_DEVICE_TYPE)) >= 1


def test_power_cycle_forgets_parameters_but_not_the_position() -> None:
    bench = enabled()
    bench.drive(0.2, 10_000.0)
    position = bench.node.position
    bench.node.power_cycle()
    bench.boot()
    assert (bench.node.nmt, bench.node.state) == (NmtState.PRE_OPERATIONAL, DriveState.SWITCH_ON_DISABLED)
    assert bench.read(0x6085) == 100_000
    assert abs(bench.node.position - position) < 10_000.0**2 / QUICK_STOP


def test_lag_behind_the_set_points_is_lag_and_two_cycles() -> None:
    bench = enabled()
    target = bench.drive(0.4, 10_000.0)
    assert (target - bench.node.position) / 10_000.0 == pytest.approx(LAG_S + 0.008, abs=1e-4)


def test_parameters_are_stored_by_the_signature_only_and_outlive_the_supply() -> None:
    bench = Bench()
    bench.boot()
    bench.write(0x6081, 0, 4711, 4)
    with pytest.raises(Refused, match="08000020"):
        bench.write(0x1010, 1, 1, 4)
    bench.node.power_cycle()
    bench.boot()
    assert bench.read(0x6081) != 4711
    bench.write(0x6081, 0, 4711, 4)
    bench.write(0x607A, 0, 99, 4)
    bench.write(0x1010, 1, 0x65766173, 4)
    bench.node.power_cycle()
    bench.boot()
    assert bench.read(0x6081) == 4711
    assert bench.read(0x607A) == 0
    assert bench.read(0x1010, 1) == 1
