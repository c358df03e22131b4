"""The modes in which a simulated drive makes its own motion: profile position, profile velocity, homing."""

from dataclasses import replace

import pytest

from drive_gateway.config.settings import HomingSettings
from tests.unit.sim_drive_world import AXIS, COUNTS, CYCLE_S, START, Bench, Refused

REACHED, BIT12, BIT13 = 1 << 10, 1 << 12, 1 << 13
PROFILE = {(0x6081, 0): 10_000, (0x6083, 0): 40_000, (0x6084, 0): 40_000, (0x6065, 0): 100_000}
WINDOW_BITS = ((REACHED, REACHED), (BIT12, 0))
HOME = HomingSettings(method=17, fast=0.5, slow=0.05, acceleration=10.0, position=0.2, order=1)


def enabled(mode: int) -> Bench:
    bench = Bench()
    bench.prepare()
    bench.write(0x6060, 0, mode, 1)
    for (index, sub), value in PROFILE.items():
        bench.write(index, sub, value, 4)
    bench.enable()
    assert bench.read(0x6061) == mode
    return bench


def until(bench: Bench, word: int, target: float, bits: int, within_s: float = 20.0) -> float:
    """Cycle until all `bits` of the statusword are set; answers how long that took [s]."""
    for count in range(round(within_s / CYCLE_S)):
        statusword, _ = bench.cycle(word, target)
        if statusword & bits == bits:
            return count * CYCLE_S
    raise AssertionError(f"{statusword:04X}h never showed {bits:04X}h")


def test_a_set_point_is_acknowledged_reached_and_travelled_as_a_trapezoid() -> None:
    bench = enabled(1)
    bench.cycle(0x0F, START + 10_000)
    until(bench, 0x1F, START + 10_000, BIT12)
    statusword, _ = bench.cycle(0x0F, START + 10_000)
    took = until(bench, 0x0F, START + 10_000, REACHED)
    assert took == pytest.approx(1.0 + 0.25, abs=0.1)
    assert bench.node.position == pytest.approx(START + 10_000, abs=100)
    assert not bench.cycle(0x0F, START + 10_000)[0] & BIT12
    assert not statusword & REACHED


def test_a_relative_set_point_counts_from_the_demand() -> None:
    bench = enabled(1)
    bench.cycle(0x0F, -2_000)
    until(bench, 0x5F, -2_000, BIT12)
    until(bench, 0x0F, -2_000, REACHED)
    assert bench.node.position == pytest.approx(START - 2_000, abs=100)


def test_a_second_set_point_waits_for_the_first_or_replaces_it_at_once() -> None:
    for word, passes_first in ((0x1F, True), (0x3F, False)):
        bench = enabled(1)
        bench.cycle(0x0F, START + 5_000)
        until(bench, 0x1F, START + 5_000, BIT12)
        for _ in range(50):
            bench.cycle(0x0F, START - 3_000)
        highest = START
        for count in range(1000):
            bench.cycle(word if count < 3 else 0x0F, START - 3_000)
            highest = max(highest, bench.node.position)
        assert bench.node.position == pytest.approx(START - 3_000, abs=100)
        assert (highest > START + 4_900) is passes_first


def test_a_target_outside_the_software_limits_ends_at_the_limit() -> None:
    bench = Bench()
    bench.prepare()
    bench.write(0x607D, 2, START + 1_000, 4)
    enabled_without_boot(bench)
    bench.cycle(0x0F, START + 9_000)
    until(bench, 0x1F, START + 9_000, BIT12)
    until(bench, 0x0F, START + 9_000, REACHED)
    assert bench.node.position == pytest.approx(START + 1_000, abs=100)


@pytest.mark.parametrize(("sub", "value"), [(1, START + 2), (2, START - 2)])
def test_software_limits_that_cross_are_refused(sub: int, value: int) -> None:
    bench = Bench()
    bench.prepare()
    bench.write(0x607D, 1, START, 4)
    bench.write(0x607D, 2, START + 1, 4)
    with pytest.raises(Refused) as refused:
        bench.write(0x607D, sub, value, 4)
    assert refused.value.code == 0x06090036
    bench.write(0x607D, 3 - sub, value, 4)
    bench.write(0x607D, sub, value, 4)


def enabled_without_boot(bench: Bench) -> None:
    bench.write(0x6060, 0, 1, 1)
    bench.enable()


def test_halt_brakes_by_the_profile_and_lets_the_axis_go_on() -> None:
    bench = enabled(1)
    bench.cycle(0x0F, START + 10_000)
    until(bench, 0x1F, START + 10_000, BIT12)
    for _ in range(100):
        bench.cycle(0x0F, START + 10_000)
    until(bench, 0x10F, START + 10_000, REACHED)
    assert bench.node.position < START + 6_000
    for _ in range(3):
        bench.cycle(0x0F, START + 10_000)
    until(bench, 0x0F, START + 10_000, REACHED)
    assert bench.node.position == pytest.approx(START + 10_000, abs=100)


def test_profile_velocity_shows_standstill_and_the_target_velocity() -> None:
    bench = enabled(3)
    assert bench.cycle(0x0F, 0)[0] & BIT12
    bench.write(0x60FF, 0, -8_000, 4)
    took = until(bench, 0x0F, 0, REACHED)
    assert took == pytest.approx(0.2, abs=0.06)
    assert not bench.cycle(0x0F, 0)[0] & BIT12
    assert bench.read(0x606C, 0, signed=True) == pytest.approx(-8_000, abs=2_000)
    bench.write(0x60FF, 0, 0, 4)
    until(bench, 0x0F, 0, BIT12)


