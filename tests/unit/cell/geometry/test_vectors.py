"""Rotations, frames and poses against every number of the sources."""

from functools import reduce
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from cell.geometry import (
    NotAPose,
    check_poses,
    compose,
    from_xyz_abc,
    inverse,
    quaternion,
    to_xyz_abc,
    transform_points,
)
from robot_agent.paths.orientation import between
from tests.unit.repository import vectors
from tests.unit.six_axis_arm import arm

VECTORS: dict[str, Any] = vectors("frames.json")


def each(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("case", VECTORS[name], ids=lambda case: case["id"])


def pose(x: float, y: float, z: float, *abc: float) -> np.ndarray:
    return from_xyz_abc(np.array([x, y, z, *np.radians(abc)]))


def turn(*abc: float) -> np.ndarray:
    return pose(0, 0, 0, *abc)


def with_rotation(rows: list[list[float]]) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, :3] = rows
    return matrix


@each("points")
def test_points_change_their_frame(case: dict) -> None:
    np.testing.assert_allclose(transform_points(pose(*case["pose"]), case["point"]), case["result"], atol=1e-10)


@pytest.mark.parametrize("angle", VECTORS["one_joint"]["angles"])
def test_one_joint_carries_the_end_of_its_arm_on_a_circle(angle: float) -> None:
    arm_m, height = VECTORS["one_joint"]["arm"], VECTORS["one_joint"]["height"]
    found = transform_points(compose(pose(0, 0, height, 0, 0, 0), turn(0, 0, angle)), [arm_m, 0, 0])
    expected = [arm_m * np.cos(np.radians(angle)), arm_m * np.sin(np.radians(angle)), height]
    np.testing.assert_allclose(found, expected, atol=1e-15)


@each("robots")
def test_three_robots_in_one_world(case: dict) -> None:
    base = pose(*np.array(case["base"]) / 1000, 0, 0, 0)
    np.testing.assert_allclose(1000 * transform_points(base, np.zeros(3)), case["base"], atol=1e-9)
    tcp = to_xyz_abc(base @ arm().forward(np.zeros(6)))
    np.testing.assert_allclose([*1000 * tcp[:3], *np.degrees(tcp[3:])], case["tcp_at_home"], atol=1e-9)


def test_a_turned_base_and_a_tool_around_the_arm_at_home() -> None:
    case = VECTORS["base_and_tool"]
    base, tool, expected = (
        pose(*np.array(case[name][:3]) / 1000, *case[name][3:]) for name in ("base", "tool", "tcp_at_home")
    )
    np.testing.assert_allclose(base @ arm().forward(np.zeros(6)) @ tool, expected, atol=1e-12)


@each("gimbal")
def test_at_b_90_the_held_angle_decides(case: dict) -> None:
    found = np.degrees(to_xyz_abc(turn(*case["abc"]), held_a=np.radians(case["held"]))[3:])
    np.testing.assert_allclose(found, case["result"], atol=1e-6)


@each("same_rotation")
def test_two_sets_of_angles_are_one_rotation(case: dict) -> None:
    np.testing.assert_allclose(turn(*case["abc"]), turn(*case["other"]), atol=1e-10)


def test_both_branches_of_2000_random_rotations_recompose() -> None:
    abc = np.random.default_rng(7).uniform(-np.pi, np.pi, (2000, 3))
    rotations = from_xyz_abc(np.hstack([np.zeros((2000, 3)), abc]))
    found = to_xyz_abc(rotations)
    np.testing.assert_allclose(from_xyz_abc(found), rotations, atol=1e-8)
    a, b, c = found[:, 3:].T
    other = np.column_stack([np.zeros((2000, 3)), a + np.pi, np.pi - b, c + np.pi])
    np.testing.assert_allclose(from_xyz_abc(other), rotations, atol=1e-8)


@each("matrices")
def test_angles_give_the_matrix(case: dict) -> None:
    np.testing.assert_allclose(turn(*case["abc"])[:3, :3], case["rows"], atol=case["atol"])


@each("sequences")
def test_turns_about_current_axes_multiply_on_the_right_about_fixed_ones_on_the_left(case: dict) -> None:
    turns = [pin.utils.rotate(axis, np.radians(angle)) for axis, angle in case["turns"]]
    product = reduce(np.matmul, turns if case["about"] == "current" else turns[::-1])
    np.testing.assert_allclose(product, case["rows"], atol=1e-10)
    # Through the operator's angles and the quaternion it is the same rotation.
    np.testing.assert_allclose(from_xyz_abc(to_xyz_abc(with_rotation(case["rows"])))[:3, :3], product, atol=1e-9)
    steps = [quaternion.from_matrix(matrix) for matrix in turns]
    whole = reduce(quaternion.multiply, steps if case["about"] == "current" else steps[::-1])
    np.testing.assert_allclose(quaternion.to_matrix(whole), case["rows"], atol=1e-10)


def test_the_inverse_is_no_transpose() -> None:
    case = VECTORS["inverse"]
    forth = pose(*case["pose"])
    np.testing.assert_allclose(inverse(forth)[:3, 3], case["translation"], atol=1e-10)
    assert abs(inverse(forth) - forth.T).max() > 0.1


@each("refused")
def test_what_is_no_rotation_is_refused(case: dict) -> None:
    with pytest.raises(NotAPose, match=case["why"]):
        check_poses(with_rotation(case["rows"]))


def test_the_gripper_that_points_down_is_right_handed() -> None:
    case = VECTORS["gripper"]
    matrix = check_poses(with_rotation(case["rows"]))
    np.testing.assert_allclose(matrix, turn(*case["abc"]), atol=1e-15)


def test_angles_give_the_quaternion_and_its_angle() -> None:
    case = VECTORS["quaternion"]
    x, y, z, w = quaternion.from_matrix(turn(*case["abc"])[:3, :3])
    np.testing.assert_allclose([w, x, y, z], case["wxyz"], atol=1e-6)
    assert np.degrees(2.0 * np.arccos(w)) == pytest.approx(case["angle"], abs=1e-5)


@each("slerp")
@pytest.mark.parametrize("sign", [1, -1])
def test_part_of_a_turn_from_the_identity(case: dict, sign: int) -> None:
    end = sign * quaternion.from_matrix(turn(*case["to"])[:3, :3])
    part = between(np.eye(3), quaternion.to_matrix(end), np.array([case["share"]]))
    matrix = with_rotation(part[0].tolist())
    np.testing.assert_allclose(np.degrees(to_xyz_abc(matrix)[3:]), case["abc"], atol=2e-6)
