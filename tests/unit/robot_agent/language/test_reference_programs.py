"""The programs by which the textbook explains its robot language: they read, and the arm goes where they say."""

import math
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from cell.config.points_file import Point, PosePoint, Signal, SignalKind
from cell.messages import FramePose
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned
from robot_agent.kinematics import Model
from robot_agent.language import (
    AwaitAnswer,
    FlagMark,
    Interpreter,
    JointStep,
    MotionStep,
    Mount,
    MoveArc,
    MoveLine,
    Names,
    Pause,
    Points,
    Program,
    ProgramError,
    Step,
    TrackingOff,
    TrackingOn,
    Ways,
    excerpt,
    parse_program,
)
from robot_agent.language.form import formatted
from robot_agent.workspace import PlacedRobot
from tests.unit.robot_agent.language.reference_programs import (
    FRAMES,
    HOME,
    MODEL,
    POINTS,
    STAY,
    SUB,
    TANG,
    at,
    beside,
    placed,
    taught_with,
    with_tools,
)
from tests.unit.six_axis_arm import arm

NEAR_M = 2e-4
"""Where the curvature steps, the TCP may leave the curve by 0.1 mm."""

LOOP = """HOME F30
MJ P1 F100 //move to starting point
LOOP:
ML P2 T1 Z1 F100
ML P3 T1 Z1
"""


def program(text: str, points: dict[str, Point] | None = None, model: Model = MODEL) -> Program:
    names = Names(
        model.joint_names,
        corrections=("trk1",),
        inputs=("part",),
        tools=("t1", "t2"),
        frames=FRAMES,
        points=Points(POINTS if points is None else points),
        signals={"di3": Signal(SignalKind.INPUT, "part", 0.5)},
    )
    return parse_program(text, "p", names)


def planned(
    text: str,
    points: dict[str, Point] | None = None,
    frames: tuple[FramePose, ...] = STAY,
    model: Model = MODEL,
    ways: Ways | None = None,
) -> list[Planned]:
    parsed = program(text, points, model)
    motions, failed = dry_run(Planner(PlacedRobot.at(model), 0.004), parsed, 60.0, frames, ways)
    assert failed is None, failed.text
    return motions


def refusal(text: str, points: dict[str, Point] | None = None) -> str:
    """Why the dry run ends."""
    _, failed = dry_run(Planner(PlacedRobot.at(MODEL), 0.004), program(text, points), 60.0, STAY)
    assert failed is not None
    return failed.text


def poses_on(motions: list[Planned], line: int) -> NDArray[np.float64]:
    """Poses `(n, 4, 4)` of the TCP, lengths in m, on one line of the program."""
    found = []
    for each in motions:
        taus = np.linspace(0.0, each.motion.duration_s, 2001)
        on_line = np.array([each.lines[int(move)] == line for move in each.motion.move_at(taus)])
        found.append(each.motion.pose(taus[on_line]))
    return np.concatenate(found)


def path_of(motions: list[Planned], line: int) -> NDArray[np.float64]:
    """Places `(n, 3)` [m] of the TCP on one line of the program."""
    return poses_on(motions, line)[:, :3, 3]


def ends(motions: list[Planned]) -> NDArray[np.float64]:
    """Places `(n, 3)` [m] at which moves end, by their order."""
    return np.concatenate([each.motion.pose(each.motion.ends)[:, :3, 3] for each in motions])


def steps(text: str, count: int) -> list[Step]:
    interpreter = Interpreter(program(text))
    return [interpreter.next() for _ in range(count)]


def problems(text: str) -> list[str]:
    with pytest.raises(ProgramError) as refused:
        program(text)
    return [str(problem) for problem in refused.value.problems]


