"""Paths of every family, and targets that robots with few joints cannot take."""

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import Reason, TrackError, Unreachable
from tests.unit.robot_families import FOUR_AXES, every_kind, off, random_joints, robot


@pytest.mark.parametrize("family", FOUR_AXES)
def test_a_tilted_target_is_refused_by_name(family: str) -> None:
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
def test_a_target_upside_down_is_refused_too(family: str) -> None:
    pose = robot(family).forward(random_joints(family, 1)[0]) @ from_xyz_abc(np.array([0, 0, 0, np.pi, 0, 0]))
    with pytest.raises(Unreachable, match="180"):
        robot(family).solve(pose)


def test_a_delta_without_a_fourth_axis_refuses_a_turned_target() -> None:
    model = robot("delta", 3)
    pose = model.forward(np.zeros(3)) @ from_xyz_abc(np.array([0, 0, 0, 0, 0, 0.1]))
    with pytest.raises(Unreachable, match=r"5\.7296 deg"):
        model.solve(pose)


# Paths


@every_kind
def test_a_joint_path_is_found_again_from_its_poses(family: str, joints: int | None) -> None:
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
    scara = robot("scara", turn_deg=1500)
    q = np.tile([0.3, 0.9, -0.05, 0.0], (600, 1))
    q[:, 3] = np.linspace(2.5, 20.0, 600)
    np.testing.assert_allclose(scara.track(scara.forward(q), start=q[0]), q, atol=1e-9)


@pytest.mark.parametrize("j5", [0.0, np.pi])
def test_the_cobots_singular_vector_comes_back_with_its_held_joint(j5: float) -> None:
    cobot, q = robot("cobot"), np.array([0.4, -0.6, 0.9, 0.3, j5, -0.5])
    found = cobot.solve(cobot.forward(q), near=q)
    np.testing.assert_allclose(cobot.forward(found), cobot.forward(q), atol=1e-12)
    assert off(cobot, found, q).max() < 1e-9


def test_a_tilted_pose_on_the_way_ends_a_path_by_name() -> None:
    scara = robot("scara")
    poses = scara.forward(np.tile([0.3, 0.9, -0.05, 0.4], (3, 1)))
    poses[2] = poses[2] @ from_xyz_abc(np.array([0, 0, 0, 0.2, 0, 0]))
    with pytest.raises(TrackError, match="deg away from those") as caught:
        scara.track(poses, start=np.array([0.3, 0.9, -0.05, 0.4]))
    assert (caught.value.index, caught.value.reason) == (2, Reason.TILTED)


def test_a_slide_at_its_limit_is_named_in_millimetres() -> None:
    scara = robot("scara")
    pose = scara.forward(np.array([0.3, 0.9, 0.7, 0.0]))
    with pytest.raises(Unreachable, match=r"joint J3 would need 700\.00 mm, allowed -600\.00 to 600\.00"):
        scara.solve(pose, branch="RIGHT")
