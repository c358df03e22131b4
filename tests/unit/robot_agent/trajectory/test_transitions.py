"""Where moves meet: what is merged, what is rounded, and where the robot has to stop."""

from dataclasses import replace

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import load_model
from robot_agent.paths import Arc, JointMove, Line, Move, Passing, Sequence, Spline
from robot_agent.trajectory import Limits, Motion, PlanError, plan
from robot_agent.trajectory.joints.joint_path import JointPath
from robot_agent.trajectory.planner import _Paths
from tests.unit.planned_moves import HERE, at, beside, planned
from tests.unit.random_moves import LIMITS, MODEL, START
from tests.unit.repository import ROOT


def stops(motion: Motion) -> int:
    """Rests between start and end."""
    return len(motion.rests) - 2


def test_a_sharp_corner_is_a_stop() -> None:
    motion = planned(Line(at(y_mm=100), None, 1), Line(at(y_mm=100, z_mm=100), None, 2))
    assert stops(motion) == 1
    np.testing.assert_allclose(motion.pose(motion.rests[1:2])[0], at(y_mm=100), atol=1e-6)


def test_lines_that_go_straight_on_are_one_motion_as_fast_as_one_line() -> None:
    motion = planned(Line(at(y_mm=120), None, 1), Line(at(y_mm=300), None, 2))
    assert stops(motion) == 0
    assert motion.duration_s == pytest.approx(planned(Line(at(y_mm=300), None, 1)).duration_s, rel=0.03)
    np.testing.assert_allclose(motion.pose(motion.ends[:1])[0], at(y_mm=120), atol=1e-6)


def test_r0_stops_although_the_line_goes_straight_on() -> None:
    assert stops(planned(Line(at(y_mm=100), None, 1, round_m=0.0), Line(at(y_mm=300), None, 2))) == 1


def test_turning_differently_on_a_straight_line_costs_no_stop_and_no_deviation_at_the_via_point() -> None:
    motion = planned(Line(at(y_mm=150, turn_deg=15), None, 1), Line(at(y_mm=300, turn_deg=0), None, 2))
    assert stops(motion) == 0
    np.testing.assert_allclose(motion.pose(motion.ends[:1])[0], at(y_mm=150, turn_deg=15), atol=1e-5)


def test_line_into_arc_is_one_motion_whose_curvature_is_blended_within_the_tolerance() -> None:
    arc = Arc(at(y_mm=200 + 70.710678, z_mm=29.289322), at(y_mm=300, z_mm=100), 2)
    motion = planned(Line(at(y_mm=200), 0.3, 1), arc)
    assert stops(motion) == 0
    (blend,) = motion.transitions
    assert 0.0 < blend.deviation_m <= LIMITS.shaping.blend_m


@pytest.mark.parametrize("blend_mm", [0.01, 0.5])
def test_blends_use_the_tolerance_of_the_robot_file_whether_flange_or_joints_pass_them(blend_mm: float) -> None:
    limits = replace(LIMITS, shaping=replace(LIMITS.shaping, blend_m=blend_mm / 1000.0))
    arc = Arc(at(y_mm=200 + 70.710678, z_mm=29.289322), at(y_mm=300, z_mm=100), 2)
    for flips in False, True:  # a path of its own, so that the joints pass from it to the arc
        moves = Line(at(y_mm=200), 0.3, 1, flips), arc
        motion = plan(MODEL, Sequence(moves), limits, start=START)
        (blend,) = motion.transitions
        assert 0.4 * blend_mm < 1000.0 * blend.deviation_m <= blend_mm


def test_round_edge_needs_no_stop_and_cuts_the_corner_as_worked() -> None:
    motion = planned(Line(at(y_mm=200), None, 1, round_m=0.1), Line(at(y_mm=200, z_mm=200), None, 2))
    assert stops(motion) == 0
    place = motion.pose(np.linspace(0, motion.duration_s, 4000))[:, :3, 3]
    nearest = np.linalg.norm(place - at(y_mm=200)[:3, 3], axis=1).min()
    assert nearest == pytest.approx(0.0265165, abs=2e-5)


