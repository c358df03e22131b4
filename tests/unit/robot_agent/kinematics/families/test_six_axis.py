import numpy as np
import pinocchio as pin
import pytest

from cell.geometry import NotAPose, WrongShape, from_xyz_abc, inverse, to_xyz_abc
from robot_agent.kinematics import BadInput, BadModel, SixAxis, Solutions
from tests.unit.six_axis_arm import VECTORS, arm, description

ARM = arm()
RNG = np.random.default_rng(6)
JOINTS = RNG.uniform(-np.pi, np.pi, (10_000, 6))


def pose_of(mm_deg: list[float]) -> np.ndarray:
    return from_xyz_abc(np.append(np.array(mm_deg[:3]) / 1000, np.radians(mm_deg[3:])))


def mm_deg_of(pose: np.ndarray) -> np.ndarray:
    x, y, z, *abc = to_xyz_abc(pose)
    return np.array([x * 1000, y * 1000, z * 1000, *np.degrees(abc)])


def assert_same_angles(found_rad: np.ndarray, expected_deg: list[float], tolerance_deg: float) -> None:
    off = np.degrees(found_rad) - expected_deg
    np.testing.assert_allclose(off - 360 * np.rint(off / 360), 0, atol=tolerance_deg)


def joints_of(solutions: Solutions, branch: str) -> np.ndarray:
    slot = solutions.branches.index(branch)
    assert solutions.valid[slot]
    return solutions.joints[slot]


def pinocchio_arm() -> pin.Model:
    """The same arm, joint by joint, built from the link table alone."""
    g = {name: value / 1000 for name, value in VECTORS["model"].items()}
    table = [
        (pin.JointModelRZ, (0, 0, g["a1z"])),
        (pin.JointModelRY, (g["a2x"], 0, g["a2z"])),
        (pin.JointModelRY, (0, 0, g["a3z"])),
        (pin.JointModelRX, (g["a4x"], 0, g["a4z"])),
        (pin.JointModelRY, (g["a5x"], 0, 0)),
        (pin.JointModelRX, (g["a6x"], 0, 0)),
    ]
    model = pin.Model()
    parent = 0
    for i, (kind, offset) in enumerate(table):
        parent = model.addJoint(parent, kind(), pin.SE3(np.eye(3), np.array(offset, dtype=float)), f"j{i}")
    return model


PINOCCHIO = pinocchio_arm()
PINOCCHIO_DATA = PINOCCHIO.createData()


# Forward


@pytest.mark.parametrize("case", VECTORS["forward"], ids=lambda case: case["id"])
def test_forward_reproduces_the_textbook(case: dict) -> None:
    found = mm_deg_of(ARM.forward(np.radians(case["joints_deg"])))
    np.testing.assert_allclose(found, case["derived"], atol=1e-5)
    np.testing.assert_allclose(found, case["printed"], atol=0.051)


@pytest.mark.parametrize("case", VECTORS["frames"], ids=lambda case: case["id"])
def test_base_and_tool_frames_go_around_the_flange(case: dict) -> None:
    base, tool = pose_of(case["base_mm_deg"]), pose_of(case["tool_mm_deg"])
    tcp = base @ ARM.forward(np.radians(case["joints_deg"])) @ tool
    np.testing.assert_allclose(mm_deg_of(tcp), case["tcp_mm_deg"], atol=1e-5)
    target = inverse(base) @ pose_of(case["tcp_mm_deg"]) @ inverse(tool)
    assert_same_angles(joints_of(ARM.inverse(target), "FRONT/UP/POSITIVE"), case["joints_deg"], 1e-5)


def test_every_link_agrees_with_pinocchio() -> None:
    links = ARM.links(JOINTS)
    np.testing.assert_array_equal(links[:, 0], np.broadcast_to(np.eye(4), (len(JOINTS), 4, 4)))
    for q, frames in zip(JOINTS, links, strict=True):
        pin.forwardKinematics(PINOCCHIO, PINOCCHIO_DATA, q)
        for i in (2, 4, 6):
            placement = PINOCCHIO_DATA.oMi[i]
            assert abs(frames[i, :3, 3] - placement.translation).max() < 1e-9
            assert abs(frames[i, :3, :3] - placement.rotation).max() < 1e-9


