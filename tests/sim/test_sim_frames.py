"""A frame is moved in a whole cell over a bad network: file, manager and robots agree, and later moves see it there."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cell.config import load_cell
from cell.geometry import transform_points
from cell.manager.edits_on_disk import EditsOnDisk
from cell.messages import Command, Enable, Mode, PlaceFrame, ProgramState, Run
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import CELL, Copy

PROGRAM = """\
MJ J1=20
WAIT 0.3
MJ J1=-20
WAIT 0.3
MJ J1=20
WAIT 0.3
MJ J1=-20
WAIT 0.3
HOME
END
"""
FRAMES = """\
frames: {table: {pose: {X: 0, Y: 50000, Z: 0, A: 0, B: 0, C: 0}}}  # far away
things: {ball: {sphere: 100, pose: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}, frame: table}}
"""


def order(world: World, to: str, command: Command, done: Callable[[], bool]) -> None:
    """Give an order again and again until it is done; messages and answers are lost."""

    def give() -> None:
        if not done():
            world.operate(to, command)
            world.clock.after(0.4, give)

    give()
    assert world.clock.run_until(world.clock.now + 20.0, done)


def left_is(world: World, mode: Mode) -> Callable[[], bool]:
    return lambda: "left" in world.seen.robots and world.seen.robots["left"].mode is mode


def test_a_thing_that_is_moved_with_its_frame_is_in_the_way_of_what_is_planned_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(EditsOnDisk, "write", EditsOnDisk._write)  # on virtual time a disk takes none
    copy = Copy(tmp_path).add(CELL, FRAMES.rstrip())
    (copy.folder / "two_arms/programs/left.prog").write_text(PROGRAM)
    world = World(load_bundle(copy.cell), 1, BAD)
    left = world.bundle.robots["left"]
    home = transform_points(left.pose_world_base, left.model.forward(np.array(left.model.home))[:3, 3])
    assert world.clock.run_until(world.clock.now + 20.0, left_is(world, Mode.DISABLED))
    order(world, "robot/left", Enable(), left_is(world, Mode.READY))
    order(world, "robot/left", Run(), left_is(world, Mode.RUNNING))
    before = world.seen.manager.frames
    command = PlaceFrame("table", tuple(home.tolist()), (0.0, 0.0, 0.0, 1.0), "anna")
    order(world, "manager", command, lambda: world.seen.manager.frames != before)
    ended = (ProgramState.FAILED, ProgramState.DONE)
    assert world.clock.run_until(world.clock.now + 60.0, lambda: world.seen.robots["left"].program.state in ended)
    state = world.seen.robots["left"]
    assert (state.program.state, "ball" in state.program.error) == (ProgramState.FAILED, True)
    assert state.frames == world.seen.robots["right"].frames == world.seen.manager.frames
    np.testing.assert_allclose(load_cell(copy.cell).frames["table"].pose.position_m, home, atol=1e-6)
    assert copy.cell.read_text().count("# far away") == 1
