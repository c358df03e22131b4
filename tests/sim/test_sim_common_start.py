"""Robots ordered to start at one moment of the cell clock begin their motions within one bus cycle of each other."""

import numpy as np

from cell.messages import CellTime, DriveFeedback, Enable, Mode, Run
from tests.sim.scenario import BAD
from tests.sim.world import World, load_bundle

ROBOTS = ("left", "right")


class Starts:
    """When each robot's command first changes."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._stood: dict[str, np.ndarray] = {}
        self.first: dict[str, float] = {}
        world.on_feedback.append(self._look)

    def _look(self, feedback: DriveFeedback) -> None:
        stood = self._stood.setdefault(feedback.robot, feedback.commanded)
        if feedback.enabled and not np.array_equal(feedback.commanded, stood):
            self.first.setdefault(feedback.robot, self._world.clock.now)


def ready(seed: int) -> World:
    world = World(load_bundle(), seed, BAD)

    def enable() -> None:
        for robot, state in world.seen.robots.items():
            if state.mode is Mode.DISABLED:
                world.operate(f"robot/{robot}", Enable())
        world.clock.after(0.3, enable)

    enable()
    assert world.clock.run_until(world.clock.now + 20.0, lambda: modes(world) == [Mode.READY, Mode.READY])
    return world


def modes(world: World) -> list[Mode]:
    return [world.seen.robots[robot].mode for robot in ROBOTS if robot in world.seen.robots]


def order(world: World, ahead_s: float) -> float:
    """Order all robots to begin; the world's time at which they do."""
    manager = world.seen.manager
    assert manager is not None
    behind = world.clock.now - world.processes["manager"].core._cell_time(world.hosts["manager"].now)
    at = CellTime(manager.boot, manager.cell_time + ahead_s)

    def repeat() -> None:
        for robot in ROBOTS:
            if world.seen.robots[robot].mode is Mode.READY and world.clock.now < at.seconds + behind - 0.5:
                world.operate(f"robot/{robot}", Run(at))
        world.clock.after(0.2, repeat)

    repeat()
    return at.seconds + behind


def test_two_robots_begin_within_one_cycle() -> None:
    world = ready(0)
    starts = Starts(world)
    due = order(world, 1.2)
    world.clock.run_until(due + 0.2)
    cycle_s = world.cycle_s("left")
    for robot in ROBOTS:
        # The first tick of a motion still commands where the robot stands; late by the least delay of the messages.
        assert -0.5e-3 <= starts.first[robot] - due - cycle_s <= cycle_s + 1.5e-3
    assert abs(starts.first["left"] - starts.first["right"]) <= cycle_s + 1.5e-3
