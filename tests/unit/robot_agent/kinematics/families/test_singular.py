"""Singular poses of every family with a closed form."""

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from tests.unit.robot_families import random_joints, robot
from tests.unit.six_axis_arm import VECTORS, arm

SINGULAR = {
    "six_axis": {"wrist": (4, 0.0), "wrist 180": (4, np.pi)},
    "cobot": {"wrist": (4, 0.0), "wrist 180": (4, np.pi), "stretched": (2, 0.0)},
    "scara": {"stretched": (1, 0.0), "folded": (1, np.pi)},
    "palletizer": {"stretched": (2, -np.pi / 2), "folded": (2, np.pi / 2)},
    "gantry": {"wrist": (4, 0.0), "wrist 180": (4, np.pi)},
}
SINGULAR_CASES = [(family, name) for family, names in SINGULAR.items() for name in names]


@pytest.mark.parametrize("distance", [0.0, 1e-13, 1e-11, 1e-10, 1e-9, 1e-7, 1e-4])
@pytest.mark.parametrize(("family", "name"), SINGULAR_CASES, ids=[f"{f} {n}" for f, n in SINGULAR_CASES])
def test_at_and_near_singular_poses_the_pose_is_reproduced_and_nothing_is_nan(
    family: str, name: str, distance: float
) -> None:
    model, q = robot(family), random_joints(family, 300)
    joint, value = SINGULAR[family][name]
    q[:, joint] = value + distance
    poses = model.forward(q)
    solutions = model.inverse(poses, near=q)
    assert solutions.valid.any(axis=-1).all()
    back = model.forward(solutions.joints[solutions.valid])
    expected = np.broadcast_to(poses[:, None], (*solutions.valid.shape, 4, 4))[solutions.valid]
    np.testing.assert_allclose(back, expected, atol=1e-9)
    assert (model.singularity(q).nearest <= distance + 1e-12).all()
    assert set(model.singularity(q).name) <= {
        "shoulder",
        name.split()[0].replace("stretched", "elbow").replace("folded", "elbow"),
    }


@pytest.mark.parametrize("j5", [1e-10, 1e-9, 1e-8, 1e-7, np.pi - 1e-9, -1e-9])
def test_a_stretched_cobot_reaches_its_pose_though_its_straight_wrist_leaves_j6_nearly_free(j5: float) -> None:
    model, q = robot("cobot"), random_joints("cobot", 1000)
    q[:, 2], q[:, 4] = 0.0, j5
    poses = model.forward(q)
    for near in (q, q + 0.2) if abs(j5) > 1e-10 else (q,):  # a straight wrist holds J6
        solutions = model.inverse(poses, near=near)
        assert solutions.valid.any(axis=-1).all()
        back = model.forward(solutions.joints[solutions.valid])
        expected = np.broadcast_to(poses[:, None], (*solutions.valid.shape, 4, 4))[solutions.valid]
        np.testing.assert_allclose(back, expected, atol=1e-9)


@pytest.mark.parametrize("bent", [0.0, 1e-9, 1e-7, 3e-7, 1e-6, 1e-5])
@pytest.mark.parametrize("j5", [0.0, 1e-11, 1e-10, 1e-9, -1e-8, 1e-7, 1e-5])
def test_a_stretched_six_axis_arm_with_a_straight_wrist_goes_on_from_where_it_is(j5: float, bent: float) -> None:
    model, q = robot("six_axis"), random_joints("six_axis", 300)
    lengths = model.description.geometry
    q[:, 2] = bent - np.arctan2(lengths["a4x"] + lengths["a5x"], lengths["a4z"])
    q[:, 4] = j5
    poses = model.forward(q)
    for solutions, places in ((model.inverse(poses, near=q), q), (model.inverse(poses[0], near=q[0]), q[0])):
        off = np.where(solutions.in_limits, np.abs(solutions.joints - places[..., None, :]).max(axis=-1), np.inf)
        assert off.min(axis=-1).max() < 1e-5
    solutions = model.inverse(poses, near=q)
    back = model.forward(solutions.joints[solutions.valid])
    expected = np.broadcast_to(poses[:, None], (*solutions.valid.shape, 4, 4))[solutions.valid]
    np.testing.assert_allclose(back, expected, atol=2e-10)  # a straight wrist's axes are one line below a sine of 1e-10


