"""Profiles from rest to rest: worked examples, limits, continuity; and what they make of motions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.kinematics import load_model
from robot_agent.model import PathSpeeds, ProfileKind, Shaping
from robot_agent.paths import Arc, JointMove, Line, Move, Sequence
from robot_agent.paths.curves import bezier
from robot_agent.trajectory import Limits, Motion, plan
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.profile import Quintic, Ramped, profile
from tests.unit.random_moves import LIMITS, MODEL, START
from tests.unit.repository import ROOT, vectors

VECTORS = vectors("profiles.json")
DECADES = st.floats(-2.0, 2.0).map(lambda power: 10.0**power)
OTHERS = [kind for kind in ProfileKind if kind is not ProfileKind.S_CURVE]


@pytest.mark.parametrize("row", VECTORS["ramps"]["rows"], ids=lambda row: "-".join(map(str, row[:5])))
def test_worked_examples_reproduce(row: list) -> None:
    kind, *question, ramp_s, top, acceleration, jerk, duration_s = row
    made = profile(ProfileKind(kind), *question)
    assert isinstance(made, Ramped)
    states = made.at(np.linspace(0.0, made.ramp_s, 2001)[:-1])
    assert [made.ramp_s, made.speed, made.duration_s] == pytest.approx([ramp_s, top, duration_s], rel=1e-5)
    assert np.abs(states[2:]).max(axis=1) == pytest.approx([acceleration, jerk], rel=1e-5)


@pytest.mark.parametrize(("kind", "power"), VECTORS["power"])
def test_smoother_profiles_need_less_power_on_the_ramp(kind: str, power: float) -> None:
    made = profile(ProfileKind(kind), 1.0, 1.0, 10.0, 100.0)
    _, speed, acceleration, _ = made.at(np.linspace(0.0, made.duration_s, 20001))
    assert (speed * acceleration).max() == pytest.approx(power, rel=1e-4)


@settings(max_examples=150, deadline=None)
@given(st.sampled_from(OTHERS), st.tuples(DECADES, DECADES, DECADES, DECADES), st.sampled_from([-1.0, 1.0]))
def test_every_profile_covers_its_way_inside_its_limits(
    kind: ProfileKind, question: tuple[float, ...], sign: float
) -> None:
    made = profile(kind, sign * question[0], *question[1:])
    t = np.unique(np.linspace(made.starts[:-1], made.starts[1:], 201)[:-1])
    states = made.at(t)
    used = np.abs(states[1:]).max(axis=1) / question[1:]
    assert (used <= 1.0 + 1e-9).all()
    assert used.max() > 0.99  # and no slower than it must be
    assert made.at(np.array([0.0, made.duration_s + 1.0]))[:2].tolist() == [[0.0, sign * question[0]], [0.0, 0.0]]
    pieces = np.diff(made.starts)
    h = 3e-4 * pieces[pieces > 1e-9 * made.duration_s].min()
    smooth = t[1:-1][np.abs(t[1:-1, None] - made.starts).min(axis=1) > 2.0 * h]
    before, here, after = (made.at(smooth + step)[:3] for step in (-h, 0.0, h))
    scale = np.abs(states[1:3]).max(axis=1, keepdims=True)
    np.testing.assert_allclose((after - before)[:2] / (2.0 * h) / scale, here[1:] / scale, atol=5e-6)


@pytest.mark.parametrize("kind", ProfileKind, ids=lambda kind: kind.value)
def test_a_way_of_nothing_takes_no_time(kind: ProfileKind) -> None:
    made = profile(kind, 0.0, 1.0, 1.0, 1.0)
    assert made.duration_s == 0.0
    np.testing.assert_array_equal(made.at(np.array([-1.0, 0.0, 1.0])), 0.0)


@pytest.mark.parametrize("bad", [(math.nan, 1, 1, 1), (1, 0, 1, 1), (1, 1, math.inf, 1), (1, 1, 1, -1)], ids=str)
def test_limits_without_a_meaning_are_refused(bad: tuple[float, ...]) -> None:
    with pytest.raises(ValueError, match="found, allowed"):
        profile(ProfileKind.BEZIER, *bad)


def test_each_limit_that_is_added_costs_as_much_as_worked() -> None:
    worked = VECTORS["scenarios"]
    distance, speed, acceleration, jerk = (worked[key] for key in ("distance", "speed", "acceleration", "jerk"))
    limits = [(speed, 1e12, 1e18), (speed, acceleration, 1e12), (speed, acceleration, jerk)]
    found = [profile(ProfileKind.S_CURVE, distance, *each).duration_s for each in limits]
    assert found == pytest.approx(worked["durations_s"], abs=1e-4)


def test_the_speed_of_a_bezier_ramp_is_the_worked_cubic() -> None:
    made = profile(ProfileKind.BEZIER, 20.0, 10.0, 15.0, 60.0)
    assert isinstance(made, Ramped)
    assert made.ramp_s == pytest.approx(1.0)
    for time, *values in VECTORS["cubic"]["rest"]:
        assert made.at(np.array(time - 1e-12))[1:].tolist() == pytest.approx(values, abs=1e-9)


def test_the_worked_cubic_between_two_states_has_its_coefficients() -> None:
    worked = VECTORS["cubic"]
    (first, speed), (last, last_speed) = worked["states"]
    third = worked["duration_s"] / 3.0
    curve = bezier(np.array([[x, 0, 0] for x in (first, first + speed * third, last - last_speed * third, last)]))
    powers = worked["duration_s"] ** np.arange(4.0)
    np.testing.assert_allclose(curve.coefficients[:4, 0] / powers, worked["coefficients"], atol=1e-9)


def test_quintic_has_the_worked_values_and_peaks() -> None:
    made, worked = Quintic(10.0, 1.0), VECTORS["quintic"]
    for time, *values in worked["rest"]:
        assert made.at(np.array(time))[:3].tolist() == pytest.approx(values)
    place, peak = worked["peak"]
    assert made.at(np.array(place))[2] == pytest.approx(peak)
    assert np.abs(made.at(np.linspace(0, 1, 9999)))[2].max() == pytest.approx(peak, rel=1e-6)


def test_quintic_between_any_states_has_the_worked_coefficients() -> None:
    worked = VECTORS["quintic"]
    q, qd, qdd = np.array(worked["states"]).T[..., None]
    pieces = Pieces.through(np.array([0.0, worked["duration_s"]]), q, qd, qdd)
    np.testing.assert_allclose(pieces.coefficients[0, :, 0], worked["coefficients"], atol=1e-9)


def planned(kind: ProfileKind, *moves: Move, filter_s: float = 0.0, path: PathSpeeds = LIMITS.path) -> Motion:
    limits = replace(LIMITS, shaping=Shaping(kind, filter_s), path=path)
    return plan(MODEL, Sequence(moves), limits, start=START)


def beside(x: float, y: float, z: float) -> np.ndarray:
    pose = MODEL.forward(START)
    pose[:3, 3] += x, y, z
    return pose


TARGET = START + np.array([0.3, -0.2, 0.1, 0.4, 0.2, -0.5])
SMOOTH = [kind for kind in OTHERS if kind is not ProfileKind.TRAPEZOIDAL]


@pytest.mark.parametrize("kind", SMOOTH, ids=lambda kind: kind.value)
def test_joint_move_has_the_chosen_profile(kind: ProfileKind) -> None:
    motion = planned(kind, JointMove(TARGET, 1.0, 1))
    ways = np.abs(TARGET - START)
    bounds = [float((limit / ways).min()) for limit in (LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk)]
    expected = profile(kind, 1.0, *bounds)
    assert motion.duration_s == pytest.approx(expected.duration_s, rel=1e-9)
    taus = np.linspace(0.0, motion.duration_s, 101)
    share = (motion.q(taus) - START) / (TARGET - START)
    np.testing.assert_allclose(share, expected.at(taus)[0][:, None] * np.ones(6), atol=2e-6)


@pytest.mark.parametrize("kind", SMOOTH, ids=lambda kind: kind.value)
def test_slow_line_has_the_chosen_profile_in_the_flanges_speed(kind: ProfileKind) -> None:
    path = replace(LIMITS.path, acceleration_m_s2=1.0, jerk_m_s3=10.0)
    motion = planned(kind, Line(beside(0.0, 0.3, 0.0), 0.1, 1), path=path)
    expected = profile(kind, 0.3, 0.1, 1.0, 10.0)
    assert motion.duration_s == pytest.approx(expected.duration_s, rel=1e-6)
    taus = np.linspace(0.0, motion.duration_s, 101)[1:-1]
    np.testing.assert_allclose(motion.tcp_speed(taus), expected.at(taus)[1], atol=1e-4)


@pytest.mark.parametrize("kind", SMOOTH, ids=lambda kind: kind.value)
def test_line_that_the_joints_slow_down_keeps_the_shape_of_the_profile(kind: ProfileKind) -> None:
    motion = planned(kind, Line(beside(-0.2, 0.6, 0.2), None, 1))
    taus = np.linspace(0.0, motion.duration_s, 201)
    way = np.linalg.norm(motion.pose(taus)[:, :3, 3] - beside(0, 0, 0)[:3, 3], axis=1)
    speed = motion.tcp_speed(taus)
    np.testing.assert_allclose(way, way[-1] - way[::-1], atol=1e-5)  # every profile is symmetric
    np.testing.assert_allclose(speed, speed[::-1], atol=1e-3)
    used = motion.pieces.peaks(33) / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert 0.9 < used.max() <= 1.0 + 1e-6


@pytest.mark.parametrize("kind", SMOOTH, ids=lambda kind: kind.value)
def test_arc_and_merged_lines_keep_all_limits(kind: ProfileKind) -> None:
    arc = Arc(beside(0.0, 0.1, 0.1), beside(0.0, 0.2, 0.0), 1)
    motion = planned(kind, arc, Line(beside(0.0, 0.2, 0.1), 0.2, 2, round_m=0.03), Line(beside(0.1, 0.1, 0.2), None, 3))
    used = motion.pieces.peaks(33) / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert used.max() <= 1.001
    np.testing.assert_allclose(motion.pose(motion.ends[-1:])[0], beside(0.1, 0.1, 0.2), atol=1e-6)


def test_trapezoid_behind_a_filter_keeps_the_jerk_and_ends_at_rest() -> None:
    motion = planned(
        ProfileKind.TRAPEZOIDAL, JointMove(TARGET, 1.0, 1), Line(MODEL.forward(START), 0.3, 2), filter_s=0.1
    )
    used = motion.pieces.peaks(33) / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert used.max() <= 1.0 + 1e-9
    np.testing.assert_array_equal(motion.qd(motion.rests), 0.0)
    np.testing.assert_allclose(motion.q(motion.rests[1:2])[0], TARGET, atol=1e-9)


@pytest.mark.parametrize(("name", "rotation_rad_s", "filter_s"), [("delta", 0.02, 0.04), ("six_axis", 0.05, 0.02)])
def test_a_slow_move_with_a_trapezoid_lasts_as_long_as_its_cap_says(
    name: str, rotation_rad_s: float, filter_s: float
) -> None:
    """A delta's axis reaches its speed in some 20 us, far less than a piece of the joints' curve takes."""
    model = load_model(ROOT / "cell_configs" / "models" / f"{name}.yaml")
    limits = replace(Limits.of(model.description), shaping=Shaping(ProfileKind.TRAPEZOIDAL, filter_s))
    target = model.home + np.eye(model.n)[-1]
    turn = JointMove(target, 1.0, 1, rotation_rad_s=rotation_rad_s)
    motion = plan(model, Sequence([turn]), limits, start=model.home)
    assert motion.duration_s == pytest.approx(1.0 / rotation_rad_s, rel=0.01)
    speeds = np.abs(motion.qd(np.linspace(0.0, 0.3, 3001))[:, -1])
    assert speeds.max() <= 1.0005 * rotation_rad_s
    np.testing.assert_allclose(motion.q(motion.rests[-1:])[0], target, atol=1e-9)


def test_trapezoid_without_a_filter_is_refused() -> None:
    with pytest.raises(ValueError, match="allowed with a filter"):
        Shaping(ProfileKind.TRAPEZOIDAL)
