import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.geometry import (
    NoFrame,
    WrongShape,
    check_poses,
    frame_from_axes,
    frame_from_points,
    from_xyz_abc,
    quaternion,
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


def test_two_points_along_each_axis_give_the_frame_too() -> None:
    found = frame_from_axes(at(0, 0), at(0.1, 0.3), at(0.9, 0.3), at(0.2, -0.1), at(0.2, 0.6))
    np.testing.assert_allclose(found, POSES, atol=1e-12)


def test_x_is_taken_exactly_and_y_made_perpendicular() -> None:
    pose = frame_from_axes(np.zeros(3), np.zeros(3), np.array([1.0, 0, 0]), np.zeros(3), np.array([0.05, 1.0, 0]))
    np.testing.assert_allclose(pose, np.eye(4), atol=1e-15)


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


def test_skew_axes_are_refused_with_the_angle_and_the_place() -> None:
    y_to = np.array([[0.0, 1, 0], [0.5, 0.5, 0]])
    with pytest.raises(NoFrame, match=r"points\[1\]: the axes are 45\.0 deg apart"):
        frame_from_axes(np.zeros(3), np.zeros(3), np.array([1.0, 0, 0]), np.zeros((2, 3)), y_to)


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
