"""What every family with a closed form answers, against the vectors and against itself."""

from typing import Any

import numpy as np
import pytest
from robot_families import CLOSED, VECTORS, described, random_joints, robot

from cell.geometry import NotAPose, WrongShape, from_xyz_abc, to_xyz_abc
from robot_agent.kinematics import (
    BadInput,
    BadModel,
    Model,
    OpenMechanism,
    Reason,
    TrackError,
    Unreachable,
    model_of,
)
from robot_agent.model import Family

COUNT = 10_000
KINDS = [(family, None) for family in CLOSED] + [(Family.DELTA, 3)]
every_kind = pytest.mark.parametrize(
    ("family", "joints"), KINDS, ids=[f"{family.value}{joints or ''}" for family, joints in KINDS]
)
FOUR_AXES = [Family.SCARA, Family.PALLETIZER, Family.DELTA]


def cases(name: str) -> list[Any]:
    return [
        pytest.param(family, case, id=f"{family.value} {i + 1}")
        for family in CLOSED
        for i, case in enumerate(VECTORS[family.value].get(name, ()))
    ]


def units(model: Model) -> np.ndarray:
    """Joints in mm and deg -> SI."""
    return np.where(model.linear, 1e-3, np.pi / 180)


def pose_of(mm_deg: list[float]) -> np.ndarray:
    return from_xyz_abc(np.append(np.array(mm_deg[:3]) / 1000, np.radians(mm_deg[3:])))