def circle_through(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> tuple[complex, float]:
    """Centre and radius of the circle in the XY plane, by complex numbers."""
    z, w, v = (complex(each[0], each[1]) for each in (a, b, c))
    turned = (v - z) / (w - z)
    centre = (w - z) * (turned - abs(turned) ** 2) / (2j * turned.imag) + z
    return centre, abs(z - centre)


def from_circle(path: NDArray[np.float64], centre: complex, radius: float) -> NDArray[np.float64]:
    """How far each place is from it [m]."""
    away: NDArray[np.float64] = np.abs(np.abs(path[:, 0] + 1j * path[:, 1] - centre) - radius)
    return away


def from_segments(path: NDArray[np.float64], corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """How far each place is from the polygon [m]."""
    away = np.full(len(path), np.inf)
    for begin, end in pairwise(corners):
        share = np.clip((path - begin) @ (end - begin) / ((end - begin) @ (end - begin)), 0.0, 1.0)
        away = np.minimum(away, np.linalg.norm(path - begin - share[:, None] * (end - begin), axis=1))
    return away


# 1: lines and arcs with round edges


def test_corners_of_lines_and_arcs_are_rounded_by_at_most_r_and_nothing_stops() -> None:
    (one,) = planned("ML P1 R100 FC100\nML P2 R50\nML P3 R100\nMC P5 Q4 R100\nMC P7 Q6")
    taus = np.linspace(0.0, one.motion.duration_s, 8001)
    path = one.motion.pose(taus)[:, :3, 3]
    p0, p1, p2, p3 = at("P0", "P1", "P2", "P3")
    first, second = circle_through(*at("P3", "P4", "P5")), circle_through(*at("P5", "P6", "P7"))
    away = np.minimum(from_circle(path, *first), from_circle(path, *second))
    away = np.minimum(away, from_segments(path, np.array([p0, p1, p2, p3])))
    corners = {"P1": 50.0, "P2": 50.0, "P3": 80.0, "P5": 100.0}  # R, or half of the shorter move where that is less
    inside = np.zeros(len(path), dtype=bool)
    for name, most_mm in corners.items():
        to_corner = np.linalg.norm(path - at(name), axis=1)
        inside |= to_corner <= most_mm / 1000.0 + NEAR_M
        assert to_corner.min() > 0.0005, name
    assert away[~inside].max() < NEAR_M
    assert one.motion.tcp_speed(taus[50:-50]).min() > 0.001
    assert one.motion.tcp_speed(taus).max() < 0.1 + 1e-6  # FC of the first line holds


# 2: an arc of two rounds


def test_h_wins_over_the_target_and_turns_twice_backwards() -> None:
    motions = planned("ML P1 F200\nMC P2 Q3 H-720")
    path = path_of(motions, 2)
    centre, radius = circle_through(*at("P1", "P3", "P2"))
    assert from_circle(path, centre, radius).max() < NEAR_M
    turned = np.unwrap(np.angle(path[:, 0] + 1j * path[:, 1] - centre))
    towards_q = np.angle((complex(*at("P3")[0, :2]) - centre) / (complex(*at("P1")[0, :2]) - centre))
    assert abs(turned[-1] - turned[0]) == pytest.approx(math.radians(720), abs=0.01)
    assert towards_q * (turned[-1] - turned[0]) != 0
    np.testing.assert_allclose(ends(motions)[-1], at("P1")[0], atol=NEAR_M)


# 3: splines


def test_splines_pass_their_points_tangentially_without_a_stop() -> None:
    (one,) = planned("MS P1 F100\nMS P2\nMS P3")
    np.testing.assert_allclose(ends([one]), at("P1", "P2", "P3"), atol=NEAR_M)
    around = one.motion.ends[:2, None] + np.array([-0.002, 0.0, 0.002])
    before, here, after = np.moveaxis(one.motion.pose(around)[..., :3, 3], 1, 0)
    coming, leaving = here - before, after - here
    assert np.linalg.norm(leaving, axis=1).min() > 1e-4
    cosine = (coming * leaving).sum(axis=1) / (np.linalg.norm(coming, axis=1) * np.linalg.norm(leaving, axis=1))
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.5
    assert one.motion.tcp_speed(one.motion.ends[:2]).min() > 0.02


# 4: a conveyor


def test_what_stands_between_trk_1_and_trk_0_follows_conveyor_1() -> None:
    text = """MJ P0 F100
TRK 1 //synchronize with Conveyor #1
ML P1 F100
ML P2 F100
TRK 0 //desynchronize from Conveyor #1
ML P3 F100
"""
    found = steps(text, 6)
    assert [type(each) for each in found] == [JointStep, TrackingOn, MoveLine, MoveLine, TrackingOff, MoveLine]
    assert found[1] == TrackingOn(2, "trk1")
    motions = planned(text)
    np.testing.assert_allclose(ends(motions)[-3:], at("P1", "P2", "P3"), atol=NEAR_M)


# 5: the tool follows the path


@pytest.mark.parametrize(("offset", "angle_deg"), [("", 0.0), (" H45", 45.0)])
def test_under_tang_the_tool_keeps_its_angle_to_the_path_and_behind_it_goes_to_that_of_the_point(
    offset: str, angle_deg: float
) -> None:
    motions = planned(TANG.format(offset))
    curve = next(each.motion for each in motions if 4 in each.lines and 9 in each.lines)
    taus = np.linspace(0.0, curve.duration_s, 1000)
    taus = taus[curve.tcp_speed(taus) > 0.02]
    poses = curve.pose(taus)
    way = curve.pose(taus + 1e-3)[:, :2, 3] - curve.pose(taus - 1e-3)[:, :2, 3]
    turned = np.angle((poses[:, 0, 1] + 1j * poses[:, 1, 1]) / (way[:, 0] + 1j * way[:, 1]))  # a tool that points down
    assert len(taus) > 500
    assert np.abs(np.degrees(turned) - angle_deg).max() < 0.5
    np.testing.assert_allclose(poses_on(motions, 11)[-1, :3, :3], HOME[:3, :3], atol=1e-4)  # as P8 has it
    np.testing.assert_allclose(ends(motions)[-1], at("P8")[0], atol=NEAR_M)


# 6: loops


def test_an_endless_loop_goes_round_with_tool_and_frame_on_each_line() -> None:
    text = LOOP + "ML P4 T1 Z1\nWAIT 2\nMC P2 Q5 T1 Z1\nGOTO LOOP //jump back to label"
    found = steps(text, 13)
    moves = [each for each in found if isinstance(each, MotionStep)][2:]
    assert [each.line for each in moves] == [4, 5, 6, 8, 4, 5, 6, 8]
    assert [each.aim.frame for each in moves if not isinstance(each, JointStep)] == 8 * ["z1"]
    assert [each for each in found if isinstance(each, Mount)] == [found[2]]  # T1 once: it is mounted then
    assert isinstance(found[6], Pause)
    motions = planned(text.replace("MJ P1", "MJ P1 T0"), taught_with("t1", "P2", "P3", "P4", "P5"), model=with_tools())
    path = path_of(motions, 8)
    assert from_circle(path, *circle_through(*at("P4", "P5", "P2"))).max() < NEAR_M
    assert sum(each.motion.duration_s for each in motions) > 59.0  # cut off


def test_a_counted_goto_goes_back_so_often() -> None:
    text = LOOP + "GOTO LOOP 5 //repeat this loop 5 times\nMJ P1 T0 F100\nEND"
    motions = planned(text, taught_with("t1", "P2", "P3"), model=with_tools())
    lines = [line for each in motions for line in each.lines if line]
    assert lines == [1, 2, *6 * [4, 5], 7] or lines == [2, *6 * [4, 5], 7]


# 7: subroutines


def test_a_subroutine_runs_once_or_three_times_and_comes_back() -> None:
    text = SUB.replace("ML P5 T2 Z2", "ML P5 T2 Z2 F1000").replace("ML P2", "ML P2 T0")
    motions = planned(text, taught_with("t2", "P5", "P6"), model=with_tools())
    lines = [line for each in motions for line in each.lines if line]
    assert lines[lines.index(2) :] == [2, 9, 10, 4, *3 * [9, 10]]


# 8: a branch


@pytest.mark.parametrize(("number_of_round", "target"), [(1, "P2"), (2, "P3")])
def test_an_input_by_its_number_decides_where_the_arm_goes(number_of_round: int, target: str) -> None:
    text = "ML P1 F100\nIF DI3\n  ML P2\nELSE\n  ML P3\nENDIF"
    ways = Ways()
    for _ in range(number_of_round):
        motions = planned(text, ways=ways)
    np.testing.assert_allclose(ends(motions)[-1], at(target)[0], atol=NEAR_M)
    assert [each.name for each in program(text).statements[1].signals] == ["part"]


# 9: which branch of the arm


@pytest.mark.parametrize(("line", "first_joint_deg"), [("MJ P2", -108.7), ("MJ P2 J1=0", 71.3)])
def test_a_joint_move_takes_the_nearest_branch_or_the_one_near_the_named_joint(
    line: str, first_joint_deg: float
) -> None:
    abc = tuple(math.radians(each) for each in (0.0, -10.0, -108.7))
    there = PosePoint((-0.3562732, -1.0525639, 3.1607179), (abc[0], abc[1], abc[2]))
    motions = planned(f"MJ J1=-100\n{line}", {"P2": there}, model=arm())
    end = motions[-1].motion.q(np.array(motions[-1].motion.duration_s))
    assert math.degrees(end[0]) == pytest.approx(first_joint_deg, abs=0.1)


# 10: a point in the origin of frames


ORIGIN: dict[str, Point] = {"P0": PosePoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))}