def test_round_edge_takes_at_most_half_of_the_shorter_block() -> None:
    motion = planned(Line(at(y_mm=60), None, 1, round_m=0.1), Line(at(y_mm=60, z_mm=300), None, 2))
    place = motion.pose(np.linspace(0, motion.duration_s, 4000))[:, :3, 3]
    assert np.linalg.norm(place - at(y_mm=60)[:3, 3], axis=1).min() == pytest.approx(0.0079550, abs=2e-5)


def test_joint_moves_and_lines_are_rounded_into_each_other() -> None:
    """With 40 mm stops are quicker."""
    round_m = 0.05
    there, target = at(y_mm=150), START + np.array([0.1, 0.1, 0.1, 0, 0.1, 0])
    motion = planned(
        Line(there, None, 1, round_m=round_m), JointMove(target, 1.0, 2, round_m=round_m), Line(HERE, None, 3)
    )
    assert stops(motion) == 0
    place = motion.pose(np.linspace(0, motion.duration_s, 4000))[:, :3, 3]
    assert 1e-4 < np.linalg.norm(place - there[:3, 3], axis=1).min() < round_m


def test_joint_move_that_goes_straight_on_is_merged() -> None:
    way = np.array([0.2, 0.1, -0.1, 0.2, 0.1, 0.3])
    motion = planned(JointMove(START + way, 1.0, 1), JointMove(START + 2 * way, 1.0, 2))
    assert stops(motion) == 0
    assert motion.duration_s == pytest.approx(planned(JointMove(START + 2 * way, 1.0, 1)).duration_s, rel=0.03)


def test_a_turn_on_the_spot_behind_a_round_edge_keeps_the_limits_of_turning() -> None:
    moves = Line(at(y_mm=100), None, 1, round_m=0.02), Line(at(y_mm=100, turn_deg=60), None, 2, rotation_rad_s=0.5)
    for motion in planned(*moves), planned(replace(moves[0], rotation_rad_s=0.5), moves[1]):
        tau = np.linspace(motion.ends[0], motion.duration_s, 500)
        twist = (MODEL.jacobian(motion.q(tau)) @ motion.qd(tau)[..., None])[..., 0]
        assert 0.49 < np.linalg.norm(twist[:, 3:], axis=1).max() < 0.5 * 1.001


def test_a_corner_that_turns_back_is_a_stop_even_with_a_round_edge() -> None:
    motion = planned(Line(at(y_mm=200), None, 1, round_m=0.05), Line(at(y_mm=20, z_mm=10), None, 2))
    assert stops(motion) == 1


def test_splines_are_one_curve_through_their_points_and_ignore_round_edges() -> None:
    points = [at(y_mm=100, z_mm=60), at(y_mm=200, z_mm=-40, turn_deg=10), at(y_mm=320, z_mm=20)]
    motion = planned(*[Spline(p[None], k, round_m=0.05) for k, p in enumerate(points, 1)])
    assert stops(motion) == 0
    np.testing.assert_allclose(
        motion.pose(motion.ends)[:, :3, 3], np.array(points)[:, :3, 3], atol=LIMITS.shaping.blend_m
    )


def test_spline_leaves_a_line_in_its_direction() -> None:
    motion = planned(Line(at(y_mm=150), None, 1), Spline(np.array([at(y_mm=300, z_mm=100)]), 2))
    assert stops(motion) == 0


def angle_deg(first: np.ndarray, second: np.ndarray) -> float:
    """Between two directions."""
    return float(np.degrees(np.arccos(first @ second / np.linalg.norm(first) / np.linalg.norm(second))))


def test_a_spline_between_joint_moves_goes_their_ways_and_passes_its_points() -> None:
    there, on = START + 0.1, START + np.array([0.6, 0.0, -0.1, 0.3, 0.2, 0.1])
    points = [beside(there, 30, 200, 50), beside(there, -20, 420, 90, 8)]
    motion = planned(JointMove(there, 1.0, 1), *[Spline(p[None], 2) for p in points], JointMove(on, 1.0, 4))
    assert stops(motion) == 0
    poses = motion.pose(motion.ends)
    np.testing.assert_allclose(poses[:3, :3, 3], [p[:3, 3] for p in [MODEL.forward(there), *points]], atol=1.2e-4)
    np.testing.assert_allclose(poses[:3, :3, :3], [p[:3, :3] for p in [MODEL.forward(there), *points]], atol=1e-3)
    for tau, travel in ((motion.ends[0], there - START), (motion.ends[2], on - motion.q(motion.ends[2]))):
        assert angle_deg(motion.qd(tau), travel) < 3.0


