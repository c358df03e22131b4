"""The S-curve against worked examples, against Ruckig, and against its own definition."""

import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruckig import InputParameter, Ruckig, Trajectory

from robot_agent.trajectory import s_curve

VECTORS = json.loads((Path(__file__).parents[1] / "vectors" / "s_curve.json").read_text())
DECADES = st.floats(-3.0, 3.0).map(lambda power: 10.0**power)


def ruckig(distance: float, speed: float, acceleration: float, jerk: float) -> Trajectory:
    request = InputParameter(1)
    request.target_position = [distance]
    request.max_velocity, request.max_acceleration, request.max_jerk = [speed], [acceleration], [jerk]
    trajectory = Trajectory(1)
    Ruckig(1).calculate(request, trajectory)
    return trajectory


@pytest.mark.parametrize("row", VECTORS["rows"], ids=lambda row: "-".join(f"{value:g}" for value in row[:4]))
def test_worked_examples_reproduce(row: list) -> None:
    *question, zones, speed, acceleration, duration = row
    profile = s_curve(*question)
    np.testing.assert_allclose(profile.zones, zones, atol=1e-6)
    np.testing.assert_allclose([profile.speed, profile.acceleration], [speed, acceleration], rtol=1e-6)
    assert profile.duration_s == pytest.approx(duration, abs=1e-6)


@settings(max_examples=300, deadline=None)
@given(DECADES, DECADES, DECADES, DECADES)
def test_duration_and_way_equal_ruckigs(distance: float, speed: float, acceleration: float, jerk: float) -> None:
    profile, oracle = s_curve(distance, speed, acceleration, jerk), ruckig(distance, speed, acceleration, jerk)
    assert profile.duration_s == pytest.approx(oracle.duration, rel=1e-9, abs=1e-9)
    times = np.linspace(0.0, profile.duration_s, 13)
    np.testing.assert_allclose(profile.at(times)[0], [oracle.at_time(t)[0][0] for t in times], atol=1e-9 * distance)


@settings(max_examples=100, deadline=None)
@given(DECADES, DECADES, DECADES, DECADES)
def test_no_limit_is_exceeded_and_both_ends_are_at_rest(
    distance: float, speed: float, acceleration: float, jerk: float
) -> None:
    profile = s_curve(distance, speed, acceleration, jerk)
    states = profile.at(np.linspace(0.0, profile.duration_s, 500))
    assert (np.abs(states[1:]).max(axis=1) <= np.array([speed, acceleration, jerk]) * (1 + 1e-9)).all()
    np.testing.assert_array_equal(profile.at(np.array([profile.duration_s, profile.duration_s + 1.0]))[:, 0][1:], 0.0)
    assert profile.at(np.array(profile.duration_s))[0] == distance


@pytest.mark.parametrize("bad", [(-1.0, 1, 1, 1), (np.nan, 1, 1, 1), (1, 0.0, 1, 1), (1, 1, np.inf, 1), (1, 1, 1, -2)])
def test_impossible_limits_are_refused_by_name(bad: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="found, allowed"):
        s_curve(*bad)
