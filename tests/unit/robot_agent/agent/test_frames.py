"""Things that stand in a frame are where the manager says that the frame is, for all that is planned from then on."""

import math

import numpy as np
import pytest

from cell.config.settings import InFrame, PoseSettings, SphereShape, ThingSettings
from cell.messages import Enable, FramePose, Heard, Jog, JogFrame, JogHeld, Mode, ProgramState, Run
from robot_agent.agent.planning.heard_frames import HeardFrames
from tests.unit.agent_runs import ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.six_axis_arm import arm

UPRIGHT = (0.0, 0.0, 0.0, 1.0)
RAISED = PoseSettings((0.0, 0.0, 0.25), UPRIGHT)
"""The ball in its frame."""
AWAY = (50.0, 0.0, 0.0)
BALL = ThingSettings(
    "ball", SphereShape(0.1), PoseSettings((50.0, 0.0, 0.25), UPRIGHT), 0.005, {}, InFrame("table", RAISED)
)
PROGRAM = "MJ J1=20\nWAIT 0.2\nMJ J1=-20\nWAIT 0.2\nMJ J1=20\nWAIT 0.2\nMJ J1=40\nEND"


def table(version: int, position_m: tuple[float, float, float]) -> FramePose:
    return FramePose("table", version, None, position_m, UPRIGHT)


def under_the_flange(j1_deg: float) -> tuple[float, float, float]:
    """Where the frame is when its ball is at the flange."""
    model = arm()
    q = np.array(model.home)
    q[0] = math.radians(j1_deg)
    x, y, z = model.forward(q)[:3, 3].tolist()
    return (x, y, z - 0.25)


def world_with_ball(program: str = PROGRAM) -> AgentWorld:
    return AgentWorld(program, things=(BALL,))


def ready(world: AgentWorld) -> None:
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)


def running() -> AgentWorld:
    """The first two motions are planned, with the ball far away."""
    world = world_with_ball()
    world.frames = (table(7, AWAY),)
    ready(world)
    world.call(Run())
    until(world, lambda: len(world.planned) >= 2)
    return world


def failed(world: AgentWorld) -> str:
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    return world.state.program.error


def test_nothing_moves_before_the_manager_has_said_where_the_frame_is() -> None:
    world = world_with_ball()
    world.run(1.0)
    call = world.call(Enable())
    world.run(0.1)
    assert "left stays at rest: the manager has not said yet where frame table is" in world.replies[call].text
    world.frames = (table(7, AWAY),)
    ready(world)
    world.call(Run())
    until(world, ended(world))
    assert world.state.frames == {"table": 7}


def test_a_move_that_is_planned_after_a_frame_has_moved_sees_its_things_there() -> None:
    world = running()
    world.frames = (table(8, under_the_flange(40.0)),)
    world.run(0.1)
    assert (world.state.frames, world.state.program.planned_to) == ({"table": 8}, 3)
    assert failed(world).startswith("line 7: link ")
    assert "ball" in world.state.program.error
    assert np.degrees(world.played[-1][0]) == pytest.approx(20.0, abs=1e-6)


def test_a_motion_that_was_planned_before_keeps_the_old_place() -> None:
    world = running()
    world.frames = (table(8, under_the_flange(-20.0)),)
    text = failed(world)
    assert text.startswith("line 5: link ")
    assert "not even where it begins" in text
    assert np.degrees(world.played[-1][0]) == pytest.approx(-20.0, abs=1e-6)


def test_nothing_is_planned_while_the_frame_that_is_in_force_is_not_heard() -> None:
    world = running()
    world.frames, world.frames_lost = (table(8, AWAY),), True
    until(world, lambda: "where frame table is" in world.state.waiting_for)
    assert [planned.lines for planned in world.planned] == [(1,), (3,)]
    world.frames_lost = False
    until(world, ended(world))


def test_a_jog_stands_in_front_of_what_has_been_moved_into_its_way() -> None:
    world = world_with_ball()
    world.frames = (table(7, AWAY),)
    ready(world)
    world.call(Jog("press", "J1", math.radians(10.0), JogFrame.WORLD))

    def held(seconds: float) -> None:
        for _ in range(round(seconds / 0.02)):
            state = world.state
            world.agent.receive(JogHeld("left", "press", True, Heard(state.boot, state.sequence)), world.now)
            world.step()

    held(0.5)
    assert np.degrees(world.played[-1][0]) > 1.0
    world.frames = (table(8, under_the_flange(20.0)),)
    held(3.0)
    assert 2.0 < np.degrees(world.played[-1][0]) < 20.0
    assert "ball is in the way" in world.state.waiting_for


def test_an_older_version_that_comes_late_is_not_taken() -> None:
    frames = HeardFrames(("table", "wall"), (BALL,))
    assert frames.heard(table(8, AWAY))
    assert not frames.heard(table(7, (0.0, 0.0, 0.0)))
    assert not frames.heard(FramePose("wall", 9, None, AWAY, UPRIGHT))
    assert not frames.heard(FramePose("strange", 9, None, AWAY, UPRIGHT))
    assert frames.of("strange") is None
    assert frames.present == (table(8, AWAY),)