def test_jacobian_agrees_with_pinocchio() -> None:
    jacobians = ARM.jacobian(JOINTS[:500])
    for q, jacobian in zip(JOINTS, jacobians, strict=False):
        pin.computeJointJacobians(PINOCCHIO, PINOCCHIO_DATA, q)
        expected = pin.getJointJacobian(PINOCCHIO, PINOCCHIO_DATA, 6, pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(jacobian, expected, atol=1e-9)


def test_all_answers_keep_the_leading_dimensions() -> None:
    q = JOINTS[:12].reshape(3, 4, 6)
    assert ARM.forward(q).shape == (3, 4, 4, 4)
    assert ARM.links(q[0, 0]).shape == (7, 4, 4)
    assert ARM.jacobian(q).shape == (3, 4, 6, 6)
    assert ARM.capsules(q).shape == (3, 4, 7, 2, 3)
    solutions = ARM.inverse(ARM.forward(q), near=q)
    assert solutions.joints.shape == (3, 4, 8, 6)
    assert solutions.valid.shape == solutions.in_limits.shape == solutions.singular.shape == (3, 4, 8)


def test_capsules_move_with_their_links() -> None:
    links, capsules = ARM.links(JOINTS[:50]), ARM.capsules(JOINTS[:50])
    for i, capsule in enumerate(ARM.description.capsules):
        for end, local in enumerate((capsule.start_m, capsule.end_m)):
            expected = (links[:, capsule.link] @ np.append(local, 1.0))[:, :3]
            np.testing.assert_allclose(capsules[:, i, end], expected, atol=1e-14)


def test_no_capsule_is_ever_beyond_the_reach() -> None:
    farthest = (np.linalg.norm(ARM.capsules(JOINTS), axis=-1).max(axis=-1) + ARM.capsule_radii).max()
    assert farthest <= ARM.reach_m
    assert farthest > 0.85 * ARM.reach_m


# Inverse


@pytest.mark.parametrize("case", VECTORS["inverse"], ids=lambda case: case["id"])
def test_inverse_reproduces_every_branch_of_the_textbook(case: dict) -> None:
    solutions = ARM.inverse(pose_of(case["pose_mm_deg"]))
    for branch, expected in case["branches"].items():
        assert_same_angles(joints_of(solutions, branch), expected, 2e-6)
    assert_same_angles(joints_of(solutions, "FRONT/UP/POSITIVE"), case["printed"], 0.051)
    for side, detail in case["unreachable"].items():
        slots = [branch.startswith(side) for branch in solutions.branches]
        assert not solutions.valid[slots].any()
        too_far_mm = detail["rho_mm"] - 2234.557623
        np.testing.assert_allclose(solutions.excess_m[slots] * 1000, too_far_mm, atol=1e-3)


@pytest.mark.parametrize("case", VECTORS["reach"], ids=lambda case: case["id"])
def test_the_border_of_the_reach_is_the_textbooks(case: dict) -> None:
    solutions = ARM.inverse(pose_of(case["pose_mm_deg"]))
    if "rho_mm" in case:
        assert not solutions.valid.any()
        assert solutions.excess_m[0] * 1000 == pytest.approx(case["rho_mm"] - 2234.557623, abs=1e-3)
    else:
        found = [
            q
            for q in solutions.joints[solutions.valid]
            if np.degrees(abs(q - np.radians(case["joints_deg"]))).max() < 1e-3
        ]
        assert len(found) == 1


def test_every_solution_reproduces_the_pose_and_the_original_joints_are_among_them() -> None:
    poses = ARM.forward(JOINTS)
    solutions = ARM.inverse(poses, near=JOINTS)
    back = ARM.forward(solutions.joints[solutions.valid])
    expected = np.broadcast_to(poses[:, None], (*solutions.valid.shape, 4, 4))[solutions.valid]
    assert abs(back - expected).max() < 1e-9
    away = np.where(solutions.valid[..., None], abs(solutions.joints - JOINTS[:, None]), np.inf).max(axis=-1)
    assert away.min(axis=-1).max() < 1e-9
    assert np.isnan(solutions.joints[~solutions.valid]).all()
    assert solutions.complete


def test_no_branch_appears_twice() -> None:
    joints = ARM.inverse(ARM.forward(JOINTS)).joints
    away = abs(joints[:, :, None] - joints[:, None])
    away = np.minimum(away, abs(away - 2 * np.pi)).max(axis=-1)
    away[:, np.arange(8), np.arange(8)] = np.inf
    assert np.nanmin(away) > 1e-6


def test_branch_names_say_what_the_arm_looks_like() -> None:
    poses = ARM.forward(JOINTS[:2000])
    solutions = ARM.inverse(poses)
    links = ARM.links(np.nan_to_num(solutions.joints))
    shoulder, elbow, wrist = links[..., 2, :3, 3], links[..., 3, :3, 3], links[..., 5, :3, 3]
    for slot, name in enumerate(solutions.branches):
        side, bend, sign = name.split("/")
        valid = solutions.valid[:, slot]
        ahead = (links[:, slot, 1, :3, 0] * wrist[:, slot]).sum(axis=-1)[valid]
        assert ((ahead > 0) == (side == "FRONT")).all()
        line, bone = (wrist - shoulder)[valid, slot], (elbow - shoulder)[valid, slot]
        # In the arm's vertical plane, seen along the line to the wrist: is the elbow on its upper side?
        plane_x = links[valid, slot, 1, :3, 0]
        flat = (line * plane_x).sum(axis=-1)
        above = (flat * bone[:, 2] - (bone * plane_x).sum(axis=-1) * line[:, 2]) * (1 if side == "FRONT" else -1)
        assert ((above > 0) == (bend == "UP")).all()
        assert ((solutions.joints[valid, slot, 4] > 0) == (sign == "POSITIVE")).all()


# Singular poses


@pytest.mark.parametrize("case", VECTORS["singular"][:2], ids=lambda case: case["id"])
def test_with_the_wrist_on_axis_1_joint_1_holds_its_value(case: dict) -> None:
    held = np.radians(case["held_deg"])
    solutions = ARM.inverse(pose_of(case["pose_mm_deg"]), near=held)
    for branch, expected in case["branches"].items():
        assert_same_angles(joints_of(solutions, branch), expected, 2e-6)
    assert solutions.singular[solutions.valid].all()
    np.testing.assert_array_equal(solutions.joints[solutions.valid][:, 0], held[0])


@pytest.mark.parametrize("case", VECTORS["singular"][2:], ids=lambda case: case["id"])
@pytest.mark.parametrize("shift_deg", [0.0, 40.0])
def test_with_a_straight_wrist_joint_4_holds_its_value_and_joint_6_follows(case: dict, shift_deg: float) -> None:
    q = np.array(case["joints_rad"])
    pose = ARM.forward(q)
    held = np.radians(case["held_deg"]) + np.radians([0, 0, 0, shift_deg, 0, 0])
    solutions = ARM.inverse(pose, near=held)
    found = joints_of(solutions, "FRONT/UP/POSITIVE")
    assert found[3] == pytest.approx(np.radians(case["j4_deg"] + shift_deg), abs=1e-9)
    follows_deg = case["j6_deg"] - shift_deg * np.cos(q[4])
    assert_same_angles(found[5], follows_deg, 1e-5)
    np.testing.assert_allclose(ARM.forward(found), pose, atol=1e-9)


@pytest.mark.parametrize("off", [0.0, 1e-13, 1e-11, 1e-10, 1e-9, 1e-7, 1e-4])
@pytest.mark.parametrize("special", ["wrist", "wrist 180", "shoulder", "stretched", "folded"])
def test_at_and_near_singular_poses_the_pose_is_reproduced_and_nothing_is_nan(off: float, special: str) -> None:
    q = RNG.uniform(-1.0, 1.0, (200, 6))
    delta = np.arctan2(0.766 + 0.345, 0.230)
    if special.startswith("wrist"):
        q[:, 4] = (np.pi if special == "wrist 180" else 0.0) + off
    elif special == "shoulder":
        q[:] = ARM.inverse(from_xyz_abc(np.array([off, 0, 2.5, 0, np.pi / 2, 0]))).joints[0]
    else:
        q[:, 2] = (np.pi if special == "folded" else 0.0) - delta + off
    poses = ARM.forward(q)
    solutions = ARM.inverse(poses, near=q)
    assert solutions.valid.any(axis=-1).all()
    back = ARM.forward(solutions.joints[solutions.valid])
    np.testing.assert_allclose(back, np.broadcast_to(poses[:, None], (200, 8, 4, 4))[solutions.valid], atol=1e-9)


# Turns and limits


def test_joints_come_at_the_turn_nearest_to_near() -> None:
    wide = arm(position_deg=720)
    near = RNG.uniform(-9, 9, (500, 6))
    solutions = wide.inverse(wide.forward(near), near=near)
    away = abs(solutions.joints - near[:, None])
    assert np.nanmax(away) <= np.pi + 1e-9
    assert np.nanmin(away.max(axis=-1), axis=1).max() < 1e-9


def test_a_turn_inside_the_limits_goes_before_the_nearest_one() -> None:
    narrow = arm(position_deg=185)
    near = np.radians([183, -20, 30, 0, 40, 0])
    beyond = near + np.radians([4, 0, 0, 0, 0, 0])
    found = narrow.solve(narrow.forward(beyond), near=near, branch="FRONT/UP/POSITIVE")
    assert_same_angles(found, np.degrees(beyond), 1e-9)
    assert np.degrees(found[0]) == pytest.approx(-173)


def test_in_limits_tells_which_solutions_the_robot_may_take() -> None:
    narrow = arm(position_deg=100)
    solutions = narrow.inverse(narrow.forward(JOINTS[:1000]))
    lower, upper = narrow.limits.position.T
    expected = (solutions.joints >= lower).all(axis=-1) & (solutions.joints <= upper).all(axis=-1)
    np.testing.assert_array_equal(solutions.in_limits, expected)


# What is refused


def test_a_pose_that_is_none_is_refused() -> None:
    poses = ARM.forward(JOINTS[:3])
    poses[1, 0, 0] = np.nan
    with pytest.raises(NotAPose, match=r"poses\[1\]"):
        ARM.inverse(poses)
    with pytest.raises(WrongShape):
        ARM.inverse(np.zeros(6))


@pytest.mark.parametrize("q", [np.zeros(5), np.full(6, np.nan), np.zeros((6, 1))])
def test_joints_that_are_none_are_refused(q: np.ndarray) -> None:
    with pytest.raises(BadInput):
        ARM.forward(q)
    with pytest.raises(BadInput):
        ARM.inverse(np.eye(4), near=q)


def test_near_must_be_one_set_of_joints_or_one_per_pose() -> None:
    with pytest.raises(BadInput, match=r"\(3, 6\)"):
        ARM.inverse(ARM.forward(JOINTS[:3]), near=JOINTS[:2])


@pytest.mark.parametrize(
    ("geometry", "problem"),
    [({"a3z": 0.0}, "longer than zero"), ({"a4y": 0.1}, "a4y is unknown")],
)
def test_a_geometry_of_another_robot_is_refused(geometry: dict[str, float], problem: str) -> None:
    with pytest.raises(BadModel, match=problem):
        SixAxis(description(**geometry))
