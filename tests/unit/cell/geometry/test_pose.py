import numpy as np
import pinocchio as pin
import pytest

from cell.geometry import (
    NotAPose,
    WrongShape,
    check_poses,
    compose,
    from_xyz_abc,
    inverse,
    pose_from,
    to_xyz_abc,
)

RNG = np.random.default_rng(4)
XYZ_ABC = np.hstack([RNG.uniform(-3, 3, (500, 3)), RNG.uniform(-np.pi, np.pi, (500, 3))])


def degrees(*abc: float) -> np.ndarray:
    return from_xyz_abc(np.append(np.zeros(3), np.radians(abc)))


def test_abc_are_turns_about_fixed_axes_x_then_y_then_z() -> None:
    expected = [
        pin.utils.rotate("z", c) @ pin.utils.rotate("y", b) @ pin.utils.rotate("x", a) for a, b, c in XYZ_ABC[:, 3:]
    ]
    np.testing.assert_allclose(from_xyz_abc(XYZ_ABC)[:, :3, :3], expected, atol=1e-14)


def test_abc_come_back_as_the_same_rotation() -> None:
    poses = from_xyz_abc(XYZ_ABC)
    np.testing.assert_allclose(from_xyz_abc(to_xyz_abc(poses)), poses, atol=1e-14)


@pytest.mark.parametrize("off", [0.0, 1e-12, 1e-9, 1e-6])
def test_near_b_90_the_rotation_is_still_exact(off: float) -> None:
    pose = from_xyz_abc(np.array([0, 0, 0, 0.4, np.pi / 2 - off, -1.2]))
    np.testing.assert_allclose(from_xyz_abc(to_xyz_abc(pose)), pose, atol=1e-9)


def test_angles_beyond_half_turns_are_accepted() -> None:
    np.testing.assert_allclose(degrees(250, 0, -90), degrees(-110, 0, -90), atol=1e-15)


@pytest.mark.parametrize("abc", [(180, 0, 0), (0, 180, 0), (0, 0, 180), (180, 0, 180), (90, 0, 180)])
def test_half_turns_come_back(abc: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(from_xyz_abc(to_xyz_abc(degrees(*abc))), degrees(*abc), atol=1e-15)


def test_inverse_agrees_with_the_inverse_matrix() -> None:
    poses = from_xyz_abc(XYZ_ABC)
    np.testing.assert_allclose(inverse(poses), np.linalg.inv(poses), atol=1e-13)


def test_pose_from_quaternion_broadcasts_one_orientation_over_many_positions() -> None:
    poses = pose_from(XYZ_ABC[:, :3], np.array([0, 0, np.sin(0.3), np.cos(0.3)]))
    np.testing.assert_allclose(to_xyz_abc(poses)[:, 5], 0.6)
    np.testing.assert_allclose(poses[:, :3, 3], XYZ_ABC[:, :3])


def test_compose_is_read_left_to_right() -> None:
    a, b, c = from_xyz_abc(XYZ_ABC[:3])
    np.testing.assert_allclose(compose(a, b, c), a @ b @ c)


def bad(change: str) -> np.ndarray:
    poses = from_xyz_abc(XYZ_ABC[:4])
    if change == "not finite":
        poses[2, 0, 3] = np.nan
    elif change == "orthogonal":
        poses[2, 0, 0] += 1e-3
    elif change == "left-handed":
        poses[2, :3, 0] *= -1
    else:
        poses[2, 3, 0] = 1.0
    return poses


@pytest.mark.parametrize("defect", ["not finite", "orthogonal", "left-handed", "last row"])
def test_what_is_no_pose_is_refused_with_its_index(defect: str) -> None:
    with pytest.raises(NotAPose, match=defect) as caught:
        check_poses(bad(defect), "taught point")
    assert caught.value.index == (2,)
    assert "taught point[2]" in str(caught.value)


def test_a_wrong_shape_is_refused() -> None:
    with pytest.raises(WrongShape, match=r"\(3, 3\)"):
        check_poses(np.eye(3))


@pytest.mark.parametrize("index", [(), (1,)])
@pytest.mark.parametrize(
    ("spoil", "defect"),
    [
        ((0, 0, np.nan), "not finite"),
        ((1, 3, np.inf), "not finite"),
        ((0, 1, 1e-4), "not orthogonal"),
        ((3, 0, 1e-9), "last row"),
    ],
)
def test_one_pose_and_many_are_refused_alike(
    index: tuple[int, ...], spoil: tuple[int, int, float], defect: str
) -> None:
    pose = np.eye(4)
    pose[spoil[:2]] = spoil[2]
    poses = np.stack([np.eye(4), pose]) if index else pose
    with pytest.raises(NotAPose, match=defect) as caught:
        check_poses(poses)
    assert caught.value.index == index


def test_a_defect_among_thousands_is_found_where_it_is() -> None:
    poses = np.tile(np.eye(4), (3, 1100, 1, 1))
    poses[2, 1007, :3, 0] *= -1
    with pytest.raises(NotAPose, match="left-handed") as caught:
        check_poses(poses)
    assert caught.value.index == (2, 1007)


@pytest.mark.parametrize("count", [None, 2])
def test_values_whose_products_overflow_are_refused(count: int | None) -> None:
    pose = np.eye(4)
    pose[:2, :2] = [[1e200, 1e200], [-1e200, 1e200]]
    with pytest.raises(NotAPose, match="not orthogonal"):
        check_poses(pose if count is None else np.tile(pose, (count, 1, 1)))
