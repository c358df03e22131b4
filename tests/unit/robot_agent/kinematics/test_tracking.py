import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import BadInput, Reason, TrackError
from tests.unit.six_axis_arm import arm

ARM = arm()


def straight(
    start_mm: tuple[float, ...], end_mm: tuple[float, ...], count: int = 400, b_deg: float = 90.0
) -> np.ndarray:
    """Poses along a straight line with one orientation."""
    positions = np.linspace(start_mm, end_mm, count) / 1000
    return from_xyz_abc(np.hstack([positions, np.tile([0.0, np.radians(b_deg), 0.0], (count, 1))]))


@given(seed=st.integers(0, 10_000))
def test_a_joint_path_is_found_again_from_its_poses(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start = rng.uniform(-1.2, 1.2, 6) * np.array([1, 0.4, 0.4, 1, 1, 1])
    start[4] = rng.choice([-1, 1]) * rng.uniform(0.3, 1.2)
    end = start + rng.uniform(-0.3, 0.3, 6) * np.array([1, 1, 1, 1, 0.9, 1])
    q = start + np.linspace(0, 1, 200)[:, None] * (end - start)
    wrist = ARM.links(q)[:, 5, :3, 3]
    assume((wrist[:, 0] * np.cos(q[:, 0]) + wrist[:, 1] * np.sin(q[:, 0])).min() > 0.01)  # in one branch all along
    np.testing.assert_allclose(ARM.track(ARM.forward(q), start=start), q, atol=1e-8)


def test_turns_go_on_beyond_half_a_turn() -> None:
    wide = arm(position_deg=720)
    q = np.tile([0.1, 0.2, -0.3, 0.0, 0.8, 0.0], (800, 1))
    q[:, 5] = np.linspace(3.0, 11.0, 800)
    q[:, 0] = np.linspace(2.9, -7.0, 800)
    np.testing.assert_allclose(wide.track(wide.forward(q), start=q[0]), q, atol=1e-8)


@pytest.mark.parametrize("branch", ["FRONT/UP/POSITIVE", "FRONT/UP/NEGATIVE", "FRONT/DOWN/POSITIVE"])
def test_the_branch_of_the_start_is_kept(branch: str) -> None:
    wide = arm(position_deg=720)
    poses = straight((1400, -500, 1500), (1400, 500, 1500))
    joints = wide.track(poses, start=wide.solve(poses[0], branch=branch))
    expected = wide.inverse(poses, near=joints).joints[:, ARM.branches.index(branch)]
    np.testing.assert_allclose(joints, expected, atol=1e-9)
    np.testing.assert_allclose(ARM.forward(joints), poses, atol=1e-9)


def test_a_path_that_starts_with_a_straight_wrist_bends_it_to_either_side() -> None:
    for sign in (1, -1):
        q = np.zeros((100, 6))
        q[:, 4] = sign * np.linspace(0, 0.5, 100)
        np.testing.assert_allclose(ARM.track(ARM.forward(q), start=q[0]), q, atol=1e-8)


def test_a_free_joint_on_the_way_keeps_its_last_value() -> None:
    q = np.tile([0.1, 0.2, -0.3, 0.7, 0.5, -0.4], (301, 1))
    q[:, 4] = 0.5 * (1 - np.sin(np.linspace(0, np.pi, 301)))
    assert q[150, 4] == 0
    np.testing.assert_allclose(ARM.track(ARM.forward(q), start=q[0]), q, atol=1e-7)


def test_a_path_that_leaves_the_reach_names_its_first_pose_outside() -> None:
    poses = straight((1800, 0, 1330), (3200, 0, 1330), b_deg=0.0)
    reachable = ARM.inverse(poses).valid[:, 0]
    with pytest.raises(TrackError, match="too far") as caught:
        ARM.track(poses, start=ARM.solve(poses[0], branch="FRONT/UP/POSITIVE"))
    assert (caught.value.index, caught.value.reason) == (int(np.argmin(reachable)), Reason.TOO_FAR)


def test_a_path_that_comes_too_near_says_so() -> None:
    poses = straight((1800, 0, 1330), (644, 0, 1330), b_deg=0.0)
    with pytest.raises(TrackError, match="too near") as caught:
        ARM.track(poses, start=ARM.solve(poses[0], branch="FRONT/UP/POSITIVE"))
    assert caught.value.reason is Reason.TOO_NEAR


def test_a_path_that_starts_out_of_reach_fails_at_its_first_pose() -> None:
    poses = straight((4000, 0, 1330), (1800, 0, 1330))
    with pytest.raises(TrackError) as caught:
        ARM.track(poses, start=np.zeros(6))
    assert caught.value.index == 0


def test_a_joint_limit_on_the_way_is_named() -> None:
    narrow = arm(position_deg=100)
    q = np.tile([0.1, 0.2, -0.3, 0.0, 0.8, 0.0], (200, 1))
    q[:, 5] = np.radians(np.linspace(0, 120, 200))
    with pytest.raises(TrackError, match=r"joint J6 would need 100\.\d+ deg, allowed -100\.00 to 100\.00") as caught:
        narrow.track(narrow.forward(q), start=q[0])
    assert caught.value.index == int(np.argmax(q[:, 5] > np.radians(100)))
    assert (caught.value.reason, caught.value.joint) == (Reason.JOINT_LIMIT, "J6")


def test_a_path_through_the_straight_wrist_is_a_branch_change() -> None:
    q = np.tile([0.1, 0.2, -0.3, 0.7, 0.5, -0.4], (300, 1))
    q[:, 4] = np.linspace(0.5, -0.5, 300)
    with pytest.raises(TrackError, match="near a singularity") as caught:
        ARM.track(ARM.forward(q), start=q[0])
    assert (caught.value.index, caught.value.reason) == (150, Reason.BRANCH_CHANGE)
    assert caught.value.joint in ("J4", "J6")


def test_a_single_pose_is_a_path() -> None:
    q = np.array([0.1, 0.2, -0.3, 0.7, 0.5, -0.4])
    np.testing.assert_allclose(ARM.track(ARM.forward(q[None]), start=q), q[None], atol=1e-9)


def test_an_empty_path_is_refused() -> None:
    with pytest.raises(BadInput, match="m > 0"):
        ARM.track(np.empty((0, 4, 4)), start=np.zeros(6))
