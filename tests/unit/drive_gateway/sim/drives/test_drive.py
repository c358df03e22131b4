"""The drive: power states on the bus, motion, monitoring, and that nothing makes the axis jump."""

import struct
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_gateway.sim.drives.power_state import DriveState
from tests.unit.sim_drive_world import AXIS, CYCLE_S, NODE, QUICK_STOP, START, Bench, Refused

SPEED = 20_000.0
"""[counts/s]"""
S = DriveState
QUICK_STOP_WORD, ENABLE, RESET = 0x02, 0x0F, 0x80


def enabled(**changes: int) -> Bench:
    bench = Bench()
    bench.prepare(**changes)
    bench.enable()
    return bench


def until(bench: Bench, state: DriveState, word: int, target: float = 0.0) -> None:
    for _ in range(500):
        if bench.node.state is state:
            return
        bench.cycle(word, target)
    raise AssertionError(f"still {bench.node.state.name}, waited for {state.name}")


def test_statuswords_on_the_way_to_operation_enabled() -> None:
    bench = Bench()
    bench.prepare()
    words = [bench.cycle(word, START)[0] for word in (0, 0x06, 0x07, 0x0F, 0x0F, 0x0F)]
    assert [f"{word:04X}" for word in words] == ["0250", "0250", "0250", "0231", "0233", "1237"]


def test_enabled_axis_follows_and_arrives() -> None:
    bench = enabled()
    target = bench.drive(0.2, SPEED)
    bench.drive(0.2, 0.0, target)
    assert bench.cycle(ENABLE, target)[1] == round(target)


def test_disabled_axis_stands_whatever_the_target() -> None:
    bench = Bench()
    bench.prepare()
    for _ in range(20):
        bench.cycle(0x07, START + 4000)
    assert bench.node.position == START


def test_a_mode_that_the_drive_does_not_have_is_refused() -> None:
    bench = Bench()
    bench.boot()
    for mode in (9, -1, 0, 33):
        with pytest.raises(Refused, match="06090030"):
            bench.write(0x6060, 0, mode, 1)


def test_the_fast_level_has_no_current_and_no_mode_of_torque() -> None:
    bench = Bench()
    bench.boot()
    assert bench.read(0x6502, 0) == 0xE5
    with pytest.raises(Refused, match="06090030"):
        bench.write(0x6060, 0, 10, 1)
    bench.write(0x6060, 0, 8, 1)
    assert bench.read(0x6061) == 8


def test_quick_stop_brakes_with_its_deceleration_and_stays() -> None:
    bench = enabled()
    bench.drive(0.4, SPEED)
    bench.cycle(QUICK_STOP_WORD, 0)
    until(bench, S.QUICK_STOP_ACTIVE, QUICK_STOP_WORD)
    start = bench.node.position
    for _ in range(50):
        bench.cycle(QUICK_STOP_WORD, 0)
    assert bench.node.state is S.QUICK_STOP_ACTIVE
    assert bench.node.position - start == pytest.approx(SPEED**2 / (2 * QUICK_STOP), rel=0.25)
    assert bench.read(0x606C, signed=True) == 0


def test_quick_stop_with_option_two_ends_disabled() -> None:
    bench = enabled(x605A_0=2)
    bench.drive(0.2, SPEED)
    until(bench, S.QUICK_STOP_ACTIVE, QUICK_STOP_WORD)
    until(bench, S.SWITCH_ON_DISABLED, QUICK_STOP_WORD)
    assert bench.read(0x606C, signed=True) == 0


def test_enable_ends_a_quick_stop_that_stays() -> None:
    bench = enabled()
    until(bench, S.QUICK_STOP_ACTIVE, QUICK_STOP_WORD)
    position = bench.node.position
    until(bench, S.OPERATION_ENABLED, ENABLE, position)


def test_missing_set_points_are_a_fault_that_brakes_first() -> None:
    bench = enabled()
    bench.drive(0.2, SPEED)
    seen = set()
    bench.wait(0.3, lambda: seen.add(bench.node.state))
    assert bench.sent_on(0x080 + NODE) == [bytes.fromhex("0087210000000000")]
    assert seen == {S.OPERATION_ENABLED, S.FAULT_REACTION_ACTIVE, S.FAULT}


