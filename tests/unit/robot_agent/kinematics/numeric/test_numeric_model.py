"""Chains out of a URDF: forward against Pinocchio, inverse by iteration within the limits, bare files."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import (
    BadInput,
    BadModel,
    KinematicsError,
    Model,
    NotInUrdf,
    Reason,
    TrackError,
    UnknownName,
    Unreachable,
    load_model,
    model_of,
)
from robot_agent.kinematics.numeric.least_squares import pose_error
from robot_agent.model import Mounted
from tests.unit.repository import ROOT
from tests.unit.robot_families import TOOLS, TORCH

MODELS = ROOT / "cell_configs" / "models"
PAINTER = load_model(MODELS / "painter.yaml")
BARE = load_model(MODELS / "painter.urdf")
RNG = np.random.default_rng(11)

# A chain with every kind of joint: oblique, endless and sliding, and a link behind it that branches off.
ODD = """<robot name="odd">
  <link name="root"/><link name="a"/><link name="b"/><link name="c"/><link name="hand"/><link name="lamp"/>
  <joint name="swing" type="revolute"><parent link="root"/><child link="a"/>
    <origin xyz="0.1 0 1" rpy="0.3 0.2 -0.4"/><axis xyz="0.6 0 0.8"/>
    <limit lower="-1" upper="2" velocity="3" effort="1"/></joint>
  <joint name="spin" type="continuous"><parent link="a"/><child link="b"/>
    <origin xyz="0 1 0"/><axis xyz="0 0 -1"/><limit velocity="3" effort="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="b"/><child link="c"/>
    <origin xyz="0 0 0.2" rpy="1 0 0"/><axis xyz="0 -1 1"/>
    <limit lower="-0.1" upper="0.2" velocity="1" effort="1"/></joint>
  <joint name="mount" type="fixed"><parent link="c"/><child link="hand"/><origin xyz="0 0 0.3" rpy="0 0 1"/></joint>
  <joint name="lamp_mount" type="fixed"><parent link="b"/><child link="lamp"/></joint>