@pytest.mark.parametrize("times_ms", [(0, 0), (200, 0), (0, 100), (100, 200)])
def test_windows_of_the_velocity_have_a_time_each(times_ms: tuple[int, int]) -> None:
    """With 40 000 counts/s^2 the window opens after 150 ms and the threshold is passed after 2.5 ms."""
    bench = enabled(3)
    for index, value in zip((0x606E, 0x6070), times_ms, strict=True):
        bench.write(index, 0, value, 2)
    bench.write(0x60FF, 0, 8_000, 4)
    bits = [bench.cycle(0x0F, 0)[0] for _ in range(150)]
    reached, moving = (next(k for k, word in enumerate(bits) if word & bit == want) for bit, want in WINDOW_BITS)
    assert reached * CYCLE_S == pytest.approx(0.15 + 1e-3 * times_ms[0], abs=0.025)
    assert moving * CYCLE_S == pytest.approx(1e-3 * times_ms[1], abs=0.025)


@pytest.mark.parametrize(
    ("method", "start"),
    [
        (17, 0.5),
        (17, 0.1),
        (18, -0.3),
        (18, 0.4),
        (23, -0.3),
        (23, 0.6),
        (23, 0.205),
        (27, 0.5),
        (1, 0.5),
        (1, 0.05),
        (2, -0.1),
        (7, -0.3),
        (7, 0.35),
        (11, 0.5),
        (11, 0.1),
        (3, -0.3),
        (3, 0.6),
        (4, -0.3),
        (5, 0.5),
        (6, 0.5),
        (6, -0.3),
        (8, -0.3),
        (9, -0.3),
        (10, -0.3),
        (12, 0.5),
        (13, 0.5),
        (14, 0.5),
        (19, -0.3),
        (20, -0.3),
        (20, 0.6),
        (21, 0.5),
        (22, 0.5),
        (24, -0.3),
        (24, 0.6),
        (25, -0.3),
        (26, -0.3),
        (28, 0.5),
        (29, 0.5),
        (30, 0.5),
        (30, -0.3),
        (33, 0.39),
        (34, 0.05),
    ],
)
def test_homing_finds_its_place_and_calls_it_the_offset(method: int, start: float) -> None:
    bench = Bench(replace(AXIS, incremental=True, index_counts=2_000, homing=replace(HOME, method=method)), start)
    bench.prepare()
    for (index, sub), (value, size) in {
        (0x6098, 0): (method, 1),
        (0x6099, 1): (5_000, 4),
        (0x6099, 2): (500, 4),
        (0x609A, 0): (100_000, 4),
        (0x607C, 0): (round(HOME.position * COUNTS), 4),
        (0x6060, 0): (6, 1),
        (0x6065, 0): (100_000, 4),
    }.items():
        bench.write(index, sub, value, size)
    assert bench.read(0x6064, 0, signed=True) == 0
    bench.enable()
    until(bench, 0x1F, 0, BIT12 | REACHED, within_s=60.0)
    assert bench.read(0x6064, 0, signed=True) == pytest.approx(bench.node.position, abs=1)


@pytest.mark.parametrize(("method", "start", "turns_away"), [(33, 0.41, 1), (34, -0.01, -1)])
def test_the_index_pulse_alone_says_nothing_about_whole_turns(method: int, start: float, turns_away: int) -> None:
    bench = Bench(replace(AXIS, incremental=True, index_counts=2_000, homing=replace(HOME, method=method)), start)
    bench.prepare()
    bench.write(0x6098, 0, method, 1)
    bench.write(0x6099, 2, 2_000, 4)
    bench.write(0x607C, 0, round(HOME.position * COUNTS), 4)
    bench.write(0x6060, 0, 6, 1)
    bench.enable()
    until(bench, 0x1F, 0, BIT12 | REACHED)
    assert bench.node.position - bench.read(0x6064, 0, signed=True) == pytest.approx(turns_away * 2_000, abs=1)


def test_an_encoder_without_index_pulse_cannot_home_by_it() -> None:
    bench = enabled(6)
    bench.write(0x6098, 0, 33, 1)
    until(bench, 0x1F, 0, BIT13)


def test_homing_that_is_interrupted_says_so_and_the_axis_stands() -> None:
    axis = replace(AXIS, incremental=True, homing=HOME)
    bench = Bench(axis)
    bench.prepare()
    bench.write(0x6098, 0, 17, 1)
    bench.write(0x6060, 0, 6, 1)
    bench.enable()
    for _ in range(20):
        bench.cycle(0x1F, 0)
    until(bench, 0x0F, 0, BIT13 | REACHED)


def test_an_unknown_homing_method_fails_at_once() -> None:
    bench = enabled(6)
    until(bench, 0x1F, 0, BIT13)


def test_an_incremental_encoder_counts_from_zero_after_a_power_cycle_and_an_absolute_one_does_not() -> None:
    for incremental, shown in ((True, 0), (False, START)):
        bench = Bench(replace(AXIS, incremental=incremental))
        bench.boot()
        assert bench.read(0x6064, 0, signed=True) == shown


def test_the_mode_changes_only_at_standstill() -> None:
    bench = enabled(3)
    bench.write(0x60FF, 0, 5_000, 4)
    for _ in range(100):
        bench.cycle(0x0F, 0)
    bench.write(0x6060, 0, 1, 1)
    assert bench.read(0x6061) == 3
    bench.write(0x60FF, 0, 0, 4)
    for _ in range(200):
        bench.cycle(0x0F, 0)
    assert bench.read(0x6061) == 1
