"""Motions along many short lines: their limits, their feed, and when each line ends."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot_agent.paths import Line, Passing, Sequence
from robot_agent.paths.caps import Tolerance
from robot_agent.trajectory import plan
from tests.unit.random_moves import LIMITS, MODEL, START
from tests.unit.robot_agent.paths.cam_lines import KINDS, CamLines, cam_lines
from tests.unit.robot_agent.trajectory.cam_motions import HERE, at_the_robot, motion_of

TOLERANCE = Tolerance(5e-5, np.radians(0.5))


def circle(count: int, radius_m: float = 0.05, line_m: float = 5e-4) -> CamLines:
    turn = np.arange(count + 1) * line_m / radius_m
    places = radius_m * np.stack([0.0 * turn, np.sin(turn), 1.0 - np.cos(turn)], axis=1)
    return at_the_robot(CamLines(places, Rotation.identity(count + 1)))


@given(seed=st.integers(0, 2**32 - 1), kind=st.sampled_from(KINDS), feed=st.sampled_from([0.02, 0.1, 0.3]))
@settings(max_examples=10, deadline=None)
def test_limits_and_feed_are_kept_along_lines_of_all_kinds(seed: int, kind: str, feed: float) -> None:
    lines = at_the_robot(cam_lines(kind, np.random.default_rng(seed)))
    motion = motion_of(lines.lines(TOLERANCE, feed))
    inside = np.abs(motion.pieces.inside(9)).max(axis=(1, 2))
    assert (inside / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])).max() < 1.001
    tau = np.linspace(0.0, motion.duration_s, 4000)
    assert motion.tcp_speed(tau).max() < 1.01 * feed
    assert len(motion.ends) == len(lines.places) - 1
    assert (np.diff(motion.ends) >= 0.0).all()


def test_a_circle_of_chords_takes_as_long_as_the_circle_and_not_ten_times_as_long() -> None:
    lines = circle(600)
    short = motion_of(lines.lines(TOLERANCE, 0.3))
    assert short.duration_s < 0.3 / 0.3 + 0.5
    assert len(short.rests) == 2
    assert motion_of(lines.lines(None, 0.3)[:30]).duration_s > 2.0
    (told,) = short.transitions
    assert (told.before, told.move, told.passing) == (0, 599, Passing.FITTED)
    assert told.deviation_m < TOLERANCE.distance_m
    assert "600 moves in 2" in told.reason


def test_the_feed_of_each_line_holds_where_the_line_lies() -> None:
    lines = circle(600)
    moves = [replace(line, speed_m_s=0.05 if 200 <= k < 300 else 0.15) for k, line in enumerate(lines.lines(TOLERANCE))]
    motion = motion_of(moves)
    tau = np.linspace(0.0, motion.duration_s, 20_000)
    slow = (motion.move_at(tau) >= 200) & (motion.move_at(tau) < 300)
    speed = motion.tcp_speed(tau)
    assert speed[slow].max() < 1.01 * 0.05
    assert speed[slow].mean() > 0.95 * 0.05
    assert speed[~slow].max() == pytest.approx(0.15, rel=1e-3)


def test_each_line_ends_where_its_end_lies_on_the_path() -> None:
    lines = circle(300)
    motion = motion_of(lines.lines(TOLERANCE, 0.2))
    away = np.linalg.norm(motion.pose(motion.ends)[:, :3, 3] - lines.places[1:], axis=1)
    assert away.max() < TOLERANCE.distance_m


@pytest.mark.parametrize("splice_s", [0.3, 0.7])
def test_a_motion_that_is_extended_by_more_lines_goes_on_at_its_feed(splice_s: float) -> None:
    lines = circle(600)
    moves = lines.lines(TOLERANCE, 0.2)
    first = plan(MODEL, Sequence(moves[:300], beyond=moves[300:360]), LIMITS, start=START)
    onward = plan(
        MODEL, Sequence(moves[300:], aimed=lines.poses[300]), LIMITS, start=first.state(first.duration_s - splice_s)
    )
    tau = np.linspace(0.0, onward.duration_s - 0.4, 5000)
    if splice_s == 0.7:
        assert onward.tcp_speed(tau).min() > 0.99 * 0.2
    assert all(each.passing is not Passing.STOPS for each in onward.transitions)
    assert len(onward.rests) == 2
    places = onward.pose(np.linspace(0.0, onward.duration_s, 5000))[:, :3, 3] - HERE[:3, 3]
    assert np.abs(np.hypot(places[:, 1], places[:, 2] - 0.05) - 0.05).max() < TOLERANCE.distance_m


def test_an_extension_that_does_not_go_on_in_the_direction_before_stops_at_the_corner() -> None:
    lines = circle(200)
    moves = lines.lines(TOLERANCE, 0.2)
    first = motion_of(moves[:100])
    aside = np.tile(lines.poses[100], (2, 1, 1))
    aside[:, 0, 3] += 0.01, 0.03
    moves = [Line(pose, 0.2, 101 + k, tolerance=TOLERANCE) for k, pose in enumerate(aside)]
    onward = plan(MODEL, Sequence(moves), LIMITS, start=first.state(0.2))
    (stop,) = (each for each in onward.transitions if each.passing is Passing.STOPS)
    assert stop.move - stop.before == 1
    assert onward.rests[1] == pytest.approx(onward.ends[-3], abs=1e-6)