def test_the_origin_of_each_frame_is_reached() -> None:
    x, y, z = 1000.0 * HOME[:3, 3]
    places = [placed(name, x - 100, y + dy, z) for name, dy in zip(FRAMES, (-200.0, 0.0, 200.0), strict=True)]
    motions = planned("MJ P0 Z1 F100\nMJ P0 Z2\nMJ P0 Z3", ORIGIN, tuple(places))
    np.testing.assert_allclose(ends(motions)[-3:], [each.position_m for each in places], atol=NEAR_M)


def test_the_origin_of_its_own_base_is_out_of_reach_for_the_arm() -> None:
    assert refusal("MJ P0", ORIGIN).startswith("line 1")


def test_a_tool_holds_on_where_the_textbook_drops_it_at_the_end_of_the_line() -> None:
    text = SUB.replace("ML P5 T2 Z2", "ML P5 T2 Z2 F1000")
    points = taught_with("t2", "P5", "P6")
    _, failed = dry_run(Planner(PlacedRobot.at(with_tools()), 0.004), program(text, points), 60.0, STAY)
    assert failed is not None
    assert "point P2 was taught without a tool, mounted is t2" in failed.text


# What is wrong in a program, and what only looks so


def test_a_target_on_one_line_with_start_and_via_point_is_no_circle() -> None:
    points = POINTS | {"P2": beside(100, 0), "P1": beside(50, 0)}
    assert "line 1" in refusal("MC P2 Q1 F10", points)


