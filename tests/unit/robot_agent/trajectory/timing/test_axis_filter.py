"""The filter on every axis: its weights, and what it does to motions."""

from dataclasses import replace

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.model import ProfileKind, Shaping
from robot_agent.paths import JointMove, Line, Sequence, Spline
from robot_agent.trajectory import Motion, plan
from robot_agent.trajectory.timing.gaussian_window import gaussian_weights
from tests.unit.commanded_geometry import stopping_as
from tests.unit.random_moves import LIMITS, MODEL, START, sequence
from tests.unit.repository import vectors
from tests.unit.tcp_shares import tcp_shares

VECTORS = vectors("profiles.json")["filter"]
TARGET = START + np.array([0.5, -0.3, 0.2, 0.0, 0.4, 0.6])


def planned(moves: Sequence, filter_s: float) -> Motion:
    limits = replace(LIMITS, shaping=Shaping(ProfileKind.S_CURVE, filter_s))
    return plan(MODEL, moves, limits, start=START)


def test_weights_and_step_response_are_the_worked_ones() -> None:
    weights = gaussian_weights(11)
    np.testing.assert_allclose(weights, [*VECTORS["weights"], *VECTORS["weights"][-2::-1]], atol=1e-6)
    np.testing.assert_allclose(np.cumsum(weights), VECTORS["step"], atol=1e-6)
    filtered = np.convolve(np.arange(40.0), weights, mode="valid")
    np.testing.assert_allclose(filtered, np.arange(10.0, 40.0) - VECTORS["ramp_lag"], atol=1e-9)
    for sigma, total in VECTORS["sums"]:
        assert 1.0 / gaussian_weights(11, sigma)[5] == pytest.approx(total, abs=1e-6)


@pytest.mark.parametrize(("window", "deviation_mm"), VECTORS["corner"])
def test_a_right_angle_at_constant_speed_is_cut_as_worked(window: int, deviation_mm: float) -> None:
    """250 mm/s, 1 ms per value, a standard deviation of a sixth of the window."""
    way = 0.25 * np.arange(-200, 201)
    corner = np.stack([np.minimum(way, 0.0), np.maximum(way, 0.0)])
    weights = gaussian_weights(window + 1, 1.0 / 3.0)
    filtered = np.stack([np.convolve(axis, weights, mode="valid") for axis in corner])
    assert np.linalg.norm(filtered, axis=0).min() == pytest.approx(deviation_mm, rel=0.1)


@pytest.mark.parametrize("filter_s", [0.004, 0.02, 0.1])
def test_motion_is_longer_by_the_window_and_is_the_mean_of_the_motion_without_it(filter_s: float) -> None:
    move = Sequence([JointMove(TARGET, 1.0, 1)])
    plain, motion = planned(move, 0.0), planned(move, filter_s)
    assert motion.duration_s == pytest.approx(plain.duration_s + filter_s, rel=5e-4)
    taus = np.linspace(0.0, motion.duration_s, 60)
    shifts = (np.arange(16 * 64) + 0.5) / (16 * 64) * filter_s
    weights = np.repeat(gaussian_weights(16), 64) / 64.0
    if filter_s <= 0.032:
        k = motion.duration_s / (plain.duration_s + filter_s)
        mean = np.einsum("s,tsj->tj", weights, plain.q(taus[:, None] / k - shifts))
        np.testing.assert_allclose(motion.q(taus), mean, atol=1e-6)


@pytest.mark.parametrize("turn", [0.0, 0.5], ids=["straight on", "on the spot"])
def test_a_move_is_not_slowed_down_where_the_filter_makes_the_flange_do_what_the_move_does_not(turn: float) -> None:
    """Turn a little on a straight line, stray a little where it turns on the spot: neither is near its limit."""
    target = MODEL.forward(START)
    target[:3, 3] += [0.0, 0.2 if turn == 0.0 else 0.0, 0.0]
    target[:3, :3] = target[:3, :3] @ from_xyz_abc(np.array([0.0, 0.0, 0.0, 0.0, turn, 0.0]))[:3, :3]
    move = Sequence([Line(target, 0.25, 1)])
    plain, motion = planned(move, 0.0), planned(move, 0.05)
    assert motion.duration_s == pytest.approx(plain.duration_s + 0.05, rel=1e-3)
    assert 0.0 < motion.filter_deviation_m < 1e-3


def test_the_filter_has_no_phase() -> None:
    move = Sequence([JointMove(TARGET, 1.0, 1)])
    plain, motion = planned(move, 0.0), planned(move, 0.05)
    middle = motion.q(np.array(motion.duration_s / 2.0))
    np.testing.assert_allclose(middle, plain.q(np.array(plain.duration_s / 2.0)), atol=1e-9)
    taus = np.linspace(0.0, motion.duration_s, 40)
    np.testing.assert_allclose(motion.q(taus) + motion.q(taus[::-1]), np.tile(START + TARGET, (40, 1)), atol=1e-6)