def off(model: Model, found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Distance of joints, whole turns aside."""
    away = found - expected
    return abs(np.where(model.linear, away, away - 2 * np.pi * np.rint(away / (2 * np.pi))))


# Vectors


@pytest.mark.parametrize(("family", "case"), cases("forward"))
def test_forward_reproduces_the_vectors(family: Family, case: dict[str, Any]) -> None:
    model = robot(family)
    found = to_xyz_abc(model.forward(units(model) * case["joints"]))
    np.testing.assert_allclose(
        found, np.append(np.array(case["pose"][:3]) / 1000, np.radians(case["pose"][3:])), atol=1e-8
    )


@pytest.mark.parametrize(("family", "case"), cases("inverse"))
def test_inverse_reproduces_every_branch_of_the_vectors(family: Family, case: dict[str, Any]) -> None:
    model = robot(family, turn_deg=720)
    solutions = model.inverse(pose_of(case["pose"]))
    for branch, joints in case["branches"].items():
        slot = solutions.branches.index(branch)
        assert solutions.valid[slot]
        assert off(model, solutions.joints[slot], units(model) * joints).max() < 2e-7


@pytest.mark.parametrize("case", VECTORS["gantry"]["rotations"], ids=["1", "2"])
def test_the_gantry_reproduces_the_rotations_of_the_thesis(case: dict[str, Any]) -> None:
    gantry = robot(Family.GANTRY)
    pose = gantry.forward(units(gantry) * case["joints"])
    np.testing.assert_allclose(pose[:3, :3], case["rows"], atol=1e-6)
    np.testing.assert_allclose(pose[:3, 3] * 1000, case["position"], atol=1e-9)
    for slot, branch in enumerate(gantry.branches):
        found = gantry.inverse(pose).joints[slot]
        assert off(gantry, found, units(gantry) * case["branches"][branch]).max() < 1e-9


def test_the_velocity_of_the_gantry_is_the_corrected_one() -> None:
    gantry, case = robot(Family.GANTRY), VECTORS["gantry"]["velocity"]
    jacobian = gantry.jacobian(units(gantry) * case["joints"])
    np.testing.assert_allclose(jacobian @ case["rates_si"], case["twist_si"], atol=1e-6)


@pytest.mark.parametrize(("family", "case"), cases("unreachable"))
def test_what_is_out_of_reach_says_which_way_and_how_far(family: Family, case: dict[str, Any]) -> None:
    model = robot(family)
    with pytest.raises(Unreachable, match=case["reason"]) as caught:
        model.solve(pose_of(case["pose"]), branch=case.get("branch"))
    if "excess_mm" in case:
        assert caught.value.violation.excess_m * 1000 == pytest.approx(case["excess_mm"], abs=1e-3)


def test_axes_and_joints_of_the_palletizer_differ_by_its_coupling() -> None:
    model = robot(Family.PALLETIZER, coupling=np.array(VECTORS["palletizer"]["coupling"], dtype=float))
    for case in VECTORS["palletizer"]["forward"]:
        axes, joints = np.radians(case["axes"]), np.radians(case["joints"])
        np.testing.assert_allclose(model.joints_from_axes(axes), joints, atol=1e-15)
        np.testing.assert_allclose(model.axes_from_joints(joints), axes, atol=1e-15)


@pytest.mark.parametrize("case", VECTORS["scara"]["turns"])
def test_the_turn_of_the_spindle_is_chosen_before_its_height(case: dict[str, Any]) -> None:
    scara = robot(Family.SCARA, turn_deg=720)
    pose = pose_of(VECTORS["scara"]["forward"][0]["pose"])
    found = scara.solve(pose, near=units(scara) * [30, 50, -45, case["j4_near"]])
    np.testing.assert_allclose(found / units(scara), [30, 50, case["j3"], case["j4"]], atol=1e-5)


def test_rods_that_do_not_meet_are_refused() -> None:
    lengths = described(Family.DELTA).geometry | {"k": VECTORS["delta"]["open"]["k"] / 1000}
    model = robot(Family.DELTA, geometry=lengths)
    with pytest.raises(OpenMechanism, match=r"joints\[1\]: found 0.00, 0.00, 0.00"):
        model.forward(np.radians([[85.0, 85, 85, 0], [0, 0, 0, 0]]))


# Properties on many random joints


@every_kind
def test_solutions_reproduce_the_pose_and_the_original_joints_are_among_them(
    family: Family, joints: int | None
) -> None:
    model, q = robot(family, joints), random_joints(family, COUNT, joints)
    poses = model.forward(q)
    solutions = model.inverse(poses, near=q)
    back = model.forward(solutions.joints[solutions.valid])
    expected = np.broadcast_to(poses[:, None], (*solutions.valid.shape, 4, 4))[solutions.valid]
    assert abs(back - expected).max() < 1e-9
    away = np.where(solutions.valid[..., None], abs(solutions.joints - q[:, None]), np.inf).max(axis=-1)
    assert away.min(axis=-1).max() < 1e-8
    assert np.isnan(solutions.joints[~solutions.valid]).all()
    assert np.isfinite(solutions.joints[solutions.valid]).all()
    assert solutions.complete


@every_kind
def test_no_branch_appears_twice(family: Family, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, COUNT, joints)
    found = model.inverse(model.forward(q)).joints
    slots = found.shape[1]
    away = off(model, found[:, :, None], found[:, None]).max(axis=-1)
    away[:, np.arange(slots), np.arange(slots)] = np.inf
    assert not (away < 1e-6).any()


@every_kind
def test_the_jacobian_is_the_derivative_of_the_pose(family: Family, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, 1000, joints)
    jacobian, step = model.jacobian(q), 1e-6
    for i, change in enumerate(np.eye(model.n) * step):
        ahead, behind = model.forward(q + change), model.forward(q - change)
        np.testing.assert_allclose(jacobian[:, :3, i], (ahead - behind)[:, :3, 3] / (2 * step), atol=1e-6)
        turn = (ahead[:, :3, :3] @ np.swapaxes(behind[:, :3, :3], -1, -2) - np.eye(3)) / (2 * step)
        np.testing.assert_allclose(jacobian[:, 3:, i], turn[:, (2, 0, 1), (1, 2, 0)], atol=1e-5)


@every_kind
def test_the_derivative_of_the_jacobian_is_that_along_the_motion(family: Family, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, 1000, joints)
    qd = np.random.default_rng(5).uniform(-1, 1, q.shape)
    step = 1e-6
    expected = (model.jacobian(q + step * qd) - model.jacobian(q - step * qd)) / (2 * step)
    found = model.jacobian_derivative(q, qd)
    scale = 1 + abs(expected).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-6)


@every_kind
def test_no_capsule_is_ever_beyond_the_reach(family: Family, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, COUNT, joints)
    farthest = (np.linalg.norm(model.capsules(q), axis=-1).max(axis=-1) + model.capsule_radii).max()
    assert farthest <= model.reach_m
    assert farthest > 0.5 * model.reach_m


@every_kind
def test_the_bulge_covers_what_lies_between_two_samples(family: Family, joints: int | None) -> None:
    model, ends = robot(family, joints), random_joints(family, 2, joints)
    share = np.linspace(0, 1, 201)[:, None]
    q = ends[0] + (3 * share**2 - 2 * share**3) * (ends[1] - ends[0])
    points, coarse = model.capsules(q), q[::4]
    for i in range(1, 4):
        between = points[i::4]
        chord = points[:-1:4] + i / 4 * (points[4::4] - points[:-1:4])
        straight = points[4::4] - points[:-1:4]
        along = ((between - points[:-1:4]) * straight).sum(-1) / np.maximum((straight**2).sum(-1), 1e-30)
        chord = points[:-1:4] + np.clip(along, 0, 1)[..., None] * straight
        away = np.linalg.norm(between - chord, axis=-1).max(axis=(1, 2))
        assert (away <= model.bulge_m(coarse) + 1e-12).all()


@every_kind
def test_all_answers_keep_the_leading_dimensions(family: Family, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, 12, joints).reshape(3, 4, -1)
    links, n = len(model.link_names), model.n
    assert model.forward(q).shape == (3, 4, 4, 4)
    assert model.links(q[0, 0]).shape == (links, 4, 4)
    assert model.jacobian(q).shape == model.jacobian_derivative(q, q).shape == (3, 4, 6, n)
    assert model.capsules(q).shape == (3, 4, links, 2, 3)
    solutions = model.inverse(model.forward(q), near=q)
    slots = len(model.branches)
    assert solutions.joints.shape == (3, 4, slots, n)
    assert solutions.valid.shape == solutions.singular.shape == solutions.excess_m.shape == (3, 4, slots)
    assert solutions.tilt_rad.shape == model.reaches(model.forward(q)).shape == (3, 4)
    assert model.singularity(q).nearest.shape == model.singularity(q).name.shape == (3, 4)
    assert model.inverse(model.forward(q[0, 0])).joints.shape == (slots, n)


# Singular poses

SINGULAR = {
    Family.SIX_AXIS: {"wrist": (4, 0.0), "wrist 180": (4, np.pi)},
    Family.COBOT: {"wrist": (4, 0.0), "wrist 180": (4, np.pi), "stretched": (2, 0.0)},
    Family.SCARA: {"stretched": (1, 0.0), "folded": (1, np.pi)},
    Family.PALLETIZER: {"stretched": (2, -np.pi / 2), "folded": (2, np.pi / 2)},
    Family.GANTRY: {"wrist": (4, 0.0), "wrist 180": (4, np.pi)},
}
SINGULAR_CASES = [(family, name) for family, names in SINGULAR.items() for name in names]


@pytest.mark.parametrize("distance", [0.0, 1e-13, 1e-11, 1e-10, 1e-9, 1e-7, 1e-4])
@pytest.mark.parametrize(("family", "name"), SINGULAR_CASES, ids=[f"{f.value} {n}" for f, n in SINGULAR_CASES])
def test_at_and_near_singular_poses_the_pose_is_reproduced_and_nothing_is_nan(
    family: Family, name: str, distance: float
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


@pytest.mark.parametrize(("family", "held"), [(Family.COBOT, 5), (Family.GANTRY, 3)])
@pytest.mark.parametrize("j5", [0.0, np.pi])
def test_with_a_straight_wrist_the_free_joint_holds_its_value(family: Family, held: int, j5: float) -> None:
    model, q = robot(family), random_joints(family, 300)
    q[:, 4] = j5
    if family is Family.COBOT:  # with another J6 the elbow is elsewhere too: keep it away from its stretched pose
        q[:, 2] = np.linspace(1.0, 1.8, 300)
    near = q.copy()
    near[:, held] += 0.3
    solutions = model.inverse(model.forward(q), near=near)
    assert solutions.singular.any(axis=-1).all()
    away = (solutions.joints - near[:, None])[solutions.singular][:, held] / (2 * np.pi)
    assert abs(away - np.rint(away)).max() < 1e-12


def test_the_shoulder_of_a_palletizer_on_axis_1_holds_its_value() -> None:
    model = robot(Family.PALLETIZER)
    pose = from_xyz_abc(np.array([0, 0, 1.9, 0, 0, 0.7]))
    solutions = model.inverse(pose, near=np.array([0.4, 0, 0, 0]))
    assert solutions.valid.any()
    assert solutions.singular[solutions.valid].all()
    assert (solutions.joints[solutions.valid][:, 0] == 0.4).all()


def test_the_elbow_of_a_scara_with_equal_arms_folds_onto_axis_1() -> None:
    model = robot(Family.SCARA, geometry={"a1x": 0.3, "a1z": 0.0, "a2x": 0.3, "a2z": 0.0, "a4z": 0.0})
    pose = from_xyz_abc(np.array([0, 0, 0.1, 0, 0, 0.7]))
    solutions = model.inverse(pose, near=np.array([0.4, 0, 0, 0]))
    assert solutions.singular.all()
    np.testing.assert_allclose(model.forward(solutions.joints), np.broadcast_to(pose, (2, 4, 4)), atol=1e-12)
    assert (solutions.joints[:, 0] == 0.4).all()


@pytest.mark.parametrize("family", [Family.SIX_AXIS, Family.COBOT])
def test_the_measures_of_six_axes_multiply_to_the_determinant(family: Family) -> None:
    model, q = robot(family), random_joints(family, 1000)
    ratio = abs(np.linalg.det(model.jacobian(q))) / model.singularity(q).distances.prod(axis=-1)
    assert np.ptp(ratio) / ratio.mean() < 1e-6


def test_a_delta_is_singular_where_an_arm_is_in_line_with_its_rod() -> None:
    model = robot(Family.DELTA)
    pose = model.forward(np.radians([75.0, 10.0, 10.0, 0]))
    line = np.linspace(0, 1, 400)[:, None, None] * np.array([0, 0, -0.3])[:, None]
    path = np.tile(pose, (400, 1, 1))
    path[:, :3, 3] += line[..., 0]
    solutions = model.inverse(path)
    last = np.flatnonzero(solutions.valid[:, 0])[-1]
    measure = model.singularity(solutions.joints[last, 0])
    assert str(measure.name).startswith("arm")
    assert measure.nearest < 0.2


# Targets that robots with few joints cannot take


@pytest.mark.parametrize("family", FOUR_AXES)
def test_a_tilted_target_is_refused_by_name(family: Family) -> None:
    model = robot(family)
    pose = model.forward(random_joints(family, 1)[0])
    tilted = pose @ from_xyz_abc(np.array([0, 0, 0, np.radians(0.01), 0, 0]))
    with pytest.raises(Unreachable, match=r"0\.0100 deg away from those") as caught:
        model.solve(tilted)
    assert caught.value.reason is Reason.TILTED
    solutions = model.inverse(np.stack([pose, tilted]))
    assert solutions.valid.any(axis=-1).tolist() == [True, False]
    assert model.why_unreachable(tilted).reason is Reason.TILTED  # type: ignore[union-attr]
    assert model.why_unreachable(pose) is None


@pytest.mark.parametrize("family", FOUR_AXES)
def test_a_target_upside_down_is_refused_too(family: Family) -> None:
    pose = robot(family).forward(random_joints(family, 1)[0]) @ from_xyz_abc(np.array([0, 0, 0, np.pi, 0, 0]))
    with pytest.raises(Unreachable, match="180"):
        robot(family).solve(pose)


def test_a_delta_without_a_fourth_axis_refuses_a_turned_target() -> None:
    model = robot(Family.DELTA, 3)
    pose = model.forward(np.zeros(3)) @ from_xyz_abc(np.array([0, 0, 0, 0, 0, 0.1]))
    with pytest.raises(Unreachable, match=r"5\.7296 deg"):
        model.solve(pose)


# What is refused


@every_kind
def test_what_is_no_pose_and_what_are_no_joints_is_refused(family: Family, joints: int | None) -> None:
    model = robot(family, joints)
    poses = model.forward(random_joints(family, 3, joints))
    mirrored, broken = poses.copy(), poses.copy()
    mirrored[1, :3, 0] *= -1
    broken[2, 0, 3] = np.nan
    with pytest.raises(NotAPose, match=r"poses\[1\].*left-handed"):
        model.inverse(mirrored)
    with pytest.raises(NotAPose, match=r"poses\[2\].*not finite"):
        model.inverse(broken)
    with pytest.raises(WrongShape):
        model.inverse(np.zeros(6))
    for q in (np.zeros(model.n + 1), np.full(model.n, np.nan)):
        with pytest.raises(BadInput):
            model.forward(q)
        with pytest.raises(BadInput):
            model.jacobian_derivative(np.zeros(model.n), q)
        with pytest.raises(BadInput):
            model.inverse(poses[0], near=q)


@pytest.mark.parametrize("family", CLOSED)
def test_a_description_of_another_robot_is_refused(family: Family) -> None:
    good = described(family)
    with pytest.raises(BadModel, match="length zz is unknown"):
        model_of(described(family, geometry=good.geometry | {"zz": 1.0}))
    with pytest.raises(BadModel, match="is missing"):
        model_of(described(family, geometry={}))
    with pytest.raises(BadModel, match="joints, allowed"):
        model_of(described(family, joint_names=("J1", "J2")))
    with pytest.raises(BadModel, match="slide"):
        model_of(described(family, linear=tuple(not slides for slides in good.linear)))
    with pytest.raises(BadModel, match="lower triangular"):
        model_of(described(family, coupling=np.triu(np.ones((len(good.linear),) * 2))))


# Paths


@every_kind
def test_a_joint_path_is_found_again_from_its_poses(family: Family, joints: int | None) -> None:
    model = robot(family, joints, turn_deg=1000)
    rng = np.random.default_rng(12)
    for start in random_joints(family, 30, joints, seed=13):
        start = np.where(model.linear, 0.8 * start, start)
        share = np.linspace(0, 1, 300)[:, None]
        end = start + rng.uniform(-0.15, 0.15, model.n) * np.where(model.linear, 0.3, 1.0)
        q = start + share * (end - start)
        if model.singularity(q).nearest.min() < 0.05:
            continue
        np.testing.assert_allclose(model.track(model.forward(q), start=start), q, atol=1e-7)


def test_the_spindle_turns_on_beyond_half_a_turn_and_its_height_follows() -> None:
    scara = robot(Family.SCARA, turn_deg=1500)
    q = np.tile([0.3, 0.9, -0.05, 0.0], (600, 1))
    q[:, 3] = np.linspace(2.5, 20.0, 600)
    np.testing.assert_allclose(scara.track(scara.forward(q), start=q[0]), q, atol=1e-9)


@pytest.mark.parametrize("j5", [0.0, np.pi])
def test_the_cobots_singular_vector_comes_back_with_its_held_joint(j5: float) -> None:
    cobot, q = robot(Family.COBOT), np.array([0.4, -0.6, 0.9, 0.3, j5, -0.5])
    found = cobot.solve(cobot.forward(q), near=q)
    np.testing.assert_allclose(cobot.forward(found), cobot.forward(q), atol=1e-12)
    assert off(cobot, found, q).max() < 1e-9


def test_a_tilted_pose_on_the_way_ends_a_path_by_name() -> None:
    scara = robot(Family.SCARA)
    poses = scara.forward(np.tile([0.3, 0.9, -0.05, 0.4], (3, 1)))
    poses[2] = poses[2] @ from_xyz_abc(np.array([0, 0, 0, 0.2, 0, 0]))
    with pytest.raises(TrackError, match="deg away from those") as caught:
        scara.track(poses, start=np.array([0.3, 0.9, -0.05, 0.4]))
    assert (caught.value.index, caught.value.reason) == (2, Reason.TILTED)


def test_a_slide_at_its_limit_is_named_in_millimetres() -> None:
    scara = robot(Family.SCARA)
    pose = scara.forward(np.array([0.3, 0.9, 0.7, 0.0]))
    with pytest.raises(Unreachable, match=r"joint J3 would need 700\.00 mm, allowed -600\.00 to 600\.00"):
        scara.solve(pose, branch="RIGHT")