def test_without_any_speed_a_path_move_is_refused() -> None:
    for text in ("ML P1", "MC P2 Q1 H-720", "MS P1\nMS P2"):
        assert [each.split(", allowed")[0] for each in problems(text)] == [f"1:1: found {text[:2]} without a speed"]


def test_the_speed_of_a_joint_move_is_percent_and_not_degrees_per_second() -> None:
    assert problems("HOME F300") == ["1:6: found F=300, allowed 0.01 to 100 percent for HOME"]


def test_z_with_a_number_behind_an_equals_sign_is_the_coordinate() -> None:
    found = steps("ML Z=2660 Z1 F100", 1)[0]
    assert isinstance(found, MoveLine)
    assert (found.position_m, found.aim.frame) == ((None, None, 2.66), "z1")


@pytest.mark.parametrize("words", ["T1", "T 1", "T=t1", "t1"])
def test_a_tool_is_a_statement_or_a_word_of_a_move(words: str) -> None:
    alone, on_line = steps(f"{words}\nML P1 F100", 2), steps(f"ML P1 {words.replace(' ', '')} F100", 2)
    assert [type(each) for each in alone] == [type(each) for each in on_line] == [Mount, MoveLine]
    assert on_line[1].line == 1


def test_a_tool_of_a_move_is_mounted_in_front_of_it_and_holds_on() -> None:
    found = steps("MJ P1 T1\nMJ P2\nMJ P3 T2\nMJ P1 T0", 7)
    tools = [each.mounted.tools for each in found if isinstance(each, Mount | JointStep)]
    assert tools == [("t1",), ("t1",), ("t1",), ("t2",), ("t2",), (), ()]


