"""Measured corrections: filtered, extrapolated, and refused when they are old."""

import numpy as np
import pytest

from robot_agent.trajectory.sources import Conveyor, SensorOffset, Stale
from robot_agent.trajectory.sources.target import CriticallyDamped

DT = 0.02


def belt(largest: float = 1.0) -> Conveyor:
    frame = np.eye(4)
    frame[:3, :3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]]
    return Conveyor("belt", frame, 1e-3, settle_s=0.05, fresh_s=0.1, largest_speed_m_s=largest)


def test_the_filter_is_a_line_fitted_with_fading_memory() -> None:
    values = np.random.default_rng(1).normal(size=400)
    tracker = CriticallyDamped(settle_s=0.1)
    for k, value in enumerate(values):
        tracker.measured(np.array([value]), k * DT)
    ages = np.arange(len(values))[::-1]
    slope, height = np.polyfit(-ages * DT, values, 1, w=np.sqrt(np.exp(-DT / 0.1) ** ages))
    position, speed = tracker.at(tracker.measured_at)
    assert position[0] == pytest.approx(height, abs=1e-9)
    assert speed[0] == pytest.approx(slope, abs=1e-7)


def test_a_belt_at_constant_speed_is_followed_without_lag_over_the_counters_end() -> None:
    conveyor = belt()
    for k in range(100):
        conveyor.measured((2**32 - 50 + 4 * k) % 2**32, k * DT)
    target = conveyor.target(99 * DT + 0.05)
    np.testing.assert_allclose(target.offset[:3], [0.0, 0.2 * (99 * DT + 0.05), 0.0], atol=1e-6)
    np.testing.assert_allclose(target.speed, [0, 0.2, 0, 0, 0, 0], atol=1e-6)


def test_a_speed_beyond_what_the_belt_can_do_is_not_believed() -> None:
    conveyor = belt(largest=0.1)
    for k in range(100):
        conveyor.measured(20 * k, k * DT)
    assert np.linalg.norm(conveyor.target(99 * DT).speed) == pytest.approx(0.1)


def test_an_old_measurement_is_refused_by_name_and_age() -> None:
    conveyor, sensor = belt(), SensorOffset("seam", 0.05, 0.1)
    conveyor.measured(0, 1.0)
    with pytest.raises(Stale, match=r"belt: measured 0\.20 s ago, allowed 0\.1 s"):
        conveyor.target(1.2)
    with pytest.raises(Stale, match="seam: not measured yet"):
        sensor.target(1.0)


def test_a_sensors_offset_settles_where_it_is_measured_and_is_not_extrapolated() -> None:
    sensor = SensorOffset("seam", 0.05, 0.1)
    for k in range(60):
        sensor.measured(np.array([0, 0, 0.002, 0, 0, 0]) * (k > 0), k * DT)
    target = sensor.target(59 * DT + 0.05)
    assert target.offset[2] == pytest.approx(0.002, abs=1e-6)
    assert not target.speed.any()


def test_a_part_stays_where_it_passed_whatever_the_counter_does_behind_it() -> None:
    conveyor = belt()
    for k, counts in enumerate((2**32 - 30, 2**32 - 10, 10, 30)):
        conveyor.measured(counts, k * DT, part=None if k == 0 else 2**32 - 20)
    assert conveyor.part_m == pytest.approx(0.010)
    np.testing.assert_allclose(conveyor.offset_at(0.010)[:3], [0.0, 0.010, 0.0], atol=1e-12)


def test_a_count_that_was_overtaken_brings_no_older_part_back() -> None:
    conveyor = belt()
    conveyor.measured(1000, 1.0, part=500)
    conveyor.measured(1500, 1.1, part=1400)
    part_m, target = conveyor.part_m, conveyor.target(1.1)
    conveyor.measured(1200, 1.05, part=500)
    assert conveyor.part_m == part_m
    np.testing.assert_array_equal(conveyor.target(1.1).offset, target.offset)
    conveyor.measured(1700, 1.15, part=1400)
    assert conveyor.part_m == part_m