def test_fault_reaction_brakes_with_6085h_and_ends_at_standstill() -> None:
    bench = enabled()
    bench.drive(0.4, SPEED)
    start = bench.node.position
    bench.node.raise_emergency(0x4310)
    waited = 0
    while bench.node.state is S.FAULT_REACTION_ACTIVE:
        bench.wait(0.001)
        waited += 1
    assert bench.read(0x606C, signed=True) == 0
    assert waited == pytest.approx(1000 * SPEED / QUICK_STOP, abs=6)
    assert bench.node.position - start == pytest.approx(SPEED**2 / (2 * QUICK_STOP), rel=0.15)


def test_sync_without_set_points_is_a_fault() -> None:
    bench = enabled()
    for _ in range(20):
        bench.wait(CYCLE_S)
        bench.send(0x080, b"")
    assert bench.node.state is S.FAULT


def test_few_missing_set_points_are_no_fault() -> None:
    bench = enabled()
    target = bench.drive(0.2, 1000.0)
    bench.wait(3 * CYCLE_S)
    bench.drive(0.1, 0.0, target)
    assert bench.node.state is S.OPERATION_ENABLED


def test_following_error_is_a_fault_with_its_bit_and_code() -> None:
    bench = enabled()
    for _ in range(100):
        status, _ = bench.cycle(ENABLE, START + 50_000)
    assert bench.sent_on(0x080 + NODE)[0] == bytes.fromhex("1186210000000000")
    assert bench.node.state is S.FAULT
    assert status & 0x206F == 0x2008
    assert bench.read(0x603F) == 0x8611


def test_following_error_shorter_than_its_time_is_no_fault() -> None:
    bench = enabled(x6066_0=500)
    for _ in range(30):
        bench.cycle(ENABLE, START + 2000)
    assert bench.node.state is S.OPERATION_ENABLED


def test_fault_reset_needs_a_rising_edge() -> None:
    bench = enabled()
    for word in (RESET, RESET):
        bench.cycle(word, 0)
    bench.node.raise_emergency(0x3210)
    for _ in range(20):
        bench.cycle(RESET, 0)
    held = bench.node.state
    bench.cycle(0, 0)
    bench.cycle(RESET, 0)
    bench.cycle(0, 0)
    assert (held, bench.node.state) == (S.FAULT, S.SWITCH_ON_DISABLED)
    assert bench.sent_on(0x080 + NODE)[-1] == bytes(8)


def test_set_point_from_before_enabling_is_forgotten() -> None:
    bench = enabled()
    bench.send(0x200 + NODE, struct.pack("<Hi", ENABLE, START + 30))
    bench.send(0x080, b"")
    for word in (0x07, ENABLE):
        bench.write(0x6040, 0, word, 2)
    bench.wait(0.01)
    assert (bench.node.state, bench.node.position) == (S.OPERATION_ENABLED, START)


@pytest.mark.parametrize("command", [0x02, 0x81, 0x82])
def test_master_that_leaves_in_motion_stops_the_axis(command: int) -> None:
    bench = enabled()
    bench.drive(0.2, SPEED)
    bench.nmt(command)
    bench.wait(0.2)
    position = bench.node.position
    bench.wait(0.1)
    assert bench.node.state is not S.OPERATION_ENABLED
    assert bench.node.position == position


def test_stop_of_the_network_brakes_like_6007h_says() -> None:
    bench = enabled()
    bench.write(0x6007, 0, 3, 2)
    bench.drive(0.2, SPEED)
    bench.nmt(0x02)
    assert bench.node.state is S.QUICK_STOP_ACTIVE


def test_reset_of_the_communication_brakes_like_6007h_says() -> None:
    bench = enabled()
    bench.write(0x6007, 0, 3, 2)
    bench.drive(0.2, SPEED)
    bench.nmt(0x82)
    assert bench.node.state is S.QUICK_STOP_ACTIVE


