"""Worked examples of path geometry: joint moves, circles, curves, turns, and how long they are."""

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from cell.geometry.quaternion import from_matrix
from robot_agent.paths import Arc, JointMove, Line, LineGeometry, Sequence
from robot_agent.paths.arc import CircleGeometry
from robot_agent.paths.curves import Circle, bezier, joining
from robot_agent.paths.spline import control_points
from robot_agent.trajectory import Limits, Motion, move_lengths, plan
from tests.unit.repository import vectors
from tests.unit.six_axis_arm import arm, description

VECTORS = vectors("paths.json")
ARM = arm(position_deg=720.0)
LIMITS = Limits.of(description())
WORK = np.radians([0.0, -20.0, 40.0, 0.0, 60.0, 0.0])


def pose(*xyz_abc: float) -> np.ndarray:
    """From mm and degrees."""
    return from_xyz_abc(np.array([*np.array(xyz_abc[:3]) / 1000.0, *np.radians(xyz_abc[3:])]))


def planned(*moves: JointMove | Line | Arc, start: np.ndarray) -> Motion:
    return plan(ARM, Sequence(moves), LIMITS, start=start)


def test_a_full_turn_of_j1_leads_round_the_base_and_back_to_the_same_pose() -> None:
    move = JointMove(np.array([2.0 * np.pi, 0, 0, 0, 0, 0]), 1.0, 1)
    for share, *place, c_deg in VECTORS["full_turn"]:
        found = ARM.forward(move.joints(np.zeros(6), np.array(share)))
        np.testing.assert_allclose(1000.0 * found[:3, 3], place, atol=1e-4)
        np.testing.assert_allclose(found[:3, :3], pose(0, 0, 0, 0, 0, c_deg)[:3, :3], atol=1e-9)
    assert LineGeometry.between(ARM.forward(np.zeros(6)), ARM.forward(move.target)).is_empty


def test_a_joint_move_of_j1_is_an_arc_of_the_flange() -> None:
    move = JointMove(np.radians([80.0, 0, 0, 0, 0, 0]), 1.0, 1)
    for share, *place in VECTORS["j1_to_80"]:
        found = ARM.forward(move.joints(np.zeros(6), np.array(share)))
        np.testing.assert_allclose(1000.0 * found[:2, 3], place, atol=1e-5)


@pytest.mark.parametrize(("first", "last", "way_mm", "way_deg"), VECTORS["joint_move_lengths"])
def test_joint_moves_are_as_long_as_worked(first: float, last: float, way_mm: float, way_deg: float) -> None:
    start, target = (np.radians([value, 0, 0, 0, 0, 0]) for value in (first, last))
    ((way, rotation, joints),) = move_lengths(planned(JointMove(target, 1.0, 1), start=start))
    assert 1000.0 * way == pytest.approx(way_mm, abs=1e-4)
    assert np.degrees([rotation, joints]) == pytest.approx([way_deg, way_deg])


@pytest.mark.parametrize(("first", "last", "chords", "way_mm"), VECTORS["joint_move_chords"])
def test_chords_of_a_joint_move_are_as_long_as_worked(first: float, last: float, chords: int, way_mm: float) -> None:
    move = JointMove(np.radians([last, 0, 0, 0, 0, 0]), 1.0, 1)
    poses = ARM.forward(move.joints(np.radians([first, 0, 0, 0, 0, 0]), np.linspace(0.0, 1.0, chords + 1)))
    found = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1).sum()
    assert 1000.0 * found == pytest.approx(way_mm, abs=1e-4)


def on_the_line(worked: dict, y: float) -> np.ndarray:
    near = np.radians([-5.0, 0.0, 0.0, 90.0 if y < 0.0 else -90.0, 5.0, -90.0 if y < 0.0 else 90.0])
    return np.degrees(ARM.solve(pose(worked["x"], y, worked["z"], 0, 0, 0), near=near))


def test_through_the_straight_wrist_j4_would_have_to_jump() -> None:
    worked = VECTORS["straight_wrist"]
    for y, joints in worked["ends"]:
        np.testing.assert_allclose(on_the_line(worked, y), joints, atol=1e-4)


def test_near_the_straight_wrist_j4_turns_as_fast_as_worked() -> None:
    worked, h = VECTORS["near_the_straight_wrist"], 1e-3
    joints = np.array([on_the_line(worked, y) for y in (-worked["y"], -h, h, worked["y"])])
    assert joints[1:3, 4] == pytest.approx([worked["j5"]] * 2, abs=1e-4)
    assert [joints[0, 3], -joints[3, 3]] == pytest.approx([worked["j4"]] * 2, abs=5e-3)
    rate = abs((joints[2, 3] - joints[1, 3] + 180.0) % 360.0 - 180.0) / (2.0 * h)
    assert rate == pytest.approx(worked["j4_deg_per_mm"], rel=1e-5)
    assert rate * worked["speed"] == pytest.approx(worked["j4_deg_s"], rel=2e-4)