@pytest.mark.parametrize(("family", "held"), [("cobot", 5), ("gantry", 3)])
@pytest.mark.parametrize("j5", [0.0, np.pi])
def test_with_a_straight_wrist_the_free_joint_holds_its_value(family: str, held: int, j5: float) -> None:
    model, q = robot(family), random_joints(family, 300)
    q[:, 4] = j5
    if family == "cobot":  # with another J6 the elbow is elsewhere too: keep it away from its stretched pose
        q[:, 2] = np.linspace(1.0, 1.8, 300)
    near = q.copy()
    near[:, held] += 0.3
    solutions = model.inverse(model.forward(q), near=near)
    assert solutions.singular.any(axis=-1).all()
    away = (solutions.joints - near[:, None])[solutions.singular][:, held] / (2 * np.pi)
    assert abs(away - np.rint(away)).max() < 1e-12


def test_the_shoulder_of_a_palletizer_on_axis_1_holds_its_value() -> None:
    model = robot("palletizer")
    pose = from_xyz_abc(np.array([0, 0, 1.9, 0, 0, 0.7]))
    solutions = model.inverse(pose, near=np.array([0.4, 0, 0, 0]))
    assert solutions.valid.any()
    assert solutions.singular[solutions.valid].all()
    assert (solutions.joints[solutions.valid][:, 0] == 0.4).all()


def test_the_elbow_of_a_scara_with_equal_arms_folds_onto_axis_1() -> None:
    model = robot("scara", geometry={"a1x": 0.3, "a1z": 0.0, "a2x": 0.3, "a2z": 0.0, "a4z": 0.0})
    pose = from_xyz_abc(np.array([0, 0, 0.1, 0, 0, 0.7]))
    solutions = model.inverse(pose, near=np.array([0.4, 0, 0, 0]))
    assert solutions.singular.all()
    np.testing.assert_allclose(model.forward(solutions.joints), np.broadcast_to(pose, (2, 4, 4)), atol=1e-12)
    assert (solutions.joints[:, 0] == 0.4).all()


@pytest.mark.parametrize("family", ["six_axis", "cobot"])
def test_the_measures_of_six_axes_multiply_to_the_determinant(family: str) -> None:
    model, q = robot(family), random_joints(family, 1000)
    ratio = abs(np.linalg.det(model.jacobian(q))) / model.singularity(q).distances.prod(axis=-1)
    assert np.ptp(ratio) / ratio.mean() < 1e-6


def test_a_delta_is_singular_where_an_arm_is_in_line_with_its_rod() -> None:
    model = robot("delta")
    pose = model.forward(np.radians([75.0, 10.0, 10.0, 0]))
    line = np.linspace(0, 1, 400)[:, None, None] * np.array([0, 0, -0.3])[:, None]
    path = np.tile(pose, (400, 1, 1))
    path[:, :3, 3] += line[..., 0]
    solutions = model.inverse(path)
    last = np.flatnonzero(solutions.valid[:, 0])[-1]
    measure = model.singularity(solutions.joints[last, 0])
    assert str(measure.name).startswith("arm")
    assert measure.nearest < 0.2


def test_determinants_of_the_jacobian_beside_the_singular_wrist_are_those_worked_out() -> None:
    bends, worked = np.array(VECTORS["determinant"]["by_j5_deg"]).T
    joints = np.radians([[10.0, 20.0, 30.0, 40.0, bend, 60.0] for bend in bends])
    np.testing.assert_allclose(np.linalg.det(arm().jacobian(joints)), worked, atol=1e-6)
