"""Two robots whose programs meet leave at one moment, each time anew, over a bad network and with a new manager."""

from pathlib import Path

import numpy as np
import pytest

from cell.messages import DriveFeedback, ProgramState
from tests.sim.operator import PatientOperator
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle
from tests.unit.config_world import CELL, Copy

ROBOTS = ("left", "right")
QUICK = "MJ J1=10 F=100\nMEET load\nMJ J1=0 F=100\nMEET load TIMEOUT 60\nMJ J1=5 F=100\nEND"
SLOW = "MJ J1=25 F=50\nMEET load\nMJ J1=0 F=20\nMEET load\nMJ J1=5 F=100\nEND"


class Begins:
    """When each robot begins to move, after each rest."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._last: dict[str, np.ndarray] = {}
        self._moved: set[str] = set()
        self.of: dict[str, list[float]] = {robot: [] for robot in ROBOTS}
        world.on_feedback.append(self._look)

    def _look(self, feedback: DriveFeedback) -> None:
        robot, last = feedback.robot, self._last.get(feedback.robot, feedback.commanded)
        moved = {robot} if feedback.enabled and not np.array_equal(feedback.commanded, last) else set[str]()
        if moved and robot not in self._moved:
            self.of[robot].append(self._world.clock.now)
        self._moved, self._last[robot] = self._moved - {robot} | moved, feedback.commanded


def test_two_robots_leave_two_meetings_together_although_the_manager_dies_in_between(tmp_path: Path) -> None:
    copy = Copy(tmp_path).slow_buses()
    copy.change(CELL, "times: {", "meetings: {load: [left, right]}\ntimes: {")
    for robot, program in (("left", QUICK), ("right", SLOW)):
        (copy.folder / f"two_arms/programs/{robot}.prog").write_text(program)
    world = World(load_bundle(copy.cell), 5, BAD)
    begins, operator = Begins(world), PatientOperator(world)

    def waits(text: str) -> bool:
        return "left" in world.seen.robots and world.seen.robots["left"].waiting_for == text

    def until(seconds: float, text: str) -> None:
        assert world.clock.run_until(world.clock.now + seconds, lambda: waits(text)), world.seen.robots

    until(20.0, "meeting load: waits for right, which is on its way")
    assert world.clock.run_until(world.clock.now + 20.0, lambda: len(begins.of["left"]) == 2)
    until(20.0, "meeting load: waits for right, which is on its way")
    world.kill("manager")
    until(5.0, "meeting load: the manager is silent")
    assert begins.of["left"][2:] == []
    world.start("manager")
    done = world.clock.run_until(world.clock.now + 30.0, lambda: operator.all_done)
    assert done, {robot: state.waiting_for for robot, state in world.seen.robots.items()}
    assert {state.program.state for state in world.seen.robots.values()} == {ProgramState.DONE}
    # Within one cycle of each other, and as far as the two clocks agree.
    assert begins.of["left"][1] == pytest.approx(begins.of["right"][1], abs=0.025)
    assert begins.of["left"][-1] == pytest.approx(begins.of["right"][-1], abs=0.025)
    assert not [event for event in world.seen.events if event.code == "late_for_meeting"]