@pytest.mark.parametrize(("seed", "filter_s"), [(0, 0.01), (1, 0.04), (2, 0.15), (3, 0.04)])
def test_limits_are_kept_and_every_rest_stays_a_rest(seed: int, filter_s: float) -> None:
    moves = sequence(seed, 4)
    motion = planned(moves, filter_s)
    plain = planned(stopping_as(motion, moves), 0.0)
    used = motion.pieces.peaks() / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert used.max() <= 1.0 + 1e-3
    on_path = [not isinstance(each, JointMove) for each in moves.moves]
    assert tcp_shares(motion, LIMITS.path, on_path, every_s=0.003, apart_s=filter_s).max() <= 1.001
    assert len(motion.rests) == len(plain.rests)
    np.testing.assert_array_equal(motion.qd(motion.rests), 0.0)
    np.testing.assert_array_equal(motion.qdd(motion.rests), 0.0)
    np.testing.assert_allclose(motion.q(motion.rests), plain.q(plain.rests), atol=1e-9)
    assert motion.tcp_speed(motion.grid).max() <= plain.tcp_speed(np.linspace(0, plain.duration_s, 4000)).max() * 1.001


def test_deviation_of_a_slow_curve_is_told_though_a_fast_move_follows_it() -> None:
    wave = np.tile(MODEL.forward(START), (6, 1, 1))
    wave[:, 0, 3] += 0.05 * np.arange(1, 7)
    wave[:, 1, 3] += 0.02 * (-1.0) ** np.arange(6)
    end = MODEL.solve(wave[-1], near=START)
    fast = JointMove(end + np.array([1.0, 0.2, -0.2, 0.0, 0.1, 1.0]), 1.0, 2)
    alone, followed = (planned(Sequence(each), 0.06) for each in ([Spline(wave, 1, 0.2)], [Spline(wave, 1, 0.2), fast]))
    plain = planned(Sequence([Spline(wave, 1, 0.2)]), 0.0)
    path = plain.pose(np.linspace(0.0, plain.duration_s, 8000))[:, :3, 3]
    places = alone.pose(np.linspace(0.0, alone.duration_s, 200))[:, :3, 3]
    found = max(float(np.linalg.norm(path - place, axis=1).min()) for place in places)
    assert alone.filter_deviation_m == pytest.approx(found, rel=0.03)
    assert 0.97 * found < followed.filter_deviation_m < 1.2 * found


@pytest.mark.parametrize("way_m", [0.03, 0.032, 0.034])
def test_deviation_in_one_bend_that_is_short_beside_the_window_is_told_as_it_is(way_m: float) -> None:
    bend = np.tile(MODEL.forward(START), (4, 1, 1))
    bend[:, 1, 3] += way_m, way_m + 0.005, way_m + 0.01, way_m + 0.08
    bend[1, 2, 3] += 0.01
    plain, motion = (planned(Sequence([Spline(bend, 1, 0.6)]), each) for each in (0.0, 0.1))
    path = plain.pose(np.linspace(0.0, plain.duration_s, 4000))[:, :3, 3]
    places = motion.pose(np.linspace(0.0, motion.duration_s, 1500))[:, :3, 3]
    away = max(float(np.linalg.norm(path - place, axis=1).min()) for place in places)
    assert motion.filter_deviation_m == pytest.approx(away, rel=0.005, abs=1e-6)


def test_deviation_from_the_path_is_reported_as_it_is() -> None:
    def at(y: float, z: float) -> np.ndarray:
        pose = MODEL.forward(START)
        pose[:3, 3] += 0.0, y, z
        return pose

    moves = Sequence([Line(at(0.2, 0.0), 0.3, 1, round_m=0.02), Line(at(0.2, 0.2), 0.3, 2)])
    plain, motion = planned(moves, 0.0), planned(moves, 0.1)
    path = plain.pose(np.linspace(0.0, plain.duration_s, 6000))[:, :3, 3]
    places = motion.pose(np.linspace(0.0, motion.duration_s, 400))[:, :3, 3]
    away = np.linalg.norm(path[None] - places[:, None], axis=2).min(axis=1).max()
    assert motion.filter_deviation_m == pytest.approx(away, rel=0.02, abs=2e-5)
    assert away > 2e-4
    assert plain.filter_deviation_m == 0.0


def test_longer_windows_deviate_more() -> None:
    moves = Sequence(sequence(3, 4).moves[:2])
    deviations = [planned(moves, window).filter_deviation_m for window in (0.01, 0.03, 0.09)]
    assert deviations == sorted(deviations)
    assert deviations[2] > 10.0 * deviations[0]