def test_a_joint_move_in_mm_per_second_takes_its_way_at_that_speed() -> None:
    worked = VECTORS["joint_move_in_mm_s"]
    start, target = (np.radians([worked[end], 0, 0, 0, 0, 0]) for end in ("from", "to"))
    motion = planned(JointMove(target, 1.0, 1, speed_m_s=worked["speed"] / 1000.0), start=start)
    assert motion.tcp_speed(np.array(motion.duration_s / 2.0)) == pytest.approx(worked["speed"] / 1000.0, rel=1e-2)
    assert worked["time"] < motion.duration_s < 1.01 * worked["time"]


def test_lengths_are_those_of_each_block() -> None:
    here = ARM.forward(WORK)
    turned, beside = here.copy(), here.copy()
    turned[:3, :3] = pose(0, 0, 0, 0, 0, 30.0)[:3, :3] @ here[:3, :3]
    turned[:3, 3] += 0.0, 0.3, 0.0
    beside[:3, 3] += 0.0, 0.1, 0.1
    motion = planned(Line(turned, None, 1), Arc(beside, here, 2, angle_rad=None), start=WORK)
    line, arc = move_lengths(motion)
    assert line[:2] == pytest.approx([0.3, np.radians(30.0)], rel=1e-6)
    circle = CircleGeometry.through(turned[:3, 3], beside[:3, 3], here[:3, 3])
    assert circle is not None
    assert arc[0] == pytest.approx(circle.circle.length_m, rel=1e-6)


@pytest.mark.parametrize("worked", VECTORS["circles"], ids=lambda worked: str(worked["points"]))
def test_circles(worked: dict) -> None:
    points = np.array(worked["points"], dtype=float)
    geometry = CircleGeometry.through(*points)
    assert geometry is not None
    np.testing.assert_allclose(geometry.circle.centre, worked["centre"], atol=1e-9)
    if "axes" in worked:
        np.testing.assert_allclose([geometry.circle.u, geometry.circle.v], worked["axes"], atol=1e-6)
    angles = np.degrees([geometry.via_rad, geometry.target_rad])
    assert angles == pytest.approx([worked["via"], worked["target"]], abs=1e-4)
    assert geometry.circle.radius_m == pytest.approx(worked["radius"], abs=1e-6)
    assert geometry.circle.length_m == pytest.approx(worked["length"], abs=1e-4)
    distances = geometry.circle.radius_m * np.array([0.0, geometry.via_rad, geometry.target_rad])
    np.testing.assert_allclose(geometry.circle.at(distances)[0], points, atol=1e-9)


def by_angle(points: list[list[float]], degrees: float) -> Circle:
    geometry = CircleGeometry.through(*np.array(points, dtype=float))
    assert geometry is not None
    base = geometry.circle
    return Circle(base.centre, base.u, base.v, base.radius_m, np.radians(degrees))


def test_a_circle_by_angle_goes_where_it_says_either_way_and_for_several_turns() -> None:
    worked = VECTORS["forced_circle"]
    circle = by_angle(worked["points"], worked["angle"])
    assert circle.length_m == pytest.approx(worked["length"], abs=1e-4)
    np.testing.assert_allclose(circle.at(np.array(circle.length_m))[0], worked["points"][0], atol=1e-9)
    for degrees, *place in VECTORS["quarter_circle"]["angles"]:
        circle = by_angle(VECTORS["quarter_circle"]["points"], degrees)
        np.testing.assert_allclose(circle.at(np.array(circle.length_m))[0], place, atol=1e-9)


@pytest.mark.parametrize("turns", [-2, -1, 1, 3])
def test_on_several_turns_the_orientation_passes_its_three_points_each_time(turns: int) -> None:
    start = ARM.forward(WORK)
    via, target = start.copy(), start.copy()
    via[:3, 3] += 0.0, 0.05, 0.05
    target[:3, 3] += 0.0, 0.1, 0.0
    via[:3, :3] = pose(0, 0, 0, 0, 0, 8.0)[:3, :3] @ start[:3, :3]
    target[:3, :3] = pose(0, 0, 0, 5.0, 0, 0)[:3, :3] @ start[:3, :3]
    motion = planned(Arc(via, target, 1, angle_rad=turns * 2.0 * np.pi), start=WORK)
    poses = motion.pose(np.linspace(0.0, motion.duration_s, 1500 * abs(turns)))
    for wanted in (via, target):
        away = np.linalg.norm(poses[:, :3, 3] - wanted[:3, 3], axis=1)
        near = poses[(away < 3e-4)]
        passes = 1 + np.count_nonzero(np.diff(np.flatnonzero(away < 3e-4)) > 1)
        assert passes == abs(turns)
        np.testing.assert_allclose(near[:, :3, :3], np.tile(wanted[:3, :3], (len(near), 1, 1)), atol=2e-3)
    np.testing.assert_allclose(poses[-1], start, atol=1e-6)


