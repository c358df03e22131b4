"""Arms that other books describe in other ways: the same robots, through the families of this project."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from cell.geometry import to_xyz_abc
from robot_agent.kinematics import Model
from robot_agent.model import load_description
from tests.unit.config_world import CONFIGS, ROBOT
from tests.unit.repository import vectors
from tests.unit.robot_families import robot
from tests.unit.six_axis_arm import arm

VECTORS: dict[str, Any] = vectors("arms.json")
SIGNS = np.array([1, -1, -1, 1, -1, 1])
ZEROS = np.array([0, np.pi / 2, 0, 0, 0, 0])
"""Joints of the arm in Denavit-Hartenberg form: ours = signs * its + zeros."""


def each(name: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize("case", VECTORS[name], ids=lambda case: case["id"])


def dh_arm(d6: float) -> Model:
    """Upper arm l2, forearm d4, no offsets, a spherical wrist; its zero pose has both arms along other axes."""
    lengths = dict.fromkeys(("a1z", "a2x", "a2z", "a4x", "a4z"), 0.0)
    g = VECTORS["dh_arm"]["lengths"]
    return robot("six_axis", turn_deg=400, geometry=lengths | {"a3z": g["l2"], "a5x": g["d4"], "a6x": d6})


def ours(joints: Any) -> np.ndarray:
    dh = np.asarray(joints, dtype=float)
    return np.asarray(SIGNS[: dh.shape[-1]] * dh + ZEROS[: dh.shape[-1]])


def flange_turn(model: Model) -> np.ndarray:
    """Our flange in the last frame of the table, from the pose with all joints zero."""
    return np.asarray(VECTORS["dh_arm"]["poses"][1]["rows"]).T @ model.forward(ours(np.zeros(6)))[:3, :3]


def arm_joints(joints: Any) -> np.ndarray:
    """Of the arm with three axes, whose elbow is straight at zero."""
    j1, j2, elbow = np.asarray(joints, dtype=float)
    return np.append(ours([j1, j2, elbow + np.pi / 2]), [0.3, 0.8, 0.2])


@pytest.mark.parametrize("case", VECTORS["dh_arm"]["poses"], ids=lambda case: case["id"])
def test_the_six_axes_of_the_table(case: dict) -> None:
    model = dh_arm(VECTORS["dh_arm"]["lengths"]["d6"])
    pose = model.forward(ours(case["joints"]))
    np.testing.assert_allclose(pose[:3, 3], case["position"], atol=1e-9)
    np.testing.assert_allclose(pose[:3, :3], np.array(case["rows"]) @ flange_turn(model), atol=1e-9)
    if "determinant" in case:
        determinant = np.linalg.det(model.jacobian(ours(case["joints"]))) * SIGNS.prod()
        assert determinant == pytest.approx(case["determinant"], abs=1e-9)


def test_its_eight_solutions() -> None:
    model = dh_arm(VECTORS["dh_arm"]["lengths"]["d6"])
    expected = ours(VECTORS["dh_arm"]["branches"]["joints"])
    solutions = model.inverse(model.forward(expected[0]))
    assert solutions.valid.all()
    away = solutions.joints[:, None] - expected
    away = abs(away - 2 * np.pi * np.rint(away / (2 * np.pi))).max(axis=-1)
    assert sorted(away.argmin(axis=1)) == list(range(8))
    assert away.min(axis=1).max() < 1e-8


@each("three_axes")
def test_the_three_axes_of_the_arm(case: dict) -> None:
    model = dh_arm(0.0)
    q = arm_joints(case["joints"])
    np.testing.assert_allclose(model.forward(q)[:3, 3], case["position"], atol=1e-9)
    determinant = np.linalg.det(model.jacobian(q)[:3, :3]) * SIGNS[:3].prod()
    assert determinant == pytest.approx(case["determinant"], abs=1e-9)


def test_the_four_solutions_of_the_arm() -> None:
    model, case = dh_arm(0.0), VECTORS["three_axes_branches"]
    expected = np.array([arm_joints(np.radians(joints)) for joints in case["joints_deg"]])[:, :3]
    (start,) = (arm_joints(case["joints"]) for case in VECTORS["three_axes"] if case["id"] == "V20")
    solutions = model.inverse(model.forward(start))
    away = solutions.joints[:, None, :3] - expected
    away = abs(away - 2 * np.pi * np.rint(away / (2 * np.pi))).max(axis=-1)
    assert set(away.argmin(axis=1)) == set(range(4))
    assert away.min(axis=1).max() < 1e-8


@each("wrist")
def test_the_wrist_z_y_z_is_that_of_the_gantry(case: dict) -> None:
    model = robot("gantry", geometry={"a6z": case["d6"]})
    pose = model.forward(np.append(np.zeros(3), case["joints"]))
    slides = model.links(np.zeros(6))[3, :3, :3]
    rows = np.array(case["rows"])
    np.testing.assert_allclose(slides.T @ pose[:3, :3], rows, atol=1e-9)
    np.testing.assert_allclose(slides.T @ pose[:3, 3], case["d6"] * rows[:, 2], atol=1e-9)
    found = model.inverse(pose).joints[:, 3:]
    for expected in (case["joints"], case["other"]):
        assert abs(np.sin((found - expected) / 2)).max(axis=1).min() < 1e-9


@each("straight_wrist")
def test_a_straight_wrist_has_one_sum_or_difference(case: dict) -> None:
    model = robot("gantry")
    one, same = (np.array([0, 0, 0, case[name][0], case["j5"], case[name][1]]) for name in ("joints", "same"))
    np.testing.assert_allclose(model.forward(one), model.forward(same), atol=1e-12)
    # Held at the other set's J4, the inverse finds the other set.
    solutions = model.inverse(model.forward(one), near=same)
    assert solutions.singular.all()
    assert abs(np.sin((solutions.joints[:, 3:] - same[3:]) / 2)).max() < 1e-9


def planar(lengths: list[float]) -> Model:
    geometry = dict(zip(("a1x", "a2x"), lengths, strict=True)) | dict.fromkeys(("a1z", "a2z", "a4z"), 0.0)
    return robot("scara", geometry=geometry)


def flat(joints: list[float]) -> np.ndarray:
    return np.append(joints, [0.0, 0.0])


@each("planar")
def test_two_axes_in_the_plane_are_a_scara(case: dict) -> None:
    model, q = planar(case["lengths"]), flat(case["joints"])
    np.testing.assert_allclose(model.forward(q)[:2, 3], case["position"], atol=1e-9)
    jacobian = model.jacobian(q)[:2, :2]
    np.testing.assert_allclose(jacobian, case["jacobian"], atol=1e-9)
    assert np.linalg.det(jacobian) == pytest.approx(case["determinant"], abs=1e-9)
    if "other" in case:
        np.testing.assert_allclose(model.inverse(model.forward(q)).joints[1, :2], case["other"], atol=1e-9)


@each("planar_singular")
def test_stretched_and_folded_they_lose_a_direction(case: dict) -> None:
    model, q = planar(case["lengths"]), flat(case["joints"])
    assert np.linalg.norm(model.forward(q)[:2, 3]) == pytest.approx(case["radius"])
    jacobian = model.jacobian(q)[:2, :2]
    np.testing.assert_allclose(jacobian[:, 0], case["columns"] * jacobian[:, 1], atol=1e-9)
    # All six rows keep the rank: only the position loses a direction, which the measure must say.
    assert np.linalg.matrix_rank(model.jacobian(q)[:, :2]) == 2
    assert float(model.singularity(q).nearest) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("case", VECTORS["planar_rates"]["cases"], ids=lambda case: f"{case['j2']} rad")
def test_near_the_border_joint_speeds_grow_without_bound(case: dict) -> None:
    jacobian = planar(VECTORS["planar_rates"]["lengths"]).jacobian(flat([0.0, case["j2"]]))[:2, :2]
    rates = np.linalg.solve(jacobian, VECTORS["planar_rates"]["velocity"])
    np.testing.assert_allclose(rates, case["rates"], atol=case["atol"])


def test_a_point_on_a_turning_body() -> None:
    case = VECTORS["turning_point"]
    jacobian = planar([0.5, case["radius"] - 0.5]).jacobian(np.zeros(4))
    np.testing.assert_allclose(jacobian[:3, 0] * case["omega"], case["velocity"], atol=1e-12)


def test_a_gear_divides_the_angle_and_multiplies_the_torque() -> None:
    case = VECTORS["gear"]
    motor = replace(load_description(CONFIGS / ROBOT).motors["J1"], gear=case["gear"])
    assert case["motor_rad"] / motor.ratio == case["joint_rad"]
    assert case["motor_nm"] * motor.ratio == case["joint_nm"]


# The example arm


def test_jacobian_speeds_and_torques_of_the_example_arm() -> None:
    case = VECTORS["example_arm"]
    q = np.radians(case["joints_deg"])
    tcp = to_xyz_abc(arm().forward(q))
    np.testing.assert_allclose([*1000 * tcp[:3], *np.degrees(tcp[3:])], case["tcp_mm_deg"], atol=1e-5)
    jacobian = np.diag([1e3, 1e3, 1e3, 1, 1, 1]) @ arm().jacobian(q)
    np.testing.assert_allclose(jacobian, case["jacobian_mm"], atol=1e-6)
    assert np.linalg.det(jacobian) == pytest.approx(case["determinant_mm"], abs=0.01)
    np.testing.assert_allclose(jacobian @ case["rates"], case["twist_mm"], atol=1e-6)
    np.testing.assert_allclose(jacobian.T @ case["wrench_n"], case["torques_nmm"], atol=1e-3)


@each("near_singular")
def test_near_the_singular_wrist_a_slow_flange_needs_fast_joints(case: dict) -> None:
    model = arm()
    q = np.array([0, 0, 0, 0, np.radians(case["j5_deg"]), 0])
    speed = np.append(np.array(case["speed_mm_s"]) / 1000, np.zeros(3))
    rates = dict(zip(model.joint_names, np.degrees(np.linalg.solve(model.jacobian(q), speed)), strict=True))
    for joint, expected in case["rates_deg_s"].items():
        assert rates[joint] == pytest.approx(expected, abs=case["atol"])


def test_the_elbow_of_the_example_arm_is_singular_where_it_is_straight_and_folded() -> None:
    for j3 in (VECTORS["elbow_deg"]["stretched"], VECTORS["elbow_deg"]["folded"]):
        near = arm().singularity(np.array([0.1, 0.2, np.radians(j3), 0.5, 0.9, 0]))
        assert str(near.name) == "elbow"
        assert float(near.nearest) < 1e-7


def test_turning_joint_1_carries_the_flange_on_an_arc() -> None:
    case = VECTORS["joint_move"]
    q = np.zeros((3, 6))
    q[:, 0] = np.radians(case["j1_deg"])
    points = 1000 * arm().forward(q)[:, :2, 3]
    np.testing.assert_allclose(points, case["points_mm"], atol=1e-5)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), case["radius_mm"])


def test_the_determinant_of_the_gantry_is_the_sine_of_j5() -> None:
    case = VECTORS["gantry_determinant"]
    q = np.append(np.zeros(3), np.radians(case["joints_deg"]))
    assert np.linalg.det(robot("gantry").jacobian(q)) == pytest.approx(case["determinant"], abs=1e-6)
