"""Points are taught where the robot is measured, written into their file, gone to, and taken by the program."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from cell.config.points_file import JointPoint, PosePoint
from cell.geometry import to_xyz_abc
from cell.messages import (
    Command,
    Enable,
    FramePose,
    Go,
    Heard,
    Jog,
    JogFrame,
    JogHeld,
    ListPoints,
    Mode,
    PointKind,
    Reply,
    Run,
    Teach,
)
from robot_agent.language import Points
from tests.unit.agent_runs import until
from tests.unit.agent_world import AgentWorld
from tests.unit.six_axis_arm import arm

ARM = arm()
HERE = np.radians([5.0, 0.0, 20.0, 0.0, 40.0, 0.0])
ASIDE = np.radians([25.0, 5.0, 25.0, 5.0, 45.0, 5.0])
TABLE = FramePose("table", 7, None, (1.0, 0.5, 0.0), (0.0, 0.0, math.sin(0.15), math.cos(0.15)))
POSE = Teach("pick", PointKind.POSE, None, replace=False)


def standing(folder: Path, points: Points | None = None, program: str = "WAIT 1") -> AgentWorld:
    world = AgentWorld(program, points=points, points_file=folder / "left.points.yaml")
    world.commanded = HERE.copy()
    world.frames = (TABLE,)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    return world


def answer(world: AgentWorld, command: Command) -> Reply:
    call = world.call(command)
    until(world, lambda: call in world.replies)
    return world.replies[call]


def test_a_pose_is_kept_in_its_frame_and_the_program_has_it_at_once(tmp_path: Path) -> None:
    points = Points()
    world = standing(tmp_path, points)
    reply = answer(world, Teach("pick", PointKind.POSE, "table", replace=False))
    assert (reply.ok, reply.text) == (
        True,
        "left: pick is written; the program takes it where it comes to it from now on",
    )
    point = points.named["pick"]
    assert isinstance(point, PosePoint)
    assert (point.frame, point.tool) == ("table", None)
    pose_world_table = np.array([[math.cos(0.3), -math.sin(0.3)], [math.sin(0.3), math.cos(0.3)]])
    place = ARM.forward(HERE)[:3, 3]
    np.testing.assert_allclose(point.position_m[:2], pose_world_table.T @ (place[:2] - (1.0, 0.5)), atol=1e-7)
    assert point.position_m[2] == pytest.approx(place[2], abs=1e-7)
    assert "frame: table" in (tmp_path / "left.points.yaml").read_text()
    until(world, lambda: world.state.frames == {"table": 7})


def test_a_point_is_not_lost_by_a_second_one_of_its_name(tmp_path: Path) -> None:
    world = standing(tmp_path, points := Points({"pick": PosePoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), "table")}))
    (tmp_path / "left.points.yaml").write_text(
        "points: {pick: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0, frame: table}} # mine\n"
    )
    refused = answer(world, POSE)
    assert not refused.ok
    assert refused.text.startswith(
        "pick is taught already: X 0.00 Y 0.00 Z 0.00 A 0.000 B 0.000 C 0.000 in table; now at"
    )
    assert answer(world, Teach("pick", PointKind.POSE, None, replace=True)).ok
    kept = points.named["pick"]
    assert isinstance(kept, PosePoint)
    assert kept.frame == "table"
    assert (tmp_path / "left.points.yaml").read_text().endswith("}} # mine\n")


def test_joints_are_kept_as_they_are_measured(tmp_path: Path) -> None:
    world = standing(tmp_path, points := Points())
    assert answer(world, Teach("up", PointKind.JOINTS, None, replace=False)).ok
    kept = points.named["up"]
    assert isinstance(kept, JointPoint)
    np.testing.assert_allclose(kept.joints, HERE, atol=1e-8)
    assert answer(world, ListPoints()).text == "up: J1=5.0000 J2=0.0000 J3=20.0000 J4=0.0000 J5=40.0000 J6=0.0000"
    assert json.loads(answer(world, ListPoints()).data)["up"]["joints"][0] == pytest.approx(math.radians(5.0))


@pytest.mark.parametrize(
    ("command", "why"),
    [
        (Teach("1a", PointKind.POSE, None, replace=False), "the name '1a' found, allowed are up to 32 letters"),
        (Teach("a", PointKind.POSE, "tabel", replace=False), "unknown frame 'tabel', allowed table"),
        (Teach("a", PointKind.JOINTS, "table", replace=False), "joints are in no frame"),
        (Go("press", "pik"), "left is in mode disabled"),
    ],
)
def test_what_cannot_be_taught_is_refused(tmp_path: Path, command: Command, why: str) -> None:
    reply = answer(standing(tmp_path), command)
    assert (reply.ok, reply.text[: len(why)]) == (False, why)


def test_a_file_that_somebody_has_spoilt_is_left_alone(tmp_path: Path) -> None:
    world = standing(tmp_path, points := Points())
    (tmp_path / "left.points.yaml").write_text("points: [\n")
    reply = answer(world, POSE)
    assert not reply.ok
    assert reply.text.startswith("pick is not written: the points file is refused as it is now: ")
    assert (points.named, (tmp_path / "left.points.yaml").read_text()) == ({}, "points: [\n")


def test_nothing_is_taught_while_the_robot_moves(tmp_path: Path) -> None:
    world = standing(tmp_path, program="MJ J1=60 F=10")
    enabled(world)
    world.call(Run())
    until(world, lambda: world.state.joints is not None and world.state.joints[0] > HERE[0] + 0.1)
    assert answer(world, POSE).text == "left moves: teach it where it stands"


def enabled(world: AgentWorld) -> None:
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)


def held(world: AgentWorld, press: str, seconds: float) -> None:
    for _ in range(round(seconds / 0.02)):
        world.agent.receive(JogHeld("left", press, True, Heard(world.state.boot, world.state.sequence)), world.now)
        world.step()
        if world.state.mode is Mode.READY:
            return


def test_a_robot_goes_to_a_point_straight_and_slowly_while_the_key_is_held(tmp_path: Path) -> None:
    x, y, z, a, b, c = to_xyz_abc(ARM.forward(ASIDE)).tolist()
    world = standing(tmp_path, Points({"aside": PosePoint((x, y, z), (a, b, c))}))
    enabled(world)
    assert answer(world, Go("press", "aside")).text == "left goes to aside while the key is held"
    before = len(world.played)
    held(world, "press", 30.0)
    way = np.array(world.played[before:])
    np.testing.assert_allclose(way[-1], ASIDE, atol=2e-6)
    along = (ASIDE - HERE) / np.linalg.norm(ASIDE - HERE)
    beside = (way - HERE) - np.outer((way - HERE) @ along, along)
    assert np.abs(beside).max() < 1e-6
    speeds = np.linalg.norm(np.diff(ARM.forward(way)[:, :3, 3], axis=0), axis=1) / 0.004
    assert 0.2 < speeds.max() <= 0.25 + 1e-6
    assert answer(world, Go("again", "aside")).text == "left is at aside already"


def test_a_robot_stops_on_its_way_to_a_point_when_the_key_is_let_go(tmp_path: Path) -> None:
    world = standing(tmp_path, Points({"aside": JointPoint(tuple(ASIDE.tolist()))}))
    enabled(world)
    world.call(Go("press", "aside"))
    held(world, "press", 0.6)
    until(world, lambda: world.state.mode is Mode.READY)
    assert HERE[0] < world.played[-1][0] < ASIDE[0] - 0.01


@pytest.mark.parametrize(
    ("point", "why"),
    [
        (JointPoint((4.0, 0.0, 0.0, 0.0, 0.0, 0.0)), "left does not get to far: joint J1 would need 229.18 deg"),
        (PosePoint((9.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "left does not get to far: the TCP cannot be at X 9000.0"),
        (
            PosePoint((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), tool="saw"),
            "left does not get to far: point far was taught with",
        ),
    ],
)
def test_a_point_out_of_reach_is_not_gone_to(tmp_path: Path, point: JointPoint | PosePoint, why: str) -> None:
    world = standing(tmp_path, Points({"far": point}))
    enabled(world)
    assert answer(world, Go("press", "far")).text.startswith(why)
    assert answer(world, Go("press", "fat")).text == "no point 'fat', allowed far"


def test_a_tool_is_jogged_along_the_axes_of_a_frame(tmp_path: Path) -> None:
    world = standing(tmp_path)
    enabled(world)
    start = ARM.forward(HERE)[:3, 3]
    assert answer(world, Jog("press", "X", 0.05, JogFrame.WORLD, 0.03, "table")).ok
    held(world, "press", 10.0)
    way = ARM.forward(world.played[-1])[:3, 3] - start
    np.testing.assert_allclose(way, 0.03 * np.array([math.cos(0.3), math.sin(0.3), 0.0]), atol=1e-5)
    assert (
        answer(world, Jog("p2", "X", 0.05, JogFrame.WORLD, 0.03, "tabel")).text
        == "unknown frame 'tabel', allowed table"
    )
