"""Points and frames in the text of a program, and where they send the robot when the program comes to them."""

import math

import pytest

from cell.config.points_file import JointPoint, Point, PosePoint, Signal, SignalKind
from robot_agent.language import (
    Aim,
    Goal,
    Interpreter,
    JointStep,
    MoveArc,
    MoveLine,
    Names,
    Points,
    Program,
    ProgramError,
    ProgramFault,
    Step,
    Switch,
    SwitchNow,
    parse_program,
)

JOINTS = ("J1", "J2")
PICK = PosePoint((0.6, 0.0, 0.4), (math.pi, 0.0, 0.0), "fixture")
FREE = PosePoint((0.1, 0.2, 0.3), (0.0, 0.0, 0.0), tool="gripper", branch="UP")
UP = JointPoint((0.1, 0.2))
TAUGHT: dict[str, Point] = {"pick": PICK, "P1": FREE, "P2": FREE, "up": UP}
SIGNALS = {"clamp": Signal(SignalKind.OUTPUT, "gripper", 0.5)}


def program(text: str, points: Points | None = None) -> Program:
    points = points or Points(TAUGHT)
    names = Names(JOINTS, frames=("fixture", "z1"), points=points, signals=SIGNALS, outputs=("gripper",))
    return parse_program(text, "p", names)


def steps(text: str) -> list[Step]:
    interpreter = Interpreter(program(text))
    return [interpreter.next() for _ in text.splitlines()]


def step(text: str) -> Step:
    return steps(text)[0]


def problems(text: str) -> list[str]:
    with pytest.raises(ProgramError) as refused:
        program(text)
    return [str(problem) for problem in refused.value.problems]


def line(text: str) -> MoveLine:
    found = step(text)
    assert isinstance(found, MoveLine)
    return found


@pytest.mark.parametrize("text", ["ML P1 F=100", "ml p1 f=9999", "ML P=P1 F=9999", "ML P = P1 F=9999", "ML P=1 F=9999"])
def test_a_point_is_named_or_numbered(text: str) -> None:
    found = line(text)
    assert (found.position_m, found.orientation_abc) == (FREE.position_m, FREE.orientation_abc)
    assert found.aim == Aim("P1", "", "UP", "gripper")


def test_a_point_is_in_its_frame_unless_its_line_names_another() -> None:
    assert [line(f"ML P=pick{frame} F=9999").aim.frame for frame in ("", " Z=z1", " Z1", " z0")] == [
        "fixture",
        "z1",
        "z1",
        "",
    ]
    active = steps("Z=z1\nML P=pick F=9999\nML P1\nML X=1\nML X=1 Z0\nML X=1 Z=5\nZ0\nML X=1")
    assert [each.aim.frame for each in active if isinstance(each, MoveLine)] == ["fixture", "z1", "z1", "", "z1", ""]


def test_a_name_after_z_is_a_frame_and_a_number_the_coordinate() -> None:
    found = line("ML X=1 Z=2660 Z=fixture F=9999")
    assert (found.position_m, found.aim.frame) == ((0.001, None, 2.66), "fixture")


def test_a_line_to_a_joint_point_goes_to_its_pose_and_a_joint_move_to_its_joints() -> None:
    assert line("ML P=up F=9999").aim.joints == UP.joints
    assert step("MJ P=up F=50") == JointStep(1, UP.joints, 0.5)


def test_a_joint_move_to_a_pose_takes_joints_as_reference_values_and_a_branch() -> None:
    found = step("MJ P=pick J1=90 BRANCH=front/down F=50")
    goal = Goal(PICK.position_m, PICK.orientation_abc, Aim("pick", "fixture", "FRONT/DOWN"))
    assert found == JointStep(1, (math.pi / 2.0, None), 0.5, goal=goal)
    named = step("MJ X=100 Z=fixture")
    assert isinstance(named, JointStep)
    assert named.goal == Goal((0.1, None, None), None, Aim(frame="fixture"))


def test_an_arc_takes_points_for_its_target_and_its_via_point() -> None:
    found = step("MC P2 Q1 H=-720 F=9999")
    assert isinstance(found, MoveArc)
    assert (found.via_position_m, found.via_aim.point, found.aim.point) == (FREE.position_m, "P1", "P2")
    mixed = step("MC Q=pick X=1 Y=2 F=9999")
    assert isinstance(mixed, MoveArc)
    assert (mixed.via_aim.frame, mixed.aim.frame, mixed.position_m) == ("fixture", "", (0.001, 0.002, None))


def test_home_goes_to_the_point_of_that_name_where_there_is_one() -> None:
    points = Points()
    home = Interpreter(program("LABEL a\nHOME F=50\nGOTO a", points))
    assert home.next() == JointStep(2, None, 0.5)
    points.named = {"HOME": UP}
    assert isinstance(home.next(), JointStep)  # the program had come to this one already
    assert home.next() == JointStep(2, UP.joints, 0.5)
    points.named = {"HOME": PosePoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))}
    home.next()
    pose = home.next()
    assert isinstance(pose, JointStep)
    assert pose.goal is not None
    assert pose.goal.aim.frame == ""


