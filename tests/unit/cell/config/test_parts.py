"""Tools and parts in the robot file: what they mean, their mistakes, and programs that change them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.motions import check_motions
from robot_agent.kinematics import load_model, model_of
from robot_agent.model import Mounted, RobotDescription, load_description
from robot_agent.workspace import PlacedRobot, part_of
from tests.unit.config_world import CELL, ROBOT, Copy

GRIP = "tcp: {X: 100, Y: 0, Z: 0, A: 0, B: 0, C: 90}, capsules: [{start: [0, 0, 0], end: [90, 0, 0], radius: 40}]"
CASTING = "casting: {mass_kg: 4, centre: [50, 0, 0], capsules: [{start: [0, 0, 0], end: [0, -300, 0], radius: 60}]}"


def with_parts(folder: Path, *parts: str) -> Copy:
    """The example with these parts for its robots."""
    return Copy(folder).add(ROBOT, f"tools: {{grip: {{{GRIP}}}}}\ntool: grip\nparts: {{{', '.join(parts)}}}\n")


def found(copy: Copy, program: str) -> list[str]:
    """What `cell check` says of robot `left` with this program."""
    (copy.folder / "two_arms" / "programs" / "left.prog").write_text(program)
    bundle, problems = check_cell(copy.cell)
    if bundle is not None:
        problems = [*problems, *check_motions(bundle)[1]]
    return [str(problem) for problem in problems if "left.prog" in str(problem)]


def holding(description: RobotDescription, *parts: str) -> RobotDescription:
    return replace(description, mounted=replace(description.mounted, parts=parts))


def test_a_part_is_held_at_the_tcp(tmp_path: Path) -> None:
    description = load_description(with_parts(tmp_path, CASTING).robot)
    assert description.parts["casting"].mass_kg == 4.0
    bare, model = model_of(description), model_of(holding(description, "casting"))
    q = model.home + 0.1
    np.testing.assert_array_equal(model.capsules(q)[:-1], bare.capsules(q))
    start, end = model.capsules(q)[-1]
    np.testing.assert_allclose(start, model.forward(q)[:3, 3], atol=1e-12)
    np.testing.assert_allclose(end, (model.forward(q) @ [0.0, -0.3, 0.0, 1.0])[:3], atol=1e-12)
    assert model.capsule_radii[-1] == 0.06
    assert (part_of(model, len(bare.body) - 1), part_of(model, len(bare.body))) == ("tool", "part casting")


def test_without_a_tool_a_part_is_held_at_the_flange(tmp_path: Path) -> None:
    copy = Copy(tmp_path).add(ROBOT, f"parts: {{{CASTING}}}\n")
    model = model_of(holding(load_description(copy.robot), "casting"))
    np.testing.assert_allclose(model.capsules(model.home)[-1][0], model.forward(model.home)[:3, 3], atol=1e-12)


@pytest.mark.parametrize(
    ("part", "problem"),
    [
        (CASTING.replace("casting", "flange"), "a part with the name flange"),
        (CASTING.replace("casting", "none"), "a part with the name none"),
        (CASTING.replace("casting", "two words"), "two words"),
        ("casting: {mass_kg: 4}", "capsules"),
        (CASTING.replace("centre:", "inertia_kg_m2: [1, 1, 3, 0, 0, 0], centre:"), "none above the sum of the others"),
    ],
)
def test_a_part_that_cannot_be_is_refused(tmp_path: Path, part: str, problem: str) -> None:
    bundle, problems = check_cell(with_parts(tmp_path, part).cell)
    assert bundle is None
    assert any(problem in str(each) for each in problems), problems


def test_a_part_may_touch_what_names_it(tmp_path: Path) -> None:
    copy = with_parts(tmp_path, CASTING)
    table = "{box: [10, 10, 10], pose: {X: 0, Y: 9000, Z: 0, A: 0, B: 0, C: 0}, may_touch: {left: [casting, brick]}}"
    _, problems = check_cell(copy.add(CELL, f"things: {{post: {table}}}").cell)
    assert [str(each) for each in problems if "may_touch" in str(each) and "'brick'" in str(each)]
    assert not [str(each) for each in problems if "'casting'" in str(each)]


@pytest.mark.parametrize(
    ("program", "problem"),
    [
        ("ATTACH brick\nHOME", "left.prog:1:8: program: found unknown part `brick`, allowed only casting"),
        ("ATTACH\nHOME", "ATTACH and the name of a part"),
        ("DETACH casting\nHOME", "nothing: the robot holds one part at most"),
        ("HOME\nATTACH casting\nATTACH casting\nHOME", "left.prog:3:1"),
        ("HOME\nDETACH\nDETACH\nHOME", "DETACH while the robot holds no part: ATTACH comes first"),
        ("HOME\nLABEL a\nATTACH casting\nMJ J1=5\nGOTO a", "ATTACH casting while the robot holds casting"),
    ],
)
def test_what_cannot_be_attached_or_detached_is_found_before_a_robot_moves(
    tmp_path: Path, program: str, problem: str
) -> None:
    told = found(with_parts(tmp_path, CASTING), program)
    assert any(problem in each for each in told), told


def test_a_robot_without_parts_names_where_they_would_be(tmp_path: Path) -> None:
    (told,) = found(Copy(tmp_path), "HOME\nATTACH casting")
    assert "this robot has none in its robot file" in told


def test_programs_are_checked_with_what_is_held_then(tmp_path: Path) -> None:
    copy = with_parts(tmp_path, CASTING)
    model = load_model(copy.robot)
    end = model.forward(model.home + np.radians([20.0, 0, 0, 0, 0, 0])) @ [0.0, -0.3, 0.0, 1.0]
    x, y, z = 1000.0 * end[:3] + [-1800.0, 0.0, 0.0]  # the base of `left`
    pose = f"{{X: {x:.1f}, Y: {y:.1f}, Z: {z:.1f}, A: 0, B: 0, C: 0}}"
    copy.add(CELL, f"things: {{post: {{sphere: 20, pose: {pose}}}}}")
    go = "MJ J1=40\nHOME\n"
    free = found(copy, f"HOME\n{go}")
    assert not [each for each in free if "post" in each], free
    (told,) = found(copy, f"HOME\n{go}ATTACH casting\n{go}")
    assert "left.prog:5:1" in told
    assert "the part casting comes" in told
    (told,) = found(copy, f"HOME\n{go}DETACH\nHOME\n")
    assert "left.prog:2:1" in told


def test_a_rest_for_a_part_is_one_that_the_program_asks_for(tmp_path: Path) -> None:
    copy = with_parts(tmp_path, CASTING)
    (copy.folder / "two_arms" / "programs" / "left.prog").write_text("HOME\nMJ J1=5\nATTACH casting\nMJ J1=0\nHOME\n")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    (left, _) = check_motions(bundle)[0]
    assert left.rests == (1, 4)  # and not 2


LANCE = (
    "lance: {tcp: {X: 300, Y: 0, Z: 0, A: 0, B: 0, C: 0}, capsules: [{start: [0, 0, 0], end: [300, 0, 0], radius: 40}]}"
)


def with_tools(folder: Path, mounted: str = "tool: grip\n") -> Copy:
    """The example with two tools for its robots."""
    return Copy(folder).add(ROBOT, f"tools: {{grip: {{{GRIP}}}, {LANCE}}}\n{mounted}")


@pytest.mark.parametrize(
    ("program", "problem"),
    [
        (
            "HOME\nT=torch",
            "left.prog:2:1: program: found unknown tool `torch`, allowed one of T0, grip, lance",
        ),
        ("HOME\nT5", "left.prog:2:1: program: found unknown tool `T5`"),
        ("HOME\nT=lance\nML X=9000 F=100", "left.prog:3:1"),
    ],
)
def test_what_a_program_cannot_mount_is_found_before_a_robot_moves(tmp_path: Path, program: str, problem: str) -> None:
    told = found(with_tools(tmp_path), program)
    assert any(problem in each for each in told), told


@pytest.mark.parametrize(("tool", "mounted"), [("lance", ("lance",)), ("none", ()), (None, ("grip",))])
def test_robots_of_one_robot_file_begin_with_the_tools_of_the_cell_file(
    tmp_path: Path, tool: str | None, mounted: tuple[str, ...]
) -> None:
    copy = with_tools(tmp_path)
    if tool is not None:
        copy.change(CELL, "program: programs/left.prog", f"program: programs/left.prog\n    tool: {tool}")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    robots = {side: PlacedRobot.of(bundle.cell.robots[side]) for side in ("left", "right")}
    for model in (robots["left"].model, bundle.robots["left"].model):
        assert model.description.mounted.tools == mounted
    assert robots["right"].model.description.mounted.tools == ("grip",)
    assert set(robots["left"].mountings) == set(bundle.robots["left"].mountings)


def test_a_tool_of_the_cell_file_that_the_robot_file_does_not_have_is_told(tmp_path: Path) -> None:
    copy = with_tools(tmp_path)
    copy.change(CELL, "program: programs/left.prog", "program: programs/left.prog\n    tool: torch")
    bundle, problems = check_cell(copy.cell)
    assert bundle is None
    (told,) = [str(each) for each in problems]
    assert told.endswith(
        "robots.left.tool: found unknown tool 'torch', allowed a tool of its robot file, or none: grip, lance, none"
    )


@pytest.mark.parametrize("name", ["none", "T0", "two words"])
def test_a_tool_whose_name_means_no_tool_is_refused(tmp_path: Path, name: str) -> None:
    copy = Copy(tmp_path).add(ROBOT, f"tools: {{{LANCE.replace('lance', name)}}}\n")
    bundle, problems = check_cell(copy.cell)
    assert bundle is None
    assert any(name in str(each) for each in problems), problems


def test_moves_are_checked_with_the_tool_that_is_mounted_then(tmp_path: Path) -> None:
    copy = with_tools(tmp_path)
    description = load_description(copy.robot)
    model = model_of(replace(description, mounted=Mounted(("lance",))))
    x, y, z = (1000.0 * model.forward(model.home)[:3, 3]).tolist()
    lines = f"HOME\nT=lance\nML X={x:.3f} Y={y:.3f} Z={z:.3f} F=100\n"
    (copy.folder / "two_arms" / "programs" / "left.prog").write_text(f"{lines}ML Z={z - 50.0:.3f}\nT0\nHOME\n")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    (left, _), told = check_motions(bundle)
    assert left.moves == 4
    assert not [each for each in told if "left.prog" in str(each)]
