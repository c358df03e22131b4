"""The S-curve against worked examples, against Ruckig, and against its own definition."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from ruckig import InputParameter, Ruckig, Trajectory

from robot_agent.trajectory import s_curve
from tests.unit.repository import vectors

VECTORS, PROFILES = (vectors(name) for name in ("s_curve.json", "profiles.json"))
DECADES = st.floats(-3.0, 3.0).map(lambda power: 10.0**power)


def ruckig(
    distance: float,
    speed: float,
    acceleration: float,
    jerk: float,
    low: tuple[float, float] | None = None,
    speeds: tuple[float, float] = (0.0, 0.0),
) -> Trajectory:
    request = InputParameter(1)
    request.target_position = [distance]
    request.max_velocity, request.max_acceleration, request.max_jerk = [speed], [acceleration], [jerk]
    request.current_velocity, request.target_velocity = [speeds[0]], [speeds[1]]
    if low is not None:
        request.min_velocity, request.min_acceleration = [low[0]], [low[1]]
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


@pytest.mark.parametrize(("speed", "acceleration", "jerk", "distance", "duration_s"), VECTORS["stops"])
def test_worked_stops_reproduce(
    speed: float, acceleration: float, jerk: float, distance: float, duration_s: float
) -> None:
    profile = s_curve(3.0 * distance, speed, acceleration, jerk)
    begins_s = profile.duration_s - duration_s
    place, at_speed, _, _ = profile.at(np.array(begins_s))
    assert at_speed == pytest.approx(speed, rel=1e-9)
    assert 3.0 * distance - place == pytest.approx(distance, rel=1e-5)
    assert profile.zones[4:].sum() == pytest.approx(duration_s, rel=1e-5)


def test_worked_zones_of_a_ramp_reproduce() -> None:
    ramp = VECTORS["ramp"]
    profile = s_curve(1.0, ramp["speed"], ramp["acceleration"], ramp["jerk"])
    places, speeds = profile.at(np.cumsum(profile.zones[:3]))[:2]
    np.testing.assert_allclose(np.diff(places, prepend=0.0), ramp["distances"], atol=1e-6)
    np.testing.assert_allclose([speeds[0], places[2]], [ramp["first_speed"], ramp["distance"]], rtol=1e-9)


@pytest.mark.parametrize("row", PROFILES["s_curve"], ids=lambda row: "-".join(f"{value:g}" for value in row[:4]))
def test_worked_examples_of_the_second_source_reproduce(row: list) -> None:
    profile = s_curve(*row[:4])
    found = [profile.duration_s, profile.speed, profile.acceleration]
    np.testing.assert_allclose(found, row[4:], rtol=2e-6, atol=1e-6)


@settings(max_examples=100, deadline=None)
@given(DECADES, DECADES, DECADES, DECADES)
def test_way_equals_ruckigs_all_the_time(distance: float, speed: float, acceleration: float, jerk: float) -> None:
    profile, oracle = s_curve(distance, speed, acceleration, jerk), ruckig(distance, speed, acceleration, jerk)
    times = np.linspace(0.0, profile.duration_s, 13)
    np.testing.assert_allclose(profile.at(times)[0], [oracle.at_time(t)[0][0] for t in times], atol=1e-9 * distance)


class TestTenThousandRandomCases:
    """From rest and from any speed, either way, short and long: the duration is Ruckig's."""

    def test_from_rest_to_rest_with_equal_limits(self) -> None:
        cases = 10.0 ** np.random.default_rng(1).uniform(-3.0, 3.0, (5000, 4))
        signs = np.random.default_rng(2).choice([-1.0, 1.0], 5000)
        own = [s_curve(sign * case[0], *case[1:].tolist()) for sign, case in zip(signs, cases, strict=True)]
        theirs = [ruckig(sign * case[0], *case[1:]).duration for sign, case in zip(signs, cases, strict=True)]
        np.testing.assert_allclose([profile.duration_s for profile in own], theirs, rtol=1e-9, atol=1e-9)
        kinds = {tuple(bool(zone > 0.0) for zone in profile.zones) for profile in own}
        assert len(kinds) == 4  # all seven zones, and three degenerate cases

    def test_between_any_speeds_with_limits_of_their_own_in_both_directions(self) -> None:
        rng = np.random.default_rng(3)
        distances = 10.0 ** rng.uniform(-4.0, 2.0, 5000) * rng.choice([-1.0, 1.0], 5000)
        low_v, high_v, low_a, high_a, jerk = 10.0 ** rng.uniform(-1.0, 1.0, (5, 5000))
        ends = low_v * -1.0 + rng.uniform(0.0, 1.0, (2, 5000)) * (low_v + high_v)
        for case in zip(distances, low_v, high_v, low_a, high_a, jerk, *ends, strict=True):
            distance, lv, hv, la, ha, j, first, last = map(float, case)
            own = s_curve(distance, (-lv, hv), (-la, ha), j, first, last)
            theirs = ruckig(distance, hv, ha, j, low=(-lv, -la), speeds=(first, last))
            assert own.duration_s == pytest.approx(theirs.duration, rel=1e-9, abs=1e-9)