</robot>"""


def random_joints(model: Model, count: int) -> np.ndarray:
    lower, upper = model.limits.position.T
    return RNG.uniform(lower, upper, (count, model.n))


# Forward


def test_every_link_and_the_jacobian_agree_with_pinocchio() -> None:
    peer = pin.buildModelFromUrdf(str(MODELS / "painter.urdf"))
    data = peer.createData()
    frames = [peer.getFrameId(name) for name in PAINTER.link_names]
    q = random_joints(PAINTER, 10_000)
    links, jacobians = PAINTER.links(q), PAINTER.jacobian(q)
    for i, joints in enumerate(q):
        pin.framesForwardKinematics(peer, data, joints)
        for link, frame in enumerate(frames):
            assert abs(links[i, link] - data.oMf[frame].homogeneous).max() < 1e-9
        if i < 500:
            expected = pin.computeFrameJacobian(peer, data, joints, frames[-1], pin.LOCAL_WORLD_ALIGNED)
            assert abs(jacobians[i] - expected).max() < 1e-9


def test_oblique_endless_and_sliding_joints_agree_with_pinocchio(tmp_path: Path) -> None:
    (tmp_path / "odd.urdf").write_text(
        ODD.replace('<link name="lamp"/>', "").split('  <joint name="lamp')[0] + "</robot>"
    )
    model = load_model(tmp_path / "odd.urdf")
    peer = pin.buildModelFromUrdf(str(tmp_path / "odd.urdf"))
    data, hand = peer.createData(), peer.getFrameId("hand")
    assert (model.joint_names, model.linear.tolist()) == (("swing", "spin", "slide"), [False, False, True])
    for swing, spin, slide in random_joints(model, 200):
        joints = np.array([swing, np.cos(spin), np.sin(spin), slide])
        pin.framesForwardKinematics(peer, data, joints)
        found = np.array([swing, spin, slide])
        assert abs(model.forward(found) - data.oMf[hand].homogeneous).max() < 1e-9
        expected = pin.computeFrameJacobian(peer, data, joints, hand, pin.LOCAL_WORLD_ALIGNED)
        assert abs(model.jacobian(found) - expected).max() < 1e-9


def test_the_derivative_of_the_jacobian_is_that_along_the_motion() -> None:
    q, step = random_joints(PAINTER, 300), 1e-6
    qd = RNG.uniform(-1, 1, q.shape)
    expected = (PAINTER.jacobian(q + step * qd) - PAINTER.jacobian(q - step * qd)) / (2 * step)
    np.testing.assert_allclose(PAINTER.jacobian_derivative(q, qd), expected, atol=1e-7)


def test_with_a_tool_poses_are_those_of_its_tcp() -> None:
    model = model_of(replace(PAINTER.description, tools=TOOLS, mounted=Mounted(("torch",))))
    peer = pin.buildModelFromUrdf(str(MODELS / "painter.urdf"))
    last = peer.getFrameId(PAINTER.link_names[-1])
    on_last = peer.frames[last].placement * pin.SE3(TORCH.pose_flange_tcp)
    tip = peer.addFrame(pin.Frame("tip", peer.njoints - 1, last, on_last, pin.OP_FRAME))
    data, frame = peer.createData(), pin.LOCAL_WORLD_ALIGNED
    for q in random_joints(model, 20):
        pin.framesForwardKinematics(peer, data, q)
        assert abs(model.forward(q) - data.oMf[tip].homogeneous).max() < 1e-9
        assert abs(model.jacobian(q) - pin.computeFrameJacobian(peer, data, q, tip, frame)).max() < 1e-9
    start = PAINTER.home
    ahead = model.forward(start + np.linspace(0.0, 0.05, 12)[:, None])
    np.testing.assert_allclose(model.forward(model.track(ahead, start)), ahead, atol=1e-6)
    np.testing.assert_allclose(model.solve(ahead[5], near=start), start + 5 * 0.05 / 11, atol=1e-5)
    far = ahead[0].copy()
    far[:3, 3] = 1.01 * model.reach_m, 0.0, 0.0
    with pytest.raises(Unreachable, match="too far"):
        model.solve(far)


def test_the_measure_of_singularity_is_zero_where_two_axes_are_one() -> None:
    straight = PAINTER.home.copy()
    straight[2] = np.arctan2(0.12, 1.1) - np.pi / 2  # the wrist in line with the upper arm: the elbow is stretched
    assert PAINTER.singularity(PAINTER.home).nearest > 0.02
    assert str(PAINTER.singularity(straight).name) == "dependent axes"
    assert PAINTER.singularity(straight).nearest < PAINTER.singularity(PAINTER.home).nearest / 2


# Inverse


def test_at_least_99_of_100_reachable_poses_are_solved_inside_the_limits() -> None:
    q = random_joints(PAINTER, 4_000)
    poses = PAINTER.forward(q)
    solutions = PAINTER.inverse(poses)
    assert solutions.valid.any(axis=-1).mean() >= 0.99
    expected = np.broadcast_to(poses[:, None], (*solutions.valid.shape, 4, 4))[solutions.valid]
    assert abs(PAINTER.forward(solutions.joints[solutions.valid]) - expected).max() < 1e-9
    lower, upper = PAINTER.limits.position.T
    inside = solutions.joints[solutions.valid]
    assert ((inside >= lower - 1e-9) & (inside <= upper + 1e-9)).all()
    assert not solutions.complete
    assert np.isnan(solutions.joints[~solutions.valid]).all()


def test_near_is_the_first_start_and_solutions_are_sorted_by_their_distance_from_it() -> None:
    q = random_joints(PAINTER, 300)
    solutions = PAINTER.inverse(PAINTER.forward(q), near=q)
    np.testing.assert_allclose(solutions.joints[:, 0], q, atol=1e-6)
    away = ((solutions.joints - q[:, None]) ** 2).sum(axis=-1)
    assert (np.diff(away, axis=1)[solutions.valid[:, 1:]] >= -1e-9).all()


def test_no_solution_appears_twice() -> None:
    joints = PAINTER.inverse(PAINTER.forward(random_joints(PAINTER, 300))).joints
    away = abs(joints[:, :, None] - joints[:, None]).max(axis=-1)
    away[:, np.arange(8), np.arange(8)] = np.inf
    assert not (away < 1e-6).any()


def test_the_same_question_has_the_same_answer() -> None:
    poses = PAINTER.forward(random_joints(PAINTER, 20))
    np.testing.assert_array_equal(PAINTER.inverse(poses).joints, PAINTER.inverse(poses).joints)


def test_a_half_turn_away_is_found_too() -> None:
    pose = PAINTER.forward(PAINTER.home)
    error = pose_error((pose @ from_xyz_abc(np.array([0, 0, 0, np.pi, 0, 0])))[None], pose[None])
    assert np.linalg.norm(error[0, 3:]) == pytest.approx(np.pi)
    np.testing.assert_allclose(abs(error[0, 3:] @ pose[:3, 0]), np.pi, atol=1e-7)


def test_all_answers_keep_the_leading_dimensions() -> None:
    q = random_joints(PAINTER, 6).reshape(2, 3, 6)
    solutions = PAINTER.inverse(PAINTER.forward(q), near=q)
    assert solutions.joints.shape == (2, 3, 8, 6)
    assert solutions.valid.shape == solutions.excess_m.shape == (2, 3, 8)
    assert PAINTER.capsules(q).shape == (2, 3, 7, 2, 3)


# Why not


def test_too_far_is_told_from_the_length_of_the_chain() -> None:
    with pytest.raises(Unreachable, match="too far") as caught:
        PAINTER.solve(from_xyz_abc(np.array([9.0, 0, 0, 0, 0, 0])))
    assert caught.value.reason is Reason.TOO_FAR


def test_a_limit_that_alone_is_in_the_way_is_named() -> None:
    turned = PAINTER.home.copy()
    turned[0] = np.radians(179.5)
    with pytest.raises(Unreachable, match=r"joint J[1-6] would need") as caught:
        PAINTER.solve(PAINTER.forward(turned), near=PAINTER.home)
    assert caught.value.reason is Reason.JOINT_LIMIT


def test_what_no_start_reaches_is_not_found_with_its_nearest_miss() -> None:
    inside = from_xyz_abc(np.array([0.2, 0.0, 0.85, 0, 0, 0]))
    with pytest.raises(Unreachable, match=r"no start led to .* mm and .* deg away") as caught:
        PAINTER.solve(inside)
    assert caught.value.reason is Reason.NOT_FOUND
    assert not PAINTER.reaches(inside)


def test_a_numeric_solver_has_no_branches_to_force() -> None:
    with pytest.raises(UnknownName, match="S1, S2"):
        PAINTER.solve(PAINTER.forward(PAINTER.home), branch="FRONT")


# Paths


def test_a_joint_path_is_found_again_from_its_poses() -> None:
    for _ in range(5):
        start = PAINTER.home + RNG.uniform(-0.3, 0.3, 6)
        q = start + np.linspace(0, 1, 200)[:, None] * RNG.uniform(-0.4, 0.4, 6)
        np.testing.assert_allclose(PAINTER.track(PAINTER.forward(q), start=start), q, atol=1e-8)


def test_a_path_that_leaves_the_limits_names_the_joint() -> None:
    q = np.tile(PAINTER.home, (200, 1))
    q[:, 0] = np.radians(np.linspace(120, 175, 200))
    with pytest.raises(TrackError, match="joint J1 would need 16") as caught:
        PAINTER.track(PAINTER.forward(q), start=q[0])
    assert (caught.value.reason, caught.value.joint) == (Reason.JOINT_LIMIT, "J1")
    assert caught.value.index == int(np.argmax(q[:, 0] > np.radians(160)))


def test_a_path_that_jumps_is_a_branch_change() -> None:
    here, there = PAINTER.home, PAINTER.home + np.array([1.5, 0, 0, 0, 0, 0])
    with pytest.raises(TrackError) as caught:
        PAINTER.track(PAINTER.forward(np.stack([here, here, there])), start=here)
    assert (caught.value.index, caught.value.reason) == (2, Reason.BRANCH_CHANGE)


def test_a_path_out_of_reach_fails_at_its_first_pose() -> None:
    with pytest.raises(TrackError, match="too far") as caught:
        PAINTER.track(from_xyz_abc(np.array([[9.0, 0, 0, 0, 0, 0]])), start=PAINTER.home)
    assert caught.value.index == 0
    with pytest.raises(BadInput, match="m > 0"):
        PAINTER.track(np.empty((0, 4, 4)), start=PAINTER.home)


# Files


def test_a_bare_urdf_gives_kinematics_and_names_what_it_lacks() -> None:
    q = random_joints(PAINTER, 5)
    np.testing.assert_allclose(BARE.forward(q), PAINTER.forward(q), atol=1e-12)
    assert BARE.joint_names[0] == "axis_1"
    assert BARE.limits.position.shape == (6, 2)
    assert BARE.limits.velocity.tolist() == [2.0, 2.0, 2.0, 5.0, 5.0, 6.5]
    assert BARE.inverse(BARE.forward(q)).valid.any(axis=-1).all()
    for ask in (
        lambda: BARE.limits.acceleration,
        lambda: BARE.limits.jerk,
        lambda: BARE.home,
        lambda: BARE.capsule_radii,
        lambda: BARE.capsules(q),
        lambda: BARE.description.path,
    ):
        with pytest.raises(NotInUrdf, match=r"painter\.urdf: a URDF says nothing about"):
            ask()


def test_a_model_out_of_a_urdf_travels_to_the_planning_process() -> None:
    again = pickle.loads(pickle.dumps(PAINTER))
    np.testing.assert_array_equal(again.forward(PAINTER.home), PAINTER.forward(PAINTER.home))


def test_the_flange_must_be_named_where_several_links_end(tmp_path: Path) -> None:
    (tmp_path / "odd.urdf").write_text(ODD)
    with pytest.raises(BadModel, match=r"2 links without a child \(lamp, hand\)"):
        load_model(tmp_path / "odd.urdf")


@pytest.mark.parametrize(
    ("urdf", "problem"),
    [
        ("<robot", "no valid URDF"),
        ('<robot name="r"><link name="a"/></robot>', "no joint moves the link a"),
        (
            '<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="floating"><parent link="a"/>'
            '<child link="b"/></joint></robot>',
            "joint j moves in 6 directions",
        ),
    ],
)
def test_a_urdf_that_is_no_chain_is_refused(tmp_path: Path, urdf: str, problem: str) -> None:
    (tmp_path / "bad.urdf").write_text(urdf)
    with pytest.raises(BadModel, match=problem):
        load_model(tmp_path / "bad.urdf")


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("painter.urdf, flange: flange", "none.urdf, flange: flange", "found no file"),
        ("flange: flange", "flange: hook", "found no link 'hook', its links: base, carousel"),
        ("J1: {position: [-160, 160]", "J1: {position: [-165, 160]", "range of joint J1 is larger than that of axis_1"),
        ("J1: {position", "J1: {type: linear, position", "joint J1 is linear, in the URDF axis_1 is rotary"),
        ("link: 6", "link: 7", "capsule 6 is on link 7, allowed 0 to 6"),
    ],
)
def test_a_robot_file_that_contradicts_its_urdf_is_refused(tmp_path: Path, old: str, new: str, problem: str) -> None:
    text = (MODELS / "painter.yaml").read_text()
    assert old in text
    (tmp_path / "painter.urdf").write_text((MODELS / "painter.urdf").read_text())
    without_motors = text[: text.index("motors:")] + text[text.index("path:") :]
    (tmp_path / "robot.yaml").write_text(without_motors.replace(old, new))
    with pytest.raises(KinematicsError, match=problem):
        load_model(tmp_path / "robot.yaml")