@pytest.mark.parametrize(
    "move",
    [
        JointMove(START + 0.1, 1.0, 1, synchronised=False),
        JointMove(START + np.array([0, 0, 0, 0, 0, 0.5]), 1.0, 1),
        JointMove(START + 0.1, 1.0, 1, round_m=0.0),
    ],
    ids=["without step", "turns the flange on the spot", "R0"],
)
def test_behind_a_joint_move_without_a_direction_or_with_r0_a_spline_begins_at_rest(move: JointMove) -> None:
    motion = planned(move, Spline(beside(move.target, 30, 200, 50)[None], 2))
    assert stops(motion) == 1
    place = motion.pose(motion.rests[1] + np.array([0.0, 0.05]))[:, :3, 3]
    chord = beside(move.target, 30, 200, 50)[:3, 3] - place[0]
    assert angle_deg(place[1] - place[0], chord) < 0.1


def test_arc_by_angle_goes_round_as_often_as_it_says_and_backwards() -> None:
    via, target = at(y_mm=50, z_mm=50), at(y_mm=100)
    motion = planned(Arc(via, target, 1, angle_rad=-4.0 * np.pi))
    np.testing.assert_allclose(motion.pose(np.array(motion.duration_s)), HERE, atol=1e-6)
    early = motion.pose(np.array(0.1 * motion.duration_s))[:3, 3] - HERE[:3, 3]
    assert early[2] < 0.0  # away from the via point
    taus = np.linspace(0, motion.duration_s, 4000)
    way = np.linalg.norm(np.diff(motion.pose(taus)[:, :3, 3], axis=0), axis=1).sum()
    assert way == pytest.approx(4.0 * np.pi * 0.05, rel=1e-4)


@pytest.mark.parametrize(("turns", "lift_m"), [(2.0, 0.02), (-1.0, 0.03), (None, -0.01)])
def test_a_helix_ends_beside_the_plane_of_its_circle_and_the_next_move_begins_there(
    turns: float | None, lift_m: float
) -> None:
    via, target = at(y_mm=50, z_mm=50), at(y_mm=100)
    circle = Arc(via, target, 1, angle_rad=None if turns is None else turns * 2.0 * np.pi, lift_m=lift_m)
    motion = planned(circle, Line(at(y_mm=150), None, 2))
    end = motion.pose(motion.ends[:1])[0]
    flat = HERE if turns is not None else target
    normal = np.cross(via[:3, 3] - HERE[:3, 3], target[:3, 3] - via[:3, 3])
    beside_it = lift_m * normal / np.linalg.norm(normal)
    np.testing.assert_allclose(end[:3, 3], flat[:3, 3] + beside_it, atol=2e-5)
    way = motion.pose(np.linspace(0.0, motion.ends[0], 4000))[:, :3, 3]
    length = np.linalg.norm(np.diff(way, axis=0), axis=1).sum()
    assert length == pytest.approx(np.hypot(2.0 * np.pi * abs(turns or 0.5) * 0.05, lift_m), rel=1e-3)


def test_arc_passes_the_orientations_of_its_points() -> None:
    via, target = at(y_mm=50, z_mm=50, turn_deg=12), at(y_mm=100, turn_deg=4)
    motion = planned(Arc(via, target, 1))
    poses = motion.pose(np.linspace(0, motion.duration_s, 6001))
    nearest = poses[np.linalg.norm(poses[:, :3, 3] - via[:3, 3], axis=1).argmin()]
    np.testing.assert_allclose(nearest, via, atol=2e-4)
    np.testing.assert_allclose(poses[-1], target, atol=1e-6)


def test_arc_without_a_circle_names_its_line() -> None:
    with pytest.raises(PlanError, match=r"line 7.*lie on one line.*use a line") as caught:
        planned(Line(at(z_mm=20), None, 3), Arc(at(z_mm=40), at(z_mm=60), 7))
    assert (caught.value.move, caught.value.line) == (1, 7)


