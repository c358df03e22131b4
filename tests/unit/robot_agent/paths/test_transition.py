"""Each border of two moves has its class, what the robot does there, and why."""

import re
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial import cKDTree

from robot_agent.paths import Arc, Continuity, JointMove, Line, Move, Passing, Spline, Transition
from robot_agent.paths.orientation import rotation_vectors
from robot_agent.trajectory import Motion, plan
from tests.unit.planned_moves import at, beside, planned
from tests.unit.random_moves import LIMITS, MODEL, START, sequence

C0, C1, C2 = Continuity
STOPS, ROUNDED, BLENDED, THROUGH = Passing.STOPS, Passing.ROUNDED, Passing.BLENDED, Passing.THROUGH
WAY = np.array([0.2, 0.1, -0.1, 0.2, 0.1, 0.3])
QUARTER = Arc(at(y_mm=200 + 70.710678, z_mm=29.289322), at(y_mm=300, z_mm=100), 2)
"""Radius 100 mm, tangential after a line along Y up to 200 mm."""


def spline(*points: tuple[float, float]) -> Spline:
    return Spline(np.array([at(y_mm=y, z_mm=z) for y, z in points]), 1)


def line(y_mm: float, z_mm: float = 0.0, turn_deg: float = 0.0, round_m: float | None = None) -> Line:
    return Line(at(y_mm=y_mm, z_mm=z_mm, turn_deg=turn_deg), None, 1, round_m=round_m)


CASES: dict[str, tuple[list[Move], Continuity, Passing, str]] = {
    "corner": ([line(200), line(200, 200)], C0, STOPS, "the path turns by 90.0 deg; there is no round edge"),
    "round edge": ([line(200, round_m=0.05), line(200, 200)], C0, ROUNDED, "90.0 deg; round edge of 50 mm"),
    "short": (
        [line(60, round_m=0.1), line(60, 300)], C0, ROUNDED, "round edge of 100 mm, cut to 30.0 mm: half of the shorter"
    ),
    "R0": ([line(100, round_m=0.0), line(300)], C2, STOPS, "a round edge of 0 asks for a stop"),
    "straight on": ([line(100), line(300)], C2, THROUGH, ""),
    "turning otherwise": (
        [line(150, turn_deg=15), line(300)], C0, BLENDED, "orientation turns at another rate, by 20.00 deg per 100 mm"
    ),
    "line into arc": ([line(200), QUARTER], C1, BLENDED, "the curvature steps by that of a circle of 100 mm"),
    "turning back": (
        [line(200, round_m=0.05), line(200 - 94, 34.2)], C0, STOPS, "the path turns by 160.0 deg; too sharp"
    ),
    "on the spot": ([line(200), line(200, turn_deg=20)], C0, STOPS, "the TCP turns on the spot there"),
    "equal sections": ([spline((100, 100)), spline((200, 0))], C2, THROUGH, ""),
    "unequal sections": ([spline((100, 100)), spline((300, 0))], C1, BLENDED, "the curvature steps by that"),
    "joints": (
        [JointMove(START + WAY, 1.0, 1), JointMove(START - WAY, 1.0, 2)], C0, STOPS, "joints' direction turns by 180.0"
    ),
    "joints straight on": ([JointMove(START + WAY, 1.0, 1), JointMove(START + 2 * WAY, 1.0, 2)], C2, THROUGH, ""),
    "joints rounded": (
        [JointMove(START + WAY, 1.0, 1, round_m=0.05), JointMove(START + WAY * [2, 0, 1, 2, 1, 1], 1.0, 2)],
        C0, ROUNDED, "round edge of 50 mm",
    ),
    "not in step": (
        [JointMove(START + WAY, 1.0, 1, synchronised=False), JointMove(START, 1.0, 2)], C0, STOPS, "arrives by itself"
    ),
    "joints into spline": (
        [JointMove(START + 0.1, 1.0, 1), Spline(beside(START + 0.1, 30, 200, 50)[None], 2)],
        C1, BLENDED, "the curvature steps",
    ),
    "joints into line": ([JointMove(START + 0.1, 1.0, 1), line(300)], C0, STOPS, r"path turns by \d+\.\d deg; there"),
}  # fmt: skip


@pytest.mark.parametrize(("moves", "continuity", "passing", "reason"), CASES.values(), ids=CASES.keys())
def test_border_of_two_blocks(moves: list[Move], continuity: Continuity, passing: Passing, reason: str) -> None:
    motion = planned(*moves)
    (transition,) = [each for each in motion.transitions if each.before != each.move]
    assert (transition.before, transition.move) == (0, 1)
    assert (transition.continuity, transition.passing) == (continuity, passing)
    assert re.search(reason, transition.reason)
    assert bool(reason) is bool(transition.reason)
    assert (len(motion.rests) == 3) is (passing is STOPS)
    assert (transition.deviation_m > 0.0) is (passing is ROUNDED or continuity is C1)


@pytest.mark.parametrize(("name", "deviation_mm"), [("round edge", 13.258252), ("short", 7.954951)])
def test_a_round_edge_passes_its_corner_at_the_worked_distance(name: str, deviation_mm: float) -> None:
    (transition,) = planned(*CASES[name][0]).transitions
    assert 1000.0 * transition.deviation_m == pytest.approx(deviation_mm, abs=2e-3)


