"""A tool that is changed: body, TCP and torques are those of the mounted one, whatever happens in between."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cell.messages import Enable, Load, Mode, ResetRobot, Run, SetPart, SetTool
from robot_agent.dynamics import axis_torques
from robot_agent.kinematics import SixAxis
from robot_agent.model import LinkMass, Mounted
from tests.unit.agent_runs import at_rest, ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.body_cover import covers
from tests.unit.robot_agent.agent.program.mounted_arm import (
    ARM,
    CHANGE,
    LANCE,
    PLATE,
    ROD,
    answer,
    capsules,
    failed,
    in_front_of_zone,
    pole,
    ready,
)


def with_tool(*names: str, arm: SixAxis = ARM) -> SixAxis:
    return SixAxis(replace(arm.description, mounted=Mounted(names)))


def running(program: str, **ready_with: object) -> AgentWorld:
    world = ready(program, **ready_with)  # type: ignore[arg-type]
    assert answer(world, Run()).ok
    return world


def test_body_and_tcp_are_those_of_the_mounted_tool_at_every_moment() -> None:
    world = running(CHANGE)
    models = {"gripper": with_tool("gripper"), "lance": with_tool("lance"), "": with_tool()}
    order: list[str] = []
    while not ended(world)():
        world.step()
        tool = world.state.tool
        assert tool is not None
        order += [tool] if order[-1:] != [tool] else []
        assert world.state.tcp_position_m is not None
        assert covers(world.presences[-1].body, models[tool].capsules(world.commanded), 1e-6)
        expected = models[tool].forward(world.commanded)[:3, 3]  # what is measured is some cycles old
        assert np.linalg.norm(world.state.tcp_position_m - expected) < 0.1
    assert order == ["gripper", "lance", "", "gripper"]
    assert [planned.mounted.tools for planned in world.planned] == [("gripper",), ("lance",), ()]


def test_after_a_change_lines_are_those_of_the_new_tools_tcp() -> None:
    start = np.radians([20.0, 10.0, 20.0, 15.0, 60.0, 10.0])
    x, y, z = (1000.0 * with_tool("lance").forward(start)[:3, 3]).tolist()
    joints = " ".join(f"J{n}={value:.6f}" for n, value in enumerate(np.degrees(start), 1))
    world = running(f"MJ {joints}\nT=lance\nML X={x:.6f} Y={y + 100.0:.6f} Z={z:.6f} F=100\nEND")
    until(world, ended(world))
    (line,) = (planned.motion for planned in world.planned if planned.lines == (3,))
    flange = ARM.links(line.q(np.linspace(0.0, line.duration_s, 200)))[:, -1]
    places = 1000.0 * (flange @ LANCE.pose_flange_tcp)[:, :3, 3]
    np.testing.assert_allclose(places[:, ::2], np.tile([x, z], (200, 1)), atol=2e-3)
    assert places[-1, 1] - places[0, 1] == pytest.approx(100.0, abs=1e-3)


def test_after_a_start_of_the_agent_the_body_has_all_tools_until_an_operator_says_which() -> None:
    world = ready(CHANGE, tool="")
    assert world.state.tool is None
    assert capsules(world.presences[-1]) == len(ARM.description.capsules) + 2
    refused = answer(world, Run())
    assert not refused.ok
    assert "`cell tool left gripper|lance|none`" in refused.text
    assert not answer(world, SetTool("torch")).ok
    assert answer(world, SetTool("lance")).ok
    until(world, lambda: world.state.tool == "lance")
    assert covers(world.presences[-1].body, with_tool("lance").capsules(world.commanded), 1e-6)
    assert answer(world, Run()).ok


def test_a_program_that_changes_no_tool_has_the_one_of_the_robot_file() -> None:
    world = running("MJ J1=10\nEND", tool="")
    assert world.state.tool == "gripper"
    until(world, ended(world))
    assert [planned.mounted for planned in world.planned] == [Mounted(("gripper",))]


def test_a_tool_stays_mounted_when_its_program_ends_and_in_a_fault() -> None:
    world = running("MJ J1=10\nT=lance\nMJ J1=40 F=10\nEND")
    until(world, lambda: world.commanded[0] > np.radians(20.0))
    world.quick_stop(0.001)
    until(world, lambda: world.state.mode is Mode.FAULT)
    assert world.state.tool == "lance"
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    until(world, at_rest(world))
    assert world.state.tool == "lance"
    assert covers(world.presences[-1].body, with_tool("lance").capsules(world.commanded), 1e-6)


def test_a_tool_that_reaches_into_a_zone_is_mounted_once_the_zone_is_granted() -> None:
    place = in_front_of_zone()
    world = running(f"MJ J2=-20 J3=30 J5=60\nMJ {place}\nT=lance\nWAIT 0.5\nMJ J2=-20 J3=30 J5=60\nEND")
    until(world, lambda: "zone handover" in world.state.waiting_for)
    until(world, at_rest(world))
    assert world.state.tool == "gripper"
    world.grant()
    until(world, lambda: world.state.tool == "lance")
    until(world, ended(world))


def test_a_tool_that_would_touch_a_thing_ends_the_program_by_line() -> None:
    world = running("MJ J1=10\nT=lance\nMJ J1=20\nEND", things=(pole(),))
    until(world, failed(world))
    assert "line 3: the tool comes" in world.state.program.error


def test_a_tool_is_changed_with_an_empty_gripper_only() -> None:
    arm = SixAxis(replace(ARM.description, parts={"rod": ROD, "plate": PLATE}))
    world = ready("MJ J1=10\nATTACH rod\nT=lance\nEND", arm=arm)
    refused = answer(world, Run())
    assert "`cell part left rod|plate|none`" in refused.text
    assert answer(world, SetPart(None)).ok
    assert answer(world, Run()).ok
    until(world, failed(world))
    assert "T=lance while the robot holds rod: DETACH comes first" in world.state.program.error
    assert (world.state.tool, world.state.part) == ("gripper", "rod")


def test_the_torques_are_those_with_the_mounted_tool() -> None:
    masses = tuple(LinkMass(link, 5.0, (0.1, 0.02, 0.0), 0.01 * np.eye(3), "a test") for link in range(1, 7))
    arm = SixAxis(replace(ARM.description, masses=masses))
    carrying = {name: axis_torques(with_tool(name, arm=arm), np.eye(4)) for name in ("gripper", "lance")}
    world = AgentWorld("MJ J1=10\nT=lance\nMJ J1=20\nEND", arm=arm)
    world.torques = True
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    assert answer(world, SetTool("gripper")).ok
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    seen = set()
    while not ended(world)():
        before = len(world.blocks)
        world.step()
        for block in world.blocks[before:]:
            torques = carrying[world.state.tool or ""]
            assert torques is not None
            assert block.torque is not None
            np.testing.assert_allclose(block.torque[-1], torques.standing(block.position[-1:])[0], atol=1e-6)
            seen.add(world.state.tool)
    assert seen == {"gripper", "lance"}


def test_a_program_without_tools_runs_only_where_the_tool_is_known_that_the_one_before_changes(tmp_path: Path) -> None:
    (tmp_path / "still.prog").write_text("ML X=1200 Y=0 Z=1500 A=0 B=180 C=0 F=100\nEND\n")
    world = ready(CHANGE, tool="", points_file=tmp_path / "left.points.yaml")
    assert answer(world, Load("still.prog")).ok
    assert answer(world, Run()).text == (
        "left cannot run its program, which moves the TCP of its tool: nobody has said which tool is mounted since "
        "its agent was started; look, then `cell tool left gripper|lance|none`"
    )