@pytest.mark.parametrize(
    "move",
    [Line(at(y_mm=200), None, 1, rotation_rad_s=0.1), JointMove(START + 0.3, 1.0, 1, rotation_rad_s=0.1)],
    ids=["line", "joint move"],
)
def test_caps_hold_on_every_move(move: Move) -> None:
    target = at(y_mm=200, turn_deg=20)
    move = Line(target, None, 1, rotation_rad_s=0.1) if isinstance(move, Line) else move
    motion = planned(move)
    taus = np.linspace(0, motion.duration_s, 500)
    turn = (MODEL.jacobian(motion.q(taus))[:, 3:] @ motion.qd(taus)[..., None])[..., 0]
    assert np.linalg.norm(turn, axis=1).max() == pytest.approx(0.1, rel=5e-3)


@pytest.mark.parametrize("round_m", [0.02, 0.1])
@pytest.mark.parametrize(
    ("kinds", "caps_m_s"),
    [("line joints", (0.1, np.inf)), ("joints line", (np.inf, 0.1)), ("joints joints", (0.1, 0.2))],
)
def test_caps_hold_in_corners_that_the_joints_round(kinds: str, caps_m_s: tuple[float, float], round_m: float) -> None:
    start, moves = START, []
    for line, (kind, cap) in enumerate(zip(kinds.split(), caps_m_s, strict=True), 1):
        speed = cap if np.isfinite(cap) else None
        if kind == "line":
            pose = MODEL.forward(start)
            pose[:3, 3] += [0.0, 0.15, 0.0]
            moves.append(Line(pose, speed, line, round_m=round_m))
        else:
            start = start + np.array([[0.4, 0.1, 0.0, 0.0, 0.0, 0.0], [0.3, 0.1, 0.4, 0.3, 0.1, 0.2]][line - 1])
            moves.append(JointMove(start, 1.0, line, speed_m_s=speed, round_m=round_m))
    motion = planned(*moves)
    assert stops(motion) == 0
    taus = np.arange(0.0, motion.duration_s, 1e-3)
    number, speeds = motion.move_at(taus), motion.tcp_speed(taus)
    for move, cap in enumerate(caps_m_s):
        fastest = speeds[number == move].max()
        assert fastest <= 1.001 * cap
        assert fastest > 0.9 * min(cap, 0.5)


SMALL = [
    (
        [
            Line(at(y_mm=100), None, 1),
            Line(at(y_mm=101, turn_deg=20), None, 2),
            Line(at(y_mm=200, turn_deg=20), None, 3),
        ],
        1.2,
    ),
    ([Spline(np.array([at(y_mm=100), at(y_mm=100.5, turn_deg=20), at(y_mm=200, turn_deg=20)]), 1)], 1.2),
    ([Spline(np.array([at(y_mm=100 + 0.3 * k, z_mm=0.02 * (k % 3)) for k in range(8)] + [at(y_mm=200)]), 1)], 0.68),
]
"""Moves with something small on the way, and how long [s] they would take without a limit of jerk."""


@pytest.mark.parametrize(("moves", "bound_s"), SMALL, ids=["turn", "spline that turns", "fine spline"])
def test_something_small_on_the_way_slows_the_robot_there_only(moves: list[Move], bound_s: float) -> None:
    motion = planned(*moves)
    assert stops(motion) == 0
    assert motion.duration_s < 1.8 * bound_s + 0.2


def test_a_turn_that_is_not_quite_on_the_spot_asks_for_few_nodes_on_the_lines_beside_it() -> None:
    """As it comes from places that are rounded."""
    moves = [Line(at(y_mm=100), None, 1), Line(at(y_mm=100.01, turn_deg=20), None, 2)]
    (path,) = _Paths(MODEL, Sequence([*moves, Line(at(y_mm=200, turn_deg=20), None, 3)]), LIMITS).runs(START)
    assert isinstance(path, JointPath)
    assert len(path.pieces.knots) < 500


