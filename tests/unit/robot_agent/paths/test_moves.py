"""Geometry of moves: the line, its shortest turn, and what a move refuses."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cell.geometry.quaternion import from_matrix, to_matrix
from robot_agent.paths import JointMove, Line, LineGeometry, Sequence, Spline
from robot_agent.paths.errors import PathError
from robot_agent.paths.legs import legs
from robot_agent.paths.orientation import between

COMPONENT = st.floats(-1.0, 1.0)
QUATERNION = st.tuples(COMPONENT, COMPONENT, COMPONENT, COMPONENT).filter(lambda q: np.linalg.norm(q) > 0.1)


def pose(quaternion: tuple[float, ...], position: tuple[float, ...] = (0.0, 0.0, 0.0)) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = to_matrix(np.array(quaternion)), position
    return made


@settings(max_examples=100, deadline=None)
@given(QUATERNION, QUATERNION)
def test_line_begins_and_ends_in_its_poses(first: tuple[float, ...], second: tuple[float, ...]) -> None:
    start, target = pose(first, (1.0, 2.0, 3.0)), pose(second, (0.5, 2.5, 3.0))
    poses = LineGeometry.between(start, target).poses(np.array([0.0, 1.0]))
    np.testing.assert_allclose(poses, [start, target], atol=1e-12)


def angle_between(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Angle [rad] of the shortest rotation from `start` to `end`, both `(..., 3, 3)`."""
    return np.asarray((Rotation.from_matrix(start).inv() * Rotation.from_matrix(end)).magnitude())


@settings(max_examples=100, deadline=None)
@given(QUATERNION, QUATERNION, st.floats(0.0, 1.0))
def test_orientation_turns_the_shortest_way_in_step_with_the_position(
    first: tuple[float, ...], second: tuple[float, ...], u: float
) -> None:
    start, target = pose(first), pose(second, (1.0, 0.0, 0.0))
    line = LineGeometry.between(start, target)
    between = line.poses(np.array(u))
    turned = angle_between(start[:3, :3], between[:3, :3])
    whole = angle_between(start[:3, :3], target[:3, :3])
    half_turn = whole > np.pi - 2.1e-5  # one rule says which way, not which of both is shorter, by 4e-5 at most
    assert turned == pytest.approx(u * whole, abs=4.1e-5 if half_turn else 1e-9)
    assert between[0, 3] == pytest.approx(u, abs=1e-12)


def test_part_of_a_turn_is_at_constant_speed_the_shortest_way() -> None:
    start, end = to_matrix(np.random.default_rng(5).normal(size=(2, 250, 4)))
    angle = angle_between(start, end)
    for share in (0.0, 0.25, 0.9, 1.0):
        part = between(start, end, np.full(250, share))
        np.testing.assert_allclose(angle_between(start, part), share * angle, atol=1e-9)
        np.testing.assert_allclose(angle_between(part, end), (1 - share) * angle, atol=1e-9)


def test_quarter_turn_about_z_matches_the_worked_slerp() -> None:
    half = np.sqrt(0.5)
    line = LineGeometry.between(pose((0, 0, 0, 1)), pose((0, 0, half, half)))
    np.testing.assert_allclose(from_matrix(line.poses(np.array(0.25))[:3, :3]), [0, 0, 0.195090, 0.980785], atol=1e-6)


@pytest.mark.parametrize("number", [0, 1])
def test_a_spline_does_not_turn_on_the_spot_and_may_name_a_point_twice(number: int) -> None:
    start, ahead = pose((0, 0, 0, 1)), pose((0, 0, 0, 1), (0.1, 0.0, 0.0))
    points = [ahead, pose((0, 0, 0, 1), (0.2, 0.1, 0.0))]
    turned = (start, ahead)[number].copy()
    turned[:3, :3] = to_matrix(np.array((0, 0, np.sin(0.1), np.cos(0.1))))
    with pytest.raises(PathError, match="where the one before it is, turned by 11"):
        legs([(4, Spline(np.array([*points[:number], turned, *points[number:]]), 1))], start)
    twice = legs([(4, Spline(np.array([start, points[0], *points]), 1))], start)
    assert len(twice) == len(points)


def test_half_turn_is_as_exact_as_any_other() -> None:
    line = LineGeometry.between(np.eye(4), pose((0.6, 0.8, 0.0, 0.0)))
    assert line.angle == pytest.approx(np.pi)
    np.testing.assert_allclose(np.abs(line.axis), [0.6, 0.8, 0.0], atol=1e-12)


def test_line_to_where_it_starts_is_empty() -> None:
    here = pose((0.1, 0.2, 0.3, 0.4), (1.0, 1.0, 1.0))
    assert LineGeometry.between(here, here).is_empty


def test_turn_on_the_spot_has_no_length_but_is_a_move() -> None:
    line = LineGeometry.between(np.eye(4), pose((0.0, 0.0, 0.1, 1.0)))
    assert line.length_m == 0.0
    assert not line.is_empty


def test_full_turn_of_a_joint_is_not_wrapped() -> None:
    move = JointMove(np.array([2 * np.pi]), 1.0, 1)
    np.testing.assert_allclose(move.joints(np.zeros(1), np.array([1 / 3, 1.0])), [[2 * np.pi / 3], [2 * np.pi]])


@pytest.mark.parametrize("speed", [0.0, -0.5, 1.01, np.nan])
def test_joint_move_refuses_a_speed_that_is_no_fraction(speed: float) -> None:
    with pytest.raises(ValueError, match="line 7"):
        JointMove(np.zeros(6), speed, 7)


def test_line_refuses_a_speed_that_is_not_positive() -> None:
    with pytest.raises(ValueError, match="line 3"):
        Line(np.eye(4), 0.0, 3)


def test_sequence_without_blocks_is_refused() -> None:
    with pytest.raises(ValueError, match="at least one move"):
        Sequence([])