ONE_WAY = st.floats(-1.0, 1.0).map(lambda power: 10.0**power)
BOTH_WAYS = st.tuples(ONE_WAY.map(lambda value: -value), ONE_WAY)


@settings(max_examples=100, deadline=None)
@given(st.floats(-10.0, 10.0), BOTH_WAYS, BOTH_WAYS, BOTH_WAYS, st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_each_direction_keeps_its_own_limits_between_the_speeds_at_the_ends(
    distance: float,
    speed: tuple[float, float],
    acceleration: tuple[float, float],
    jerk: tuple[float, float],
    first: float,
    last: float,
) -> None:
    ends = [min(speed[1], speed[0] + share * (speed[1] - speed[0])) for share in (first, last)]
    profile = s_curve(distance, speed, acceleration, jerk, *ends)
    states = profile.at(np.linspace(0.0, profile.duration_s, 400))
    for values, (low, high) in zip(states[1:], (speed, acceleration, jerk), strict=True):
        assert low * (1 + 1e-9) <= values.min() <= values.max() <= high * (1 + 1e-9)
    np.testing.assert_allclose(states[:3, 0], [0.0, ends[0], 0.0], atol=1e-12)
    np.testing.assert_allclose(profile.at(np.array(profile.duration_s))[:3], [distance, ends[1], 0.0], atol=1e-12)
    joined = np.diff(profile.at(np.stack([profile.starts - 1e-9, profile.starts + 1e-9]))[:2], axis=1)
    assert np.abs(joined).max() < 1e-6 * (1.0 + max(speed[1], -speed[0], acceleration[1], -acceleration[0]))


@settings(max_examples=60, deadline=None)
@given(st.floats(-10.0, 10.0), BOTH_WAYS, BOTH_WAYS, BOTH_WAYS)
def test_the_way_back_in_time_and_the_way_mirrored_take_as_long(
    distance: float, speed: tuple[float, float], acceleration: tuple[float, float], jerk: tuple[float, float]
) -> None:
    def mirrored(limit: tuple[float, float]) -> tuple[float, float]:
        return -limit[1], -limit[0]

    first, last = speed[0] / 2.0, speed[1] / 3.0
    there = s_curve(distance, speed, acceleration, jerk, first, last).duration_s
    back = s_curve(distance, speed, mirrored(acceleration), jerk, last, first).duration_s
    other = s_curve(-distance, *map(mirrored, (speed, acceleration, jerk)), -first, -last).duration_s
    assert [back, other] == pytest.approx([there, there], rel=1e-9, abs=1e-9)


def test_softer_limits_of_one_direction_cost_time_and_no_more_than_in_both() -> None:
    hard, soft = (s_curve(1.0, 1.0, 10.0, jerk).duration_s for jerk in (100.0, 50.0))
    mixed = s_curve(1.0, 1.0, 10.0, (-50.0, 100.0)).duration_s
    assert hard < mixed < soft


def test_outside_its_time_the_profile_goes_on_as_it_began_and_ended() -> None:
    profile = s_curve(1.0, 2.0, 10.0, 100.0, 0.5, -0.25)
    np.testing.assert_allclose(profile.at(np.array(-1.0)), [-0.5, 0.5, 0.0, 0.0])
    np.testing.assert_allclose(profile.at(np.array(profile.duration_s + 2.0)), [0.5, -0.25, 0.0, 0.0])


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


@pytest.mark.parametrize(
    "bad",
    [
        (np.nan, 1, 1, 1),
        (1, 0.0, 1, 1),
        (1, 1, np.inf, 1),
        (1, 1, 1, -2),
        (1, (0.5, 1), 1, 1),
        (1, (-1, 0), 1, 1),
        (1, 1, 1, 1, 1.5),
        (1, 1, 1, 1, 0.0, -1.5),
    ],
    ids=str,
)
def test_impossible_limits_are_refused_by_name(bad: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="found, allowed"):
        s_curve(*bad)