@pytest.mark.parametrize("speed_m_s", [None, 0.2])
@pytest.mark.parametrize("round_mm", [0.01, 0.1, 0.5, 1.0, 3.0, 10.0, 50.0])
def test_a_round_edge_is_never_slower_than_the_stop_which_is_taken_in_its_place(
    round_mm: float, speed_m_s: float | None
) -> None:
    corner, after = at(y_mm=100), Line(at(y_mm=120, z_mm=100), speed_m_s, 2)
    rounded, stopping = (planned(Line(corner, speed_m_s, 1, round_m=each), after) for each in (round_mm / 1000.0, None))
    assert rounded.duration_s <= stopping.duration_s + 5e-4
    (transition,) = rounded.transitions
    if transition.passing is Passing.STOPS:
        assert f"a stop is quicker than a round edge of {round_mm:g} mm" in transition.reason
    assert (transition.passing is Passing.STOPS) == (stops(rounded) == 1)
    assert (transition.passing is Passing.STOPS) or round_mm >= 0.5
    assert (transition.passing is Passing.ROUNDED) or round_mm <= 10.0


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["scara", "delta"])
def test_where_an_edge_is_about_as_quick_as_a_stop_the_quicker_is_taken(name: str, seed: int) -> None:
    """On robots whose acceleration builds up quickly an estimate alone took edges that were up to 13 ms slower."""
    model, rng = load_model(ROOT / "cell_configs" / "models" / f"{name}.yaml"), np.random.default_rng([seed, 31])
    limits = Limits.of(model.description)
    start = model.home + (np.radians([15.0] * 4) if name == "delta" else np.array([0.2, -0.5, -0.05, 0.0]))
    poses = np.tile(model.forward(start), (2, 1, 1))
    poses[:, :3, 3] += rng.uniform(-0.04, 0.04, (2, 3))
    speed_m_s = (None, 0.2)[seed % 2]

    def lasting_s(round_mm: float | None) -> float:
        round_m = None if round_mm is None else round_mm / 1000.0
        moves = Line(poses[0], speed_m_s, 1, round_m=round_m), Line(poses[1], speed_m_s, 2)
        return plan(model, Sequence(moves), limits, start=start).duration_s

    stopping_s = lasting_s(None)
    for round_mm in (1.0, 3.0, 10.0):
        assert lasting_s(round_mm) <= stopping_s + 5e-4


@pytest.mark.parametrize(("feed_m_s", "round_mm"), [(0.05, 5.0), (0.1, 10.0)])
def test_a_slow_round_edge_in_which_the_tool_turns_is_not_slower_than_the_stop(
    feed_m_s: float, round_mm: float
) -> None:
    """However far an estimate is off: these were up to 60 ms slower."""
    model = load_model(ROOT / "cell_configs" / "models" / "cobot.yaml")
    start = np.radians([-24.87, -132.49, 118.42, 111.69, -88.01, 13.47])
    xyz_abc = [[0.03061, 0.13856, 0.46635, -90.45, -22.38, -117.29], [0.0726, 0.13186, 0.49034, -97.88, 0.15, -128.48]]
    first, second = from_xyz_abc(np.array(xyz_abc) * np.array([1.0, 1.0, 1.0, *3 * [np.pi / 180.0]]))

    def lasting_s(round_m: float | None) -> float:
        moves = Line(first, feed_m_s, 1, round_m=round_m), Line(second, feed_m_s, 2)
        return plan(model, Sequence(moves), Limits.of(model.description), start=start).duration_s

    assert lasting_s(round_mm / 1000.0) <= lasting_s(None) + 5e-4


def test_round_edges_at_both_ends_of_a_move_of_some_micrometres_are_stops() -> None:
    corner, beside = at(y_mm=100), at(y_mm=100.003, z_mm=0.002)
    moves = Line(corner, 0.2, 1, round_m=0.005), Line(beside, None, 2, round_m=0.005), Line(at(z_mm=80), None, 3)
    motion = planned(*moves)
    assert [each.passing for each in motion.transitions] == [Passing.STOPS, Passing.STOPS]
    assert motion.duration_s < planned(Line(corner, 0.2, 1), Line(at(z_mm=80), None, 3)).duration_s + 0.1


def test_speed_of_a_joint_move_can_be_capped_in_metres() -> None:
    motion = planned(JointMove(START + np.array([0.6, 0, 0, 0, 0, 0]), 1.0, 1, speed_m_s=0.2))
    assert motion.tcp_speed(motion.grid).max() == pytest.approx(0.2, rel=5e-3)


def test_lateral_acceleration_limits_the_speed_on_a_circle() -> None:
    motion = planned(Arc(at(y_mm=20, z_mm=20), at(y_mm=40), 1, angle_rad=4 * np.pi))
    most = np.sqrt(LIMITS.path.acceleration_m_s2 * 0.02)
    assert motion.tcp_speed(motion.grid).max() <= most * 1.001
