"""A jog in the whole cell on a bad network: the robot moves by the key's messages alone, and rests without them."""

from collections.abc import Callable

import numpy as np
import pytest

from cell.commands.checks import CellBundle
from cell.messages import Enable, Heard, Jog, JogFrame, JogHeld, Mode
from robot_agent.agent.operator.jogging import HELD_S
from tests.sim.invariants import Invariants
from tests.sim.scenario import WORSE
from tests.sim.world import World

KEY_S = 0.03
ORDER_S = 0.3
TO_REST_S = HELD_S + 0.8
"""The deadline, the nominal part of a block that was sent before it, its ramp, and the network's lateness."""


class Hand:
    """An operator's hand on the jog key of a robot; `cut_off` is the line being cut, not the key let go."""

    def __init__(self, world: World, command: Jog, robot: str = "left") -> None:
        self.world, self.command, self.robot, self.cut_off = world, command, robot, False
        self._order()
        self._say()

    def _order(self) -> None:
        if not self.cut_off and mode(self.world, self.robot) is Mode.READY:
            self.world.operate(f"robot/{self.robot}", self.command)
            self.world.clock.after(ORDER_S, self._order)

    def _say(self) -> None:
        if not self.cut_off:
            state = self.world.seen.robots[self.robot]
            self.world.press(JogHeld(self.robot, self.command.press, True, Heard(state.boot, state.sequence)))
            self.world.clock.after(KEY_S, self._say)


def mode(world: World, robot: str = "left") -> Mode | None:
    state = world.seen.robots.get(robot)
    return None if state is None else state.mode


def wait(world: World, done: Callable[[], bool], longest_s: float) -> None:
    assert world.clock.run_until(world.clock.now + longest_s, done), world.seen.robots


def enabled(bundle: CellBundle, seed: int, robots: tuple[str, ...] = ("left",)) -> tuple[World, Invariants]:
    world = World(bundle, seed, WORSE)
    invariants = Invariants(world, planned=False)

    def enable() -> None:
        for robot in robots:
            if mode(world, robot) is Mode.DISABLED:
                world.operate(f"robot/{robot}", Enable())
        world.clock.after(ORDER_S, enable)

    enable()
    wait(world, lambda: all(mode(world, robot) is Mode.READY for robot in robots), 20.0)
    return world, invariants


@pytest.mark.parametrize(("seed", "axis"), [(0, "J1"), (1, "X")])
def test_a_robot_whose_jog_key_is_no_longer_heard_comes_to_rest(bundle: CellBundle, seed: int, axis: str) -> None:
    world, invariants = enabled(bundle, seed)
    start = world.seen.feedback["left"].commanded
    hand = Hand(world, Jog("press", axis, 0.1, JogFrame.WORLD))
    wait(world, lambda: bool(np.abs(world.seen.feedback["left"].commanded - start).max() > 0.03), 10.0)
    assert mode(world) is Mode.JOGGING
    hand.cut_off = True
    world.clock.run_until(world.clock.now + TO_REST_S)
    rest = world.seen.feedback["left"].commanded
    world.clock.run_until(world.clock.now + 1.0)
    np.testing.assert_array_equal(world.seen.feedback["left"].commanded, rest)
    assert mode(world) is Mode.READY
    invariants.check_at_rest()


def test_a_dead_agent_leaves_a_jogged_robot_at_rest(bundle: CellBundle) -> None:
    world, invariants = enabled(bundle, 3)
    start = world.seen.feedback["left"].commanded
    Hand(world, Jog("press", "Z", -0.1, JogFrame.TOOL))
    wait(world, lambda: bool(np.abs(world.seen.feedback["left"].commanded - start).max() > 0.03), 10.0)
    world.kill("robot/left")
    world.clock.run_until(world.clock.now + TO_REST_S)
    invariants.check_at_rest()


def test_two_robots_jogged_towards_the_same_zone_are_never_in_it_together(bundle: CellBundle) -> None:
    both = ("left", "right")
    world, invariants = enabled(bundle, 4, both)
    for robot, speed in zip(both, (0.25, -0.25), strict=True):
        Hand(world, Jog(f"press {robot}", "X", speed, JogFrame.WORLD), robot)
    wait(world, lambda: any("held by" in world.seen.robots[robot].waiting_for for robot in both), 15.0)
    world.clock.run_until(world.clock.now + 1.5)
    inside = [robot for robot in both if invariants.time_inside_s[robot] > 0.0]
    assert len(inside) == 1
