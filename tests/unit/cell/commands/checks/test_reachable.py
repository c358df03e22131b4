"""What a program tells a robot to do and it cannot: found before it runs, as far as that can be told."""

from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.reachable import unreachable_lines
from robot_agent.kinematics import Model
from robot_agent.language import Names, parse_program
from tests.unit.config_world import CELL, ROBOT, Copy
from tests.unit.six_axis_arm import arm

PROGRAM = "two_arms/programs/left.prog"
ARM = arm()


def found(text: str, model: Model = ARM) -> list[tuple[int, str]]:
    return list(unreachable_lines(model, parse_program(text, "p", Names(model.joint_names))))


def test_a_line_that_leaves_the_reach_is_named_with_the_place() -> None:
    (line, why), *rest = found("HOME\nMJ J5=60\nML X=5000 F=9999")
    assert line == 3
    assert not rest
    assert why.startswith("at X ")
    assert "too far" in why


def test_a_target_with_all_coordinates_is_judged_before_the_start_is_known() -> None:
    ((line, why),) = found("ML X=9000 Y=0 Z=0 A=0 B=0 C=0 F=9999\nML Z=2000")
    assert line == 1
    assert "too far" in why


def test_both_ways_of_each_fork_are_gone() -> None:
    asks = "HOME\nMJ J5=60\nIF DI a\nIF n < 3\nML X=5000 F=9\nELSE\nML X=-5e3\nENDIF\nELSE\nML X=6000\nENDIF\nLET n = 1"
    out = "HOME\nMJ J5=60\nWAIT DI a TIMEOUT 5 GOTO late\nML X=5000 F=9999\nEND\nLABEL late\nML X=6000"
    assert sorted(line for line, _ in found(asks)) == [5, 7, 10]
    assert sorted(line for line, _ in found(out)) == [4, 7]
    assert [line for line, _ in found("HOME\nMJ J5=60\nLOOKAHEAD 1\nIF DI a\nENDIF\nML X=5000 F=9999")] == [6]


def test_what_depends_on_an_unknown_start_is_not_judged() -> None:
    assert found("ML X=3000 F=9999\nMJ J1=10\nML Z=3000") == []


def test_a_coordinate_beyond_all_reach_needs_no_known_start() -> None:
    within, beyond = 1000 * ARM.reach_m - 1, 1000 * ARM.reach_m + 1
    ((line, why),) = found(f"ML X={within} F=9999\nML Y=-{beyond}\nML X={within / 2**0.5 - 1} Z={within / 2**0.5 - 1}")
    assert (line, why.split(", ")[0]) == (2, f"at least {beyond:.0f} mm from the base")


@pytest.mark.parametrize(
    ("text", "line", "why"),
    [
        ("HOME\nTANG 1\nML X=1000 A=0 B=0 C=0 F=9999", 3, "leave them out, or TANG 0"),
    ],
)
def test_what_fails_wherever_the_robot_is_is_named(text: str, line: int, why: str) -> None:
    ((found_line, text_found),) = found(text)
    assert (found_line, text_found[-len(why) :]) == (line, why)


def test_a_joint_target_outside_the_limits_is_named() -> None:
    ((line, why),) = found("MJ J3=181")
    assert (line, why) == (1, "joint J3 would need 181.00 deg, allowed -180.00 to 180.00")


def test_behind_a_failure_nothing_is_judged_until_the_joints_are_known_again() -> None:
    lines = [line for line, _ in found("HOME\nMJ J5=60\nML X=9000 F=9999\nML Z=3000\nHOME\nMJ J5=60\nML Z=9000")]
    assert lines == [3, 7]


def test_loops_are_walked_until_nothing_new_comes() -> None:
    assert found("HOME\nLABEL again\nMJ J5=60\nML Z=2000 F=9999\nGOTO again") == []
    ((line, _),) = found(
        "HOME\nMJ J5=60\nLABEL again\nMJ J1=10 F=5\nML Z=9000 F=9999\nHOME\nMJ J5=60\nGOTO again 1000000"
    )
    assert line == 5


def test_a_line_through_a_singular_pose_is_a_problem_too() -> None:
    straight_through = "MJ J1=0 J2=-20 J3=30 J4=0 J5=30 J6=0\nML A=0 B=-30 C=0 F=9999"
    ((line, why),) = found(straight_through, arm(position_deg=720))
    assert line == 2
    assert "near a singularity" in why


def test_the_path_is_followed_with_its_turns() -> None:
    start = np.degrees(ARM.solve(ARM.forward(np.radians([10, -20, 30, 40, 60, 20]))))
    text = "MJ " + " ".join(f"J{i + 1}={value:.6f}" for i, value in enumerate(start))
    assert found(f"{text}\nML X=1500 Y=0 Z=1500 F=9999\nML Y=300\nML X=1200") == []


def test_cell_check_names_the_program_and_the_line(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(PROGRAM, "ML X=980 F=900", "ML X=2980 F=900")
    bundle, problems = check_cell(copy.cell)
    assert bundle is None
    (problem,) = problems
    assert copy.shown(problem).startswith(f"{PROGRAM}:14:1: program: found 'ML X=2980 F=900': at X ")
    assert "too far, allowed what BOOK6 can do from where it is then" in str(problem)


@pytest.mark.parametrize(
    ("name", "old", "new", "expected"),
    [
        (CELL, "X: 1800", "X: -600",
         "two_arms/cell.yaml:24:5: robots.right.base: found right at home 310 mm deep in left at home: link 3 of "
         "right, link 4 of left, allowed a base, or a home position, at which right and left are apart"),
    ],
)  # fmt: skip
def test_bodies_that_overlap_at_home_are_named(tmp_path: Path, name: str, old: str, new: str, expected: str) -> None:
    copy = Copy(tmp_path).change(name, old, new)
    _, problems = check_cell(copy.cell)
    assert expected in [copy.shown(problem) for problem in problems]


def test_a_robot_file_with_problems_is_not_walked(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(ROBOT, "a3z: 1100", "a3z: 0").change(PROGRAM, "ML X=980 F=900", "ML X=2980 F=900")
    _, problems = check_cell(copy.cell)
    assert {problem.file.name for problem in problems} == {"six_axis.yaml"}