def turned_deg(motion: Motion, around: float, programmed: Callable[[np.ndarray], np.ndarray]) -> float:
    """Largest angle between the flange's orientation and the programmed one `(k, 3, 3)` within 0.4 s around a time."""
    taus = np.linspace(max(around - 0.4, 0.0), min(around + 0.4, motion.duration_s), 4001)
    poses = motion.pose(taus)
    apart = np.swapaxes(programmed(poses[:, :3, 3]), -1, -2) @ poses[:, :3, :3]
    return float(np.degrees(np.linalg.norm(rotation_vectors(apart), axis=1).max()))


def test_blended_turns_report_how_far_they_leave_the_programmed_orientation() -> None:
    motion = planned(line(150, turn_deg=15), line(300))

    def programmed(places: np.ndarray) -> np.ndarray:
        y = 1000.0 * (places[:, 1] - at()[1, 3])
        return np.array([at(turn_deg=15 * min(way / 150, 2 - way / 150))[:3, :3] for way in y])

    (transition,) = motion.transitions
    found = turned_deg(motion, float(motion.ends[0]), programmed)
    assert np.degrees(transition.deviation_rad) == pytest.approx(found, rel=0.02)


def test_the_middle_point_of_an_arc_is_reported_where_its_turns_differ() -> None:
    straight = Arc(at(y_mm=50, z_mm=50, turn_deg=5), at(y_mm=100, turn_deg=10), 1)
    bent = Arc(at(y_mm=50, z_mm=50, turn_deg=12), at(y_mm=100, turn_deg=4), 1)
    assert planned(straight).transitions == ()
    (via,) = planned(bent).transitions
    assert (via.before, via.move, via.passing) == (0, 0, BLENDED)
    assert np.degrees(via.deviation_rad) == pytest.approx(0.0272 * 20.0, rel=0.01)


def test_the_turn_that_a_spline_takes_over_from_a_joint_move_is_reported() -> None:
    there = START + 0.1
    motion = planned(JointMove(there, 1.0, 1), Spline(beside(there, 30, 200, 50)[None], 2))
    (taken,) = [each for each in motion.transitions if each.before == each.move]
    rotation = MODEL.forward(there)[:3, :3]
    found = turned_deg(
        motion, float(motion.ends[0]) + 0.4, lambda places: np.broadcast_to(rotation, (len(places), 3, 3))
    )
    assert np.degrees(taken.deviation_rad) == pytest.approx(found, rel=0.05)


def test_a_tool_that_follows_the_path_stops_where_it_has_to_turn() -> None:
    corner, end = at(y_mm=200), at(x_mm=99, y_mm=200)
    transitions = planned(*[Line(pose, None, 1, tangential_rad=0.0) for pose in (corner, end)]).transitions
    assert {each.passing for each in transitions} == {STOPS}
    assert all("follows the path" in each.reason or "on the spot" in each.reason for each in transitions)


@pytest.mark.parametrize("end_z_mm", [6.0, 8.0, 12.0, 16.0])
def test_a_blend_tells_how_far_it_leaves_a_spline_that_turns_back_in_front_of_it(end_z_mm: float) -> None:
    """Within the blend the spline comes back to where it was, so places as far along are not near each other."""
    motion = planned(spline((15, 0)), line(-25, end_z_mm))
    (transition,) = [each for each in motion.transitions if each.before != each.move]
    start, corner, end = at()[:3, 3], at(y_mm=15)[:3, 3], at(y_mm=-25, z_mm=end_z_mm)[:3, 3]
    ahead, back = (corner - start) / 3.0, (end - corner) / np.linalg.norm(end - corner)
    control = np.stack([start, start + ahead, corner - np.linalg.norm(ahead) * back, corner])
    u = np.linspace(0.0, 1.0, 8001)[:, None]
    weights = np.concatenate([(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3], axis=1)
    programmed = np.concatenate([weights @ control, corner + u * (end - corner)])
    places = MODEL.forward(motion.q(np.linspace(0.0, motion.duration_s, 2001)))[:, :3, 3]
    farthest = cKDTree(programmed).query(places)[0].max()
    assert transition.passing is BLENDED
    assert farthest == pytest.approx(transition.deviation_m, abs=1e-5)
    assert farthest < LIMITS.shaping.blend_m + 1e-5


@pytest.mark.parametrize("seed", [2, 5, 11, 17])
def test_every_border_is_told_and_only_where_it_says_so_the_robot_stops(seed: int) -> None:
    moves = sequence(seed, longest=6)
    motion = plan(MODEL, moves, LIMITS, start=START)
    borders = [each for each in motion.transitions if each.before != each.move]
    assert [(each.before, each.move) for each in borders] == [(k, k + 1) for k in range(len(moves) - 1)]
    stops = [each for each in motion.transitions if each.passing is STOPS]
    np.testing.assert_allclose(motion.ends[[each.before for each in stops]], motion.rests[1:-1], atol=1e-9)
    assert all(each.deviation_m <= LIMITS.shaping.blend_m for each in borders if each.passing is BLENDED)
    for each in borders:
        assert_as_the_joints_feel_it(motion, each)


def assert_as_the_joints_feel_it(motion: Motion, transition: Transition) -> None:
    """Just beside a stop, the joints go where the class says: on in the same direction, or in another."""
    if transition.passing is not STOPS:
        return
    tau = motion.ends[transition.before]
    before, after = (motion.q(np.array(tau + step)) - motion.q(np.array(tau)) for step in (-0.02, 0.02))
    before, after = -before / np.linalg.norm(before), after / np.linalg.norm(after)
    assert bool(np.linalg.norm(after - before) > 2e-3) is (transition.continuity is C0)
