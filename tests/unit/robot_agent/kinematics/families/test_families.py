"""What every family with a closed form answers: properties on many random joints, and what is refused."""

import numpy as np
import pytest

from cell.geometry import NotAPose, WrongShape
from robot_agent.kinematics import BadInput, BadModel, model_of
from robot_agent.model.description import NOTHING, Mounted
from tests.unit.robot_families import CLOSED, TOOLS, described, every_kind, off, random_joints, robot

COUNT = 10_000
with_tool_or_without = pytest.mark.parametrize("mounted", [NOTHING, Mounted(("torch",))], ids=["flange", "torch"])


@with_tool_or_without
@every_kind
def test_solutions_reproduce_the_pose_and_the_original_joints_are_among_them(
    family: str, joints: int | None, mounted: Mounted
) -> None:
    model, q = robot(family, joints, tools=TOOLS, mounted=mounted), random_joints(family, COUNT, joints)
    poses = model.forward(q)
    np.testing.assert_allclose(poses, model.links(q)[:, -1] @ model.description.pose_flange_tcp, atol=1e-12)
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
def test_no_branch_appears_twice(family: str, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, COUNT, joints)
    found = model.inverse(model.forward(q)).joints
    slots = found.shape[1]
    away = off(model, found[:, :, None], found[:, None]).max(axis=-1)
    away[:, np.arange(slots), np.arange(slots)] = np.inf
    assert not (away < 1e-6).any()


@with_tool_or_without
@every_kind
def test_the_jacobian_is_the_derivative_of_the_pose(family: str, joints: int | None, mounted: Mounted) -> None:
    model, q = robot(family, joints, tools=TOOLS, mounted=mounted), random_joints(family, 1000, joints)
    jacobian, step = model.jacobian(q), 1e-6
    for i, change in enumerate(np.eye(model.n) * step):
        ahead, after = model.forward(q + change), model.forward(q - change)
        np.testing.assert_allclose(jacobian[:, :3, i], (ahead - after)[:, :3, 3] / (2 * step), atol=1e-6)
        turn = ahead[:, :3, :3] @ np.swapaxes(after[:, :3, :3], -1, -2)
        spin = (turn - np.swapaxes(turn, -1, -2)) / (4 * step)
        np.testing.assert_allclose(jacobian[:, 3:, i], spin[:, (2, 0, 1), (1, 2, 0)], atol=1e-6)


@with_tool_or_without
@every_kind
def test_the_derivative_of_the_jacobian_is_that_along_the_motion(
    family: str, joints: int | None, mounted: Mounted
) -> None:
    model, q = robot(family, joints, tools=TOOLS, mounted=mounted), random_joints(family, 1000, joints)
    qd = np.random.default_rng(5).uniform(-1, 1, q.shape)
    step = 1e-6
    expected = (model.jacobian(q + step * qd) - model.jacobian(q - step * qd)) / (2 * step)
    found = model.jacobian_derivative(q, qd)
    scale = 1 + abs(expected).max(axis=(1, 2), keepdims=True)
    np.testing.assert_allclose(found / scale, expected / scale, atol=1e-6)


@every_kind
def test_no_capsule_is_ever_beyond_the_reach(family: str, joints: int | None) -> None:
    model, q = robot(family, joints), random_joints(family, COUNT, joints)
    farthest = (np.linalg.norm(model.capsules(q), axis=-1).max(axis=-1) + model.capsule_radii).max()
    assert farthest <= model.reach_m
    assert farthest > 0.5 * model.reach_m


@every_kind
def test_the_bulge_covers_what_lies_between_two_samples(family: str, joints: int | None) -> None:
    model, ends = robot(family, joints), random_joints(family, 2, joints)
    share = np.linspace(0, 1, 201)[:, None]
    q = ends[0] + (3 * share**2 - 2 * share**3) * (ends[1] - ends[0])
    points, coarse = model.body_and_tcp(q), q[::4]
    for i in range(1, 4):
        between = points[i::4]
        chord = points[:-1:4] + i / 4 * (points[4::4] - points[:-1:4])
        straight = points[4::4] - points[:-1:4]
        along = ((between - points[:-1:4]) * straight).sum(-1) / np.maximum((straight**2).sum(-1), 1e-30)
        chord = points[:-1:4] + np.clip(along, 0, 1)[..., None] * straight
        away = np.linalg.norm(between - chord, axis=-1).max(axis=(1, 2))
        assert (away <= model.bulge_m(coarse) + 1e-12).all()


@every_kind
def test_all_answers_keep_the_leading_dimensions(family: str, joints: int | None) -> None:
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


# What is refused


@every_kind
def test_what_is_no_pose_and_what_are_no_joints_is_refused(family: str, joints: int | None) -> None:
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
def test_a_description_of_another_robot_is_refused(family: str) -> None:
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


@every_kind
def test_no_poses_have_no_solutions(family: str, joints: int | None) -> None:
    model = robot(family, joints)
    solutions = model.inverse(np.empty((2, 0, 4, 4)))
    assert solutions.joints.shape == (2, 0, len(model.branches), model.n)
    assert solutions.tilt_rad.shape == (2, 0)
