import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.geometry import (
    NoFrame,
    WrongShape,
    check_poses,
    frame_from_points,
    from_xyz_abc,
    largest_shift,
    largest_turn,
    quaternion,
    taught_frame,
    to_xyz_abc,
    transform_points,
)

RNG = np.random.default_rng(9)
POSES = from_xyz_abc(np.hstack([RNG.uniform(-2, 2, (50, 3)), RNG.uniform(-np.pi, np.pi, (50, 3))]))


def at(x: float, y: float, z: float = 0.0) -> np.ndarray:
    """A point given in the frames `POSES`, in the frame outside."""
    return transform_points(POSES, np.array([x, y, z]))


def test_three_measured_points_give_the_frame() -> None:
    found = frame_from_points(at(0, 0), at(0.7, 0), at(-0.2, 0.5))
    np.testing.assert_allclose(check_poses(found), POSES, atol=1e-12)


def test_the_origin_of_three_points_is_the_foot_of_the_third_on_x_or_a_fourth() -> None:
    """The frame of the textbook, section 10.3, in mm."""
    points = np.array([[1085.287, 249.240, 282.635], [1341.147, 396.962, 230.541], [923.319, 328.274, 287.125]])
    found = taught_frame(points)
    np.testing.assert_allclose(found[:3, 3], [1000.0, 199.999, 300.0], atol=1e-3)
    np.testing.assert_allclose(np.degrees(to_xyz_abc(found)[3:]), [-5, 10, 30], atol=1e-3)
    fourth = taught_frame(np.vstack([points, [1.0, 2.0, 3.0]]))
    np.testing.assert_allclose(fourth[:3, 3], [1.0, 2.0, 3.0])
    np.testing.assert_allclose(fourth[:3, :3], found[:3, :3])


@pytest.mark.parametrize("points", [np.eye(3)[:2], np.zeros((5, 3)), np.zeros(3)])
def test_a_frame_is_taught_by_three_points_or_four(points: np.ndarray) -> None:
    with pytest.raises(WrongShape, match=r"\(3, 3\) or \(4, 3\)"):
        taught_frame(points)


UNIT = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array)


@given(
    along=st.floats(0.02, 1.0),
    foot=st.floats(-1.0, 1.0),
    aside=st.floats(0.02, 1.0),
    errors=st.tuples(UNIT, UNIT, UNIT),
)
def test_points_with_a_millimetre_of_error_turn_the_frame_no_farther_than_they_allow(
    along: float, foot: float, aside: float, errors: tuple[np.ndarray, ...]
) -> None:
    points = np.array([[0.0, 0, 0], [along, 0, 0], [foot, aside, 0]])
    moved = points + [0.001 * error / max(np.linalg.norm(error), 1.0) for error in errors]
    try:
        found = taught_frame(moved)
    except NoFrame:
        return  # told to whoever measures
    turned = 2.0 * np.arccos(min(float(quaternion.from_matrix(found[:3, :3])[3]), 1.0))
    assert turned <= largest_turn(points, 0.001) + 1e-7
    assert np.linalg.norm(found[:3, 3] - [foot, 0.0, 0.0]) <= largest_shift(points, 0.001) + 1e-12


def test_what_points_allow_is_not_far_from_what_their_worst_errors_do() -> None:
    points = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.0, 0.3, 0]])
    worst = points + np.array([[0, 0, 0.001], [0, 0, -0.001], [0, 0, -0.001]])
    turned = 2.0 * np.arccos(quaternion.from_matrix(taught_frame(worst)[:3, :3])[3])
    assert turned < largest_turn(points, 0.001) < 2.0 * turned
    worst = points + np.array([[0, -0.001, 0], [0, 0.001, 0], [0.001, 0, 0]])
    shifted = float(np.linalg.norm(taught_frame(worst)[:3, 3]))
    assert shifted < largest_shift(points, 0.001) < 3.0 * shifted


def test_points_nearer_to_each_other_than_their_errors_allow_any_turn() -> None:
    assert largest_turn(np.array([[0.0, 0, 0], [0.0015, 0, 0], [0, 0.3, 0]]), 0.001) == np.pi


@pytest.mark.parametrize(
    ("on_x", "in_xy", "defect"),
    [
        ([1, 0, 0], [2, 0, 0], "one line"),
        ([1, 0, 0], [-1, 0.001, 0], "one line"),
        ([1e-4, 0, 0], [0, 1, 0], "less than 1 mm apart"),
        ([1, 0, 0], [0, np.nan, 0], "not finite"),
    ],
)
def test_points_that_determine_no_frame_are_refused(on_x: list, in_xy: list, defect: str) -> None:
    with pytest.raises(NoFrame, match=defect):
        frame_from_points(np.zeros(3), np.array(on_x, dtype=float), np.array(in_xy, dtype=float))


def test_points_have_three_coordinates() -> None:
    with pytest.raises(WrongShape):
        frame_from_points(np.zeros(2), np.zeros(3), np.zeros(3))


@given(
    angles=st.tuples(*[st.sampled_from([-180.0, -90.0, -1e-9, 0.0, 1e-7, 45.0, 90.0 - 1e-9, 90.0, 135.0, 180.0])] * 3)
)
def test_angles_matrix_and_quaternion_are_one_rotation_at_every_edge(angles: tuple[float, float, float]) -> None:
    pose = from_xyz_abc(np.append(np.zeros(3), np.radians(angles)))
    through = quaternion.to_matrix(quaternion.from_matrix(pose[:3, :3]))
    np.testing.assert_allclose(through, pose[:3, :3], atol=1e-14)
    again = pose.copy()
    again[:3, :3] = through
    np.testing.assert_allclose(from_xyz_abc(to_xyz_abc(again)), pose, atol=1e-9)