def test_losing_the_voltage_in_motion_lets_the_brake_stop_the_axis() -> None:
    bench = enabled()
    bench.drive(0.2, SPEED)
    bench.cycle(0, 0)
    until(bench, S.SWITCH_ON_DISABLED, 0)
    start = bench.node.position
    bench.wait(0.2)
    assert 0.0 < bench.node.position - start < SPEED**2 / QUICK_STOP


FRAMES = st.one_of(
    st.tuples(st.just(0x000), st.binary(min_size=2, max_size=2)),
    st.tuples(st.just(0x000), st.sampled_from([0x01, 0x02, 0x80, 0x81, 0x82]).map(lambda c: bytes((c, NODE)))),
    st.tuples(st.just(0x080), st.just(b"")),
    st.tuples(st.just(0x200 + NODE), st.binary(max_size=8)),
    st.tuples(
        st.just(0x200 + NODE),
        st.tuples(st.sampled_from([0, 2, 6, 7, 15, 0x80]), st.integers(-(2**31), 2**31 - 1)).map(
            lambda pair: struct.pack("<Hi", *pair)
        ),
    ),
    st.tuples(st.just(0x600 + NODE), st.binary(max_size=8)),
    st.tuples(
        st.just(0x600 + NODE),
        st.tuples(
            st.sampled_from([0x22, 0x23, 0x2B, 0x2F]),
            st.sampled_from([0x1016, 0x1017, 0x1029, 0x1400, 0x1800, 0x6007, 0x605A, 0x6085, 0x60C2, 0x607A, 0x6040]),
            st.integers(0, 2),
            st.integers(0, 2**32 - 1),
        ).map(lambda parts: struct.pack("<BHBI", *parts)),
    ),
    st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(FRAMES, st.booleans(), st.floats(0.0, 0.02)), max_size=60))
def test_no_frame_raises_or_makes_the_axis_jump(steps: list[tuple[tuple[int, bytes], bool, float]]) -> None:
    bench = enabled()
    bench.drive(0.1, SPEED)
    for (cob_id, data), remote, wait_s in steps:
        before = bench.node.position
        bench.send(cob_id, data, remote)
        at_once = bench.node.position
        bench.now += wait_s
        bench.node.step(bench.now)
        assert at_once == before
        assert abs(bench.node.position - before) <= bench.node.top_speed * wait_s * (1 + 1e-9) + 1e-6


def at_the_end(bench: Bench, speed: float) -> None:
    """Drive with `speed` [counts/s] until the drive stops by itself."""
    target = bench.node.position
    for _ in range(500):
        if bench.node.state is S.QUICK_STOP_ACTIVE:
            return
        target += speed * CYCLE_S
        bench.cycle(ENABLE, target)
    raise AssertionError(f"still {bench.node.state.name} at {bench.node.position}")


def between_ends(low: float, high: float) -> Bench:
    bench = Bench(replace(AXIS, limit_switches=(low, high)))
    bench.prepare()
    bench.enable()
    return bench


def test_a_drive_stops_at_its_limit_switch_by_itself_and_not_before_it_stands_it_is_enabled_again() -> None:
    bench = between_ends(0.0, 0.8)
    assert bench.read(0x60FD) & 3 == 0
    at_the_end(bench, SPEED)
    assert bench.read(0x60FD) & 3 == 2
    while not bench.node.servo.standing:
        assert bench.node.state is S.QUICK_STOP_ACTIVE
        bench.cycle(ENABLE, 20_000)
    assert 8_000 <= bench.node.position <= 8_000 + SPEED**2 / (2 * QUICK_STOP) + SPEED * CYCLE_S


def test_a_drive_leaves_its_limit_switch_in_the_other_direction_only() -> None:
    bench = between_ends(0.5, 0.8)
    assert bench.read(0x60FD) & 3 == 1
    bench.drive(0.2, speed=5_000.0)
    assert bench.node.state is S.OPERATION_ENABLED
    assert bench.read(0x60FD) & 3 == 0
    at_the_end(bench, -5_000.0)
    assert bench.read(0x60FD) & 3 == 1
