"""One pose at a time: the plain floats of `six_axis_single` against the arrays of `six_axis_inverse`."""

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import SixAxis, Solutions
from tests.unit.six_axis_arm import arm, description

ARM = arm()
RNG = np.random.default_rng(7)
COUNT = 600


def assert_same(one: Solutions, many: Solutions, i: int) -> None:
    np.testing.assert_allclose(one.joints, many.joints[i], atol=1e-9)
    for name in ("valid", "in_limits", "singular"):
        np.testing.assert_array_equal(getattr(one, name), getattr(many, name)[i])
    np.testing.assert_allclose(one.excess_m, many.excess_m[i], atol=1e-12)


@pytest.mark.parametrize("position_deg", [60.0, 180.0, 500.0, 800.0])
def test_one_pose_has_the_same_solutions_as_many(position_deg: float) -> None:
    model = arm(position_deg=position_deg)
    poses = model.forward(RNG.uniform(-np.pi, np.pi, (COUNT, 6)))
    poses[::7, :3, 3] *= 1.5
    near = RNG.uniform(-14, 14, (COUNT, 6))
    many = model.inverse(poses, near=near)
    for i in range(COUNT):
        assert_same(model.inverse(poses[i], near=near[i]), many, i)


@pytest.mark.parametrize("j5", [0.0, np.pi])
def test_one_singular_pose_has_the_same_solutions_as_many(j5: float) -> None:
    q = RNG.uniform(-1, 1, (50, 6))
    q[:, 4] = j5
    poses = np.concatenate([ARM.forward(q), from_xyz_abc(np.array([[0, 0, 2.5, 0, np.pi / 2, 0]]))])
    near = np.concatenate([q, q[:1]])
    many = ARM.inverse(poses, near=near)
    for i, pose in enumerate(poses):
        one = ARM.inverse(pose, near=near[i])
        np.testing.assert_array_equal(one.singular, many.singular[i])
        np.testing.assert_allclose(
            ARM.forward(one.joints[one.valid]), np.tile(pose, (one.valid.sum(), 1, 1)), atol=1e-9
        )


@pytest.mark.parametrize("off", [0.0, 1e-14, 1e-12, 1e-11, 1e-9, 1e-6])
def test_a_wrist_folded_onto_joint_2_is_reached_one_pose_at_a_time_and_with_others(off: float) -> None:
    model = SixAxis(description(a3z=1.0, a4x=0.8, a4z=0.6, a5x=0.0))
    q = RNG.uniform(-1, 1, (20, 6))
    q[:, 2] = np.pi - np.arctan2(0.8, 0.6) + off
    poses = model.forward(q)
    many, ones = model.inverse(poses), [model.inverse(pose) for pose in poses]
    for i, pose in enumerate(poses):
        for joints in (many.joints[i][many.valid[i]], ones[i].joints[ones[i].valid]):
            assert len(joints) >= 4
            np.testing.assert_allclose(model.forward(joints), np.tile(pose, (len(joints), 1, 1)), rtol=0, atol=1e-9)


def test_answers_for_one_pose_may_be_changed_without_touching_later_ones() -> None:
    pose = ARM.forward(np.full(6, 0.3))
    first = ARM.solve(pose, near=np.full(6, 0.3))
    first += 1.0
    np.testing.assert_allclose(ARM.solve(pose, near=np.full(6, 0.3)), 0.3, atol=1e-9)