def test_a_point_that_is_taught_anew_counts_where_the_program_comes_to_it() -> None:
    points = Points(TAUGHT)
    interpreter = Interpreter(program("LABEL a\nML P1 F=9999\nWAIT 1\nGOTO a", points))
    first = interpreter.next()
    points.named = {"P1": PICK}
    interpreter.next()
    second = interpreter.next()
    assert isinstance(first, MoveLine)
    assert isinstance(second, MoveLine)
    assert (first.position_m, second.position_m) == (FREE.position_m, PICK.position_m)


def test_a_point_that_is_gone_ends_the_program_by_its_line() -> None:
    points = Points(TAUGHT)
    interpreter = Interpreter(program("WAIT 1\nML P=pick F=9999", points))
    interpreter.next()
    points.named = {"pic": UP}
    assert interpreter.next() == ProgramFault(2, "no point pick in the points file any more, but pic")


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("ML P=up Z=fixture F=9999", "point up is given by joints, without frame and branch: leave Z out"),
        ("MJ P=up J1=0", "point up is given by joints, so there is no branch to choose: leave the joints out"),
    ],
)
def test_what_a_joint_point_cannot_have_ends_the_program(text: str, fault: str) -> None:
    assert step(text) == ProgramFault(1, fault)


def test_under_tang_a_point_says_the_place_and_the_path_the_orientation() -> None:
    interpreter = Interpreter(program("TANG 1\nMS P=pick F=9999"))
    found = interpreter.next()
    assert getattr(found, "tangential_rad", None) == 0.0


def test_another_name_of_an_output_switches_that_output() -> None:
    found = step("SET DO clamp")
    assert found == SwitchNow(1, (Switch(1, "gripper", True, 1),))


def test_all_unknown_names_are_told_at_once_each_with_the_nearest() -> None:
    assert problems("ML P=pik F=9999\nMC Q7 P1\nZ=fixtur\nML X=1 Z2") == [
        "1:4: found unknown point `pik`, allowed pick; there are also P1, P2, up",
        "2:4: found unknown point `P7`, allowed one of P1, P2, pick, up",
        "3:1: found unknown frame `fixtur`, allowed fixture; there are also z1; Z0 is the base",
        "4:8: found unknown frame `z2`, allowed one of fixture, z1; Z0 is the base",
    ]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("ML P1 X=5 F=9999", "1:1: found X beside the point P1, allowed a point or coordinates"),
        ("ML P1 P2 F=9999", "1:7: found `P2`, a second point, allowed each once"),
        ("ML P1 Z0 Z=fixture F=9999", "1:10: found `Z=fixture`, a second frame, allowed each once"),
        ("ML P1 Q2 F=9999", "1:7: found `Q2`, allowed a via point on MC only"),
        ("MC P1 Q2 QX=5 F=9999", "1:1: found QX beside the via point P2, allowed Q=point, or its coordinates"),
        ("MJ J1=5 Z=fixture", "1:1: found a frame without a pose"),
        ("MJ J1=5 BRANCH=UP", "1:1: found BRANCH without a pose, allowed BRANCH beside P or X Y Z A B C"),
        ("Z=5", "1:1: found `Z=5`, allowed a frame alone in its line: Z=name, Z1, or Z0 for the base"),
        ("Z=fixture X=5", "1:11: found `X=5`, allowed a frame alone in its line"),
        ("ML Z=nan F=9999", "1:4: found `nan`, allowed a finite number"),
        ("P1", "1:1: found `P1`, allowed one of "),
        ("ML P" + 5000 * "1", "1:4: found `P111"),
        ("ML P=\u00b2 F=9999", "1:4: found unknown point `\u00b2`"),
        ("Z" + 5000 * "1", "1:1: found `Z111"),
        ("ML X=1 Z\u0663 F=9999", "1:8: found `Z\u0663`"),
    ],
)
def test_what_does_not_go_together_is_refused(text: str, problem: str) -> None:
    assert problems(text)[0].startswith(problem)


def test_a_program_knows_the_frames_that_it_may_come_to() -> None:
    assert program("ML P1 F=9999\nZ0").frames == {"fixture"}
    assert program("ML P1 F=9999\nML X=1 Z1").frames == {"fixture", "z1"}


def test_a_joint_that_is_called_like_a_coordinate_is_the_joint() -> None:
    gantry = Names(("X", "Z"), linear={"X", "Z"}, points=Points(TAUGHT))
    found = Interpreter(parse_program("MJ X=100 Z=200", "p", gantry)).next()
    assert found == JointStep(1, (0.1, 0.2), 1.0)
