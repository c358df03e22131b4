"""Where points, frames and branches send a robot when a motion is planned."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config.points_file import JointPoint, Point, PosePoint
from cell.config.settings import PoseSettings
from cell.geometry import from_xyz_abc, inverse, to_xyz_abc
from cell.messages import FramePose
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import PlanFailed, Planned
from robot_agent.kinematics import SixAxis
from robot_agent.language import Names, Points, parse_program
from robot_agent.model.description import Mounted, Tool
from robot_agent.workspace import PlacedRobot
from tests.unit.six_axis_arm import arm, description

ARM = arm()
BASE = from_xyz_abc(np.array([1.0, -2.0, 0.5, 0.0, 0.0, math.radians(30.0)]))
HERE = "MJ J3=20 J5=40\n"
TARGET = "X=-356.2732 Y=-1052.5639 Z=3160.7179 A=0 B=-10 C=-108.7"
"""Of the textbook: eight branches reach it."""
FROM = "MJ J1=-100\n"


def frame(name: str, pose: np.ndarray, version: int = 1) -> FramePose:
    placed = PoseSettings.of(pose)
    return FramePose(name, version, None, placed.position_m, placed.quaternion_xyzw)


def run(
    program: str,
    frames: tuple[FramePose, ...] = (),
    points: dict[str, Point] | None = None,
    model: SixAxis = ARM,
    base: np.ndarray | None = None,
) -> tuple[list[Planned], PlanFailed | None]:
    base = np.eye(4) if base is None else base
    planner = Planner(PlacedRobot.at(model, PoseSettings.of(base)), 0.004)
    parsed = parse_program(program, "p", Names(model.joint_names, points=Points(points)))
    return dry_run(planner, parsed, 60.0, frames)


def end(program: str, *args: object, **kwargs: object) -> np.ndarray:
    """Joints at its end [deg]."""
    motions, failed = run(program, *args, **kwargs)  # type: ignore[arg-type]
    assert failed is None, failed.text
    return np.degrees(motions[-1].motion.q(np.array(motions[-1].motion.duration_s)))


def pose_at_end(program: str, *args: object, **kwargs: object) -> np.ndarray:
    model = kwargs.get("model", ARM)
    assert isinstance(model, SixAxis)
    return model.forward(np.radians(end(program, *args, **kwargs)))


def why(program: str, *args: object, **kwargs: object) -> str:
    _, failed = run(program, *args, **kwargs)  # type: ignore[arg-type]
    assert failed is not None
    return failed.text


def point_of(q_deg: list[float], in_frame: np.ndarray | None = None, **more: str) -> PosePoint:
    pose = ARM.forward(np.radians(q_deg))
    x, y, z, a, b, c = to_xyz_abc(pose if in_frame is None else inverse(in_frame) @ pose).tolist()
    return PosePoint((x, y, z), (a, b, c), **more)


# Branches: the vectors of the textbook, 3782-3800


def test_a_joint_move_to_a_pose_takes_the_branch_that_is_nearest_to_where_it_begins() -> None:
    np.testing.assert_allclose(end(FROM + f"MJ {TARGET}"), (-108.7, -20.0, -10.0, 0.0, 20.0, 0.0), atol=2e-4)


def test_named_joints_decide_first_and_the_others_break_ties() -> None:
    found = end(FROM + f"MJ {TARGET} J1=0")
    assert found[0] == pytest.approx(71.3, abs=2e-4)
    np.testing.assert_allclose(found[1:3], (-46.5115, -56.4242), atol=2e-4)
    assert abs(found[4]) == pytest.approx(67.0643, abs=2e-4)


def test_a_branch_may_be_named_on_the_line_and_by_the_point() -> None:
    x, y, z, a, b, c = -0.3562732, -1.0525639, 3.1607179, 0.0, math.radians(-10.0), math.radians(-108.7)
    on_back = PosePoint((x, y, z), (a, b, c), branch="BACK")
    points: dict[str, Point] = {"P1": on_back, "P2": replace(on_back, branch=None)}
    named = end(FROM + "MJ P2 BRANCH=BACK", points=points)
    np.testing.assert_allclose(named, end(FROM + "MJ P1", points=points), atol=1e-9)
    assert named[0] == pytest.approx(71.3, abs=2e-4)
    assert end(FROM + "MJ P1 BRANCH=front", points=points)[0] == pytest.approx(-108.7, abs=2e-4)


@pytest.mark.parametrize(
    ("move", "reason"),
    [
        (f"MJ {TARGET} BRANCH=SIDE", "line 2: branch: found 'SIDE', allowed "),
        ("MJ X=9000 Y=0 Z=0 A=0 B=0 C=0", "line 2: the TCP cannot be at X 9000.0 Y 0.0 Z 0.0 mm: "),
        ("MJ X=500 Z=table", "line 2: nobody has said where frame table is; see `cell frame show`"),
    ],
)
def test_what_cannot_be_reached_is_refused_by_line_with_the_reason(move: str, reason: str) -> None:
    assert why(FROM + move).startswith(reason)


def test_a_branch_outside_the_limits_is_refused_with_the_joint() -> None:
    narrow = arm(100.0)
    text = why("MJ J1=-90\n" + f"MJ {TARGET} BRANCH=FRONT", model=narrow)
    assert text.startswith("line 2: the TCP cannot be at X -356.3")
    assert "joint J1 would need -108.70 deg, allowed -100.00 to 100.00" in text


# Points


def test_a_line_to_joints_ends_in_their_pose_on_the_branch_that_it_is_on() -> None:
    up = JointPoint(tuple(np.radians([20.0, 5.0, 15.0, 10.0, 55.0, 5.0])))
    np.testing.assert_allclose(end(HERE + "ML P=up F=9999", points={"up": up}), np.degrees(up.joints), atol=1e-5)
    np.testing.assert_allclose(end(HERE + "MJ P=up", points={"up": up}), np.degrees(up.joints), atol=1e-9)


def test_a_point_of_a_tool_is_where_its_tcp_comes() -> None:
    offset = from_xyz_abc(np.array([0.02, 0.03, 0.2, 0.1, 0.2, 0.3]))
    tool = Tool("gripper", offset, 1.0, (0.0, 0.0, 0.0), np.eye(3), ())
    model = SixAxis(replace(description(), tools={"gripper": tool}, mounted=Mounted(("gripper",))))
    q_deg = [10.0, 5.0, 15.0, 10.0, 55.0, 5.0]
    x, y, z, a, b, c = to_xyz_abc(model.forward(np.radians(q_deg))).tolist()
    points: dict[str, Point] = {"P1": PosePoint((x, y, z), (a, b, c), tool="gripper")}
    np.testing.assert_allclose(end(HERE + "ML P1 F=9999", points=points, model=model), q_deg, atol=1e-5)
    assert "point P1 was taught with tool gripper, mounted is none" in why(HERE + "ML P1 F=9999", points=points)
    points["P1"] = PosePoint((x, y, z), (a, b, c))
    assert "taught without a tool, mounted is gripper" in why(HERE + "ML P1 F=9999", points=points, model=model)


# Frames


def test_coordinates_are_meant_in_the_frame_and_those_that_are_not_named_keep_what_they_are_there() -> None:
    table = from_xyz_abc(np.array([2.2, -2.2, 1.0, 0.1, -0.2, 0.7]))
    frames = (frame("table", table),)
    before = inverse(table) @ BASE @ pose_at_end(HERE)
    after = inverse(table) @ BASE @ pose_at_end(HERE + "Z=table\nML X=150 F=9999", frames, base=BASE)
    before[0, 3] = 0.15
    np.testing.assert_allclose(after, before, atol=1e-9)
    joints = inverse(table) @ BASE @ pose_at_end(HERE + "MJ X=150 Z=table", frames, base=BASE)
    np.testing.assert_allclose(joints, before, atol=1e-9)


def test_a_point_is_where_it_was_taught_and_moves_with_its_frame() -> None:
    at = [10.0, 5.0, 15.0, 10.0, 55.0, 5.0]
    table = from_xyz_abc(np.array([2.2, -0.2, 1.0, 0.1, -0.2, 0.7]))
    points: dict[str, Point] = {"pick": point_of(at, table, frame="table"), "free": point_of(at, table)}
    np.testing.assert_allclose(end(HERE + "ML P=pick F=9999", (frame("table", table),), points), at, atol=1e-5)
    np.testing.assert_allclose(end(HERE + "Z=table\nML P=free F=9999", (frame("table", table),), points), at, atol=1e-5)
    moved = table.copy()
    moved[:3, 3] += [0.05, 0.0, 0.01]
    there = pose_at_end(HERE + "ML P=pick F=9999", (frame("table", moved),), points)
    np.testing.assert_allclose(there[:3, 3] - ARM.forward(np.radians(at))[:3, 3], [0.05, 0.0, 0.01], atol=1e-9)


AT = ARM.forward(np.radians([0.0, 0.0, 20.0, 0.0, 40.0, 0.0]))
"""Where the paths begin; the frame is upright there."""
TO = "MJ X=0 Y=0 Z=0 A={:.9f} B={:.9f} C={:.9f}\n".format(*np.degrees(to_xyz_abc(AT)[3:]))
PATHS = {
    "lines with round edges": "ML X=80 R=20 F=100\nML Y=90 A=5 B=70 C=10",
    "arcs": "MC QX=50 QY=50 X=100 Y=0 F=9999\nMC QX=50 QY=-50 X=0 Y=0 H=200",
    "splines": "MS X=50 Y=40 F=9999\nMS X=100 Y=0\nMS X=150 Y=40 A=-5 B=50 C=10\nML X=200",
    "joint moves": "MJ X=50 Y=50 Z=20\nML X=0 F=9999",
}


def seen_from(pose_base_frame: np.ndarray, path: str) -> np.ndarray:
    """Places `(k, 3)` of the flange on the path, as the frame sees them."""
    motions, failed = run(HERE + "Z=table\n" + TO + path, (frame("table", BASE @ pose_base_frame),), base=BASE)
    assert failed is None, failed.text
    return np.concatenate([_path(each, pose_base_frame) for each in motions[1:]])


@settings(max_examples=4, deadline=None)
@given(
    shift=st.tuples(*[st.floats(-0.1, 0.1)] * 3),
    turn=st.tuples(*[st.sampled_from([0.0, -0.15, 0.2])] * 2, st.floats(-0.6, 0.6)),
)
@pytest.mark.parametrize("path", PATHS.values(), ids=PATHS)
def test_a_program_in_a_frame_that_is_moved_goes_the_same_path_moved(
    path: str, shift: tuple[float, ...], turn: tuple[float, ...]
) -> None:
    """The oracle is the frame itself: seen from it, the flange is at the same places wherever it is."""
    here = np.eye(4)
    here[:3, 3] = AT[:3, 3]
    first, moved = (seen_from(pose, path) for pose in (here, here @ from_xyz_abc(np.array([*shift, *turn]))))
    if "MJ" not in path:
        assert max(_distance(place, moved) for place in first[:: max(len(first) // 40, 1)]) < 1e-3
    np.testing.assert_allclose(moved[-1], first[-1], atol=1e-8)


def _path(planned: Planned, pose_base_frame: np.ndarray) -> np.ndarray:
    """Places `(k, 3)` of the flange in the frame, of what is programmed in it."""
    in_frame = np.array(planned.lines) > 4
    taus = np.linspace(0.0, planned.motion.duration_s, 1000)
    taus = taus[in_frame[planned.motion.move_at(taus)]]
    poses = inverse(pose_base_frame) @ ARM.forward(planned.motion.q(taus))
    return poses[:, :3, 3]


def _distance(place: np.ndarray, path: np.ndarray) -> float:
    return float(np.linalg.norm(path - place, axis=1).min())