def test_an_unknown_tool_on_the_line_of_a_move_is_told_where_it_stands() -> None:
    assert problems("ML P1 T3 F100")[0].startswith("1:7: found unknown tool `T3`")
    assert problems("ML P1 T1 T2 F100")[0].startswith("1:10: found `T2`")


@pytest.mark.parametrize("words", ["M5", "M 5", "m5"])
def test_an_m_with_a_number_is_a_flag_and_no_move(words: str) -> None:
    answer = steps(words, 1)[0]
    assert isinstance(answer, AwaitAnswer)
    assert answer.flag == 5
    assert [type(each) for each in steps(f"MJ P1\n{words} ASYNC\nMJ P2", 1)[0].switches] == [FlagMark]


def test_speeds_by_their_letters_and_angles_with_a_sign() -> None:
    found = steps("ML P1 F100\nMC P2 Q3 FC80 FA30 H-720", 2)[1]
    assert isinstance(found, MoveArc)
    assert found.pace.speed_m_s == pytest.approx(0.08)
    assert found.pace.rotation_rad_s == pytest.approx(math.radians(30))
    assert found.angle_rad == pytest.approx(math.radians(-720))
    first = steps("MJ P2 J1=0", 1)[0]
    assert isinstance(first, JointStep)
    assert first.joints == (0.0, None, None, None, None, None)


@pytest.mark.parametrize("word", ["ML", "goto", "Wait", "END", "TRK", "M", "IF"])
def test_a_word_of_the_language_is_no_label(word: str) -> None:
    assert problems(f"{word}: WAIT 1")[0].endswith("allowed a name that is no word of the language")


def test_a_loop_in_which_no_time_passes_is_refused_before_it_runs() -> None:
    assert problems("L: GOTO L")[0].startswith("1:1: found a loop that neither moves nor waits")


def test_a_program_that_begins_in_its_middle_has_the_speed_of_the_lines_before() -> None:
    part = excerpt(program("ML P1 F100\nML P2\nML P3"), 2, None, dry=False)
    interpreter = Interpreter(part.program, begins=part.begins)
    second = interpreter.next()
    assert isinstance(second, MoveLine)
    assert second.pace.speed_m_s == pytest.approx(0.1)


def test_p0_is_a_point_like_others() -> None:
    np.testing.assert_allclose(ends(planned("MJ P1\nML P0 F100"))[-1], at("P0")[0], atol=NEAR_M)
    assert problems("ML P9 F100")[0].startswith("1:4: found unknown point `P9`")


@pytest.mark.parametrize("text", [LOOP, SUB, TANG.format(" H45"), "M5\nT 1\nTRK 1\nTRK 0\nIF DI3\nENDIF"])
def test_the_long_form_of_a_program_means_the_same(text: str) -> None:
    long = formatted(text)
    assert formatted(long) == long
    assert len(steps(long, 1)) == 1
