import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import BadInput, Reason, UnknownName, Unreachable
from tests.unit.six_axis_arm import arm

ARM = arm()
RNG = np.random.default_rng(7)
POSE = from_xyz_abc(np.array([1.5, 1.0, 2.0, 0.0, 0.0, 0.0]))


def test_the_solution_nearest_to_near_is_taken() -> None:
    for q in RNG.uniform(-3, 3, (50, 6)):
        np.testing.assert_allclose(ARM.solve(ARM.forward(q), near=q), q, atol=1e-9)


@pytest.mark.parametrize("branch", ["BACK/UP/NEGATIVE", "BACK", "BACK/NEGATIVE"])
def test_a_forced_branch_goes_before_the_nearest(branch: str) -> None:
    near = np.zeros(6)
    found = ARM.solve(POSE, near=near, branch=branch)
    solutions = ARM.inverse(POSE, near=near)
    slot = int(np.nanargmin(abs(solutions.joints - found).max(axis=-1)))
    assert set(branch.split("/")) <= set(solutions.branches[slot].split("/"))
    np.testing.assert_allclose(ARM.forward(found), POSE, atol=1e-9)


def test_preferred_joints_decide_first_and_near_breaks_the_ties() -> None:
    near = ARM.solve(POSE, branch="FRONT/DOWN/NEGATIVE")
    found = ARM.solve(POSE, near=near, prefer={"J1": np.radians(-140)})
    assert np.degrees(found[0]) == pytest.approx(-141.473956, abs=1e-5)
    backs = ARM.inverse(POSE, near=near).joints[4:]
    np.testing.assert_allclose(found, backs[np.argmin(((backs - near)[:, 1:] ** 2).sum(axis=-1))], atol=1e-9)


def test_a_preferred_joint_chooses_the_turn_too() -> None:
    wide = arm(position_deg=720)
    found = wide.solve(POSE, near=np.zeros(6), prefer={"J6": np.radians(400)})
    assert abs(np.degrees(found[5]) - 400) <= 180


def test_too_far_says_how_far() -> None:
    with pytest.raises(Unreachable, match=r"X 4000\.0 .* 1375\.4 mm too far") as caught:
        ARM.solve(from_xyz_abc(np.array([4.0, 0, 2.66, 0, 0, 0])), near=np.zeros(6))
    assert caught.value.reason is Reason.TOO_FAR
    assert caught.value.violation.excess_m == pytest.approx(3.609936 - 2.234557623, abs=1e-6)


def test_too_near_is_another_reason() -> None:
    at_joint_2 = np.array([0.4 + 0.244, 0.0, 1.33, 0, 0, 0])
    with pytest.raises(Unreachable, match="too near") as caught:
        ARM.solve(from_xyz_abc(at_joint_2), near=np.zeros(6), branch="FRONT")
    assert caught.value.reason is Reason.TOO_NEAR


def test_a_joint_limit_is_named_with_value_and_limits() -> None:
    narrow = arm(position_deg=100)
    q = np.radians([20, 10, 10, 0, 110, 0])
    with pytest.raises(Unreachable, match=r"joint J5 would need 110\.00 deg, allowed -100\.00 to 100\.00") as caught:
        narrow.solve(narrow.forward(q), near=q, branch="FRONT/UP/POSITIVE")
    assert (caught.value.reason, caught.value.joint) == (Reason.JOINT_LIMIT, "J5")
    assert caught.value.value == pytest.approx(np.radians(110))
    assert caught.value.limit == pytest.approx(tuple(np.radians([-100, 100])))


def test_unknown_names_are_refused_with_what_is_allowed() -> None:
    with pytest.raises(UnknownName, match="FRONT/UP/POSITIVE"):
        ARM.solve(POSE, branch="LEFT")
    with pytest.raises(UnknownName, match="J1, J2"):
        ARM.solve(POSE, prefer={"A1": 0.0})


def test_only_one_pose_is_solved_at_a_time() -> None:
    with pytest.raises(BadInput, match=r"\(4, 4\)"):
        ARM.solve(np.stack([POSE, POSE]))