@pytest.mark.parametrize("worked", VECTORS["cubics"], ids=["book", "article"])
def test_cubic_curves(worked: dict) -> None:
    curve = bezier(np.array(worked["controls"], dtype=float))
    assert curve.length_m == pytest.approx(worked["length"], abs=1e-4)
    for share, *place in worked["points"]:
        np.testing.assert_allclose(curve.derivative(np.array(share), 0)[:2], place, atol=1e-9)
    for chords, length in worked["chords"]:
        points = curve.derivative(np.linspace(0.0, 1.0, chords + 1), 0)
        assert np.linalg.norm(np.diff(points, axis=0), axis=1).sum() == pytest.approx(length, abs=1e-5)
    if "rates" in worked:
        rates = np.linalg.norm(curve.derivative(np.linspace(0.0, 1.0, 101), 1), axis=1)
        assert [rates.min(), rates.max()] == pytest.approx(worked["rates"], abs=1e-2)


def test_spline_passes_its_middle_points_and_its_tangent_is_the_chord() -> None:
    worked = VECTORS["spline"]
    sections = [bezier(points) for points in control_points(np.array(worked["points"], dtype=float), None, None)]
    for section, middle in zip(sections, worked["middles"], strict=True):
        np.testing.assert_allclose(section.derivative(np.array(0.5), 0)[:2], middle, atol=1e-4)
        assert section.length_m == pytest.approx(worked["length"], abs=1e-4)
    np.testing.assert_allclose(sections[1].at(np.zeros(()))[1], worked["tangent"], atol=1e-12)


def test_round_edge_of_a_right_angle() -> None:
    worked, still = VECTORS["corner"], np.zeros(3)
    first = np.stack([[50.0, 0.0, 0.0], [1.0, 0.0, 0.0], still])
    last = np.stack([[100.0, 50.0, 0.0], [0.0, 1.0, 0.0], still])
    edge = joining(first, last, 2.0 * worked["radius"])
    for share, *place in worked["points"]:
        np.testing.assert_allclose(edge.derivative(np.array(share), 0)[:2], place, atol=1e-6)
    middle = edge.at(np.array(edge.length_m / 2.0))
    assert edge.length_m == pytest.approx(worked["length"], abs=2e-5)
    assert np.linalg.norm(middle[0] - [100, 0, 0]) == pytest.approx(worked["gap"], abs=1e-6)
    assert np.linalg.norm(middle[2]) == pytest.approx(worked["curvature"], abs=1e-6)
    np.testing.assert_allclose(edge.derivative(np.array([0.0, 1.0]), 2), 0.0, atol=1e-9)
    np.testing.assert_allclose(edge.derivative(np.array(0.5), 2)[:2], worked["bend"], atol=1e-9)
    for share, *rate in worked["rates"]:
        np.testing.assert_allclose(edge.derivative(np.array(share), 1)[:2], rate, atol=1e-9)


@pytest.mark.parametrize("worked", VECTORS["slerp"], ids=lambda worked: f"{worked['to']} {worked['share']}")
def test_orientation_turns_the_shortest_way(worked: dict) -> None:
    line = LineGeometry.between(pose(0, 0, 0, *worked["from"]), pose(100, 0, 0, *worked["to"]))
    rotation = line.poses(np.array(worked["share"]))[:3, :3]
    if "abc" in worked:
        np.testing.assert_allclose(rotation, pose(0, 0, 0, *worked["abc"])[:3, :3], atol=2e-6)
    if "quaternion" in worked:
        np.testing.assert_allclose(from_matrix(rotation), worked["quaternion"], atol=1e-6)
    if "angle" in worked:
        assert np.degrees(line.angle) == pytest.approx(worked["angle"], abs=1e-4)


def test_turns_about_fixed_axes_do_not_commute() -> None:
    """A +90, C +90, A -90, C -90 is a turn of 120 deg about (1, 1, -1), not nothing."""
    steps = [pose(0, 0, 0, *abc)[:3, :3] for abc in ((90, 0, 0), (0, 0, 90), (-90, 0, 0), (0, 0, -90))]
    whole = steps[3] @ steps[2] @ steps[1] @ steps[0]
    np.testing.assert_allclose(whole, [[0, 1, 0], [0, 0, -1], [-1, 0, 0]], atol=1e-12)
    line = LineGeometry.between(np.eye(4), np.block([[whole, np.zeros((3, 1))], [0, 0, 0, 1]]))
    assert np.degrees(line.angle) == pytest.approx(120.0)
    np.testing.assert_allclose(line.axis, np.array([1.0, 1.0, -1.0]) / np.sqrt(3.0), atol=1e-9)


def test_of_a_line_that_turns_the_slower_cap_rules() -> None:
    """300 mm with a turn of 90 deg at 100 mm/s and 20 deg/s: 4.5 s at constant speed, that is 66.7 mm/s."""
    start = ARM.forward(WORK)
    target = start.copy()
    target[:3, :3] = pose(0, 0, 0, 0, 0, 90.0)[:3, :3] @ start[:3, :3]
    target[:3, 3] += 0.0, 0.3, 0.0
    motion = planned(Line(target, 0.1, 1, rotation_rad_s=np.radians(20.0)), start=WORK)
    assert motion.tcp_speed(np.array(motion.duration_s / 2.0)) == pytest.approx(0.3 / 4.5, rel=5e-3)
