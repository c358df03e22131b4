"""A jog in the whole cell on a bad network: the robot moves by the key's messages alone, and rests without them."""

from collections.abc import Callable

import numpy as np
import pytest

from cell.messages import Enable, Heard, Jog, JogFrame, JogHeld, Mode
from robot_agent.agent.jogging import HELD_S
from tests.sim.invariants import Invariants
from tests.sim.network import Weather
from tests.sim.scenario import WORSE
from tests.sim.world import World, load_bundle

KEY_S = 0.03
ORDER_S = 0.3
TO_REST_S = HELD_S + 0.8
"""The deadline, the nominal part of a block that was sent before it, its ramp, and the network's lateness."""


class Hand:
    """An operator's hand on a jog key of the left robot; `cut_off` is the line being cut, not the key let go."""

    def __init__(self, world: World, command: Jog) -> None:
        self.world, self.command, self.cut_off = world, command, False
        self._order()
        self._say()

    def _order(self) -> None:
        if not self.cut_off and mode(self.world) is Mode.READY:
            self.world.operate("robot/left", self.command)
            self.world.clock.after(ORDER_S, self._order)

    def _say(self) -> None:
        if not self.cut_off:
            state = self.world.seen.robots["left"]
            self.world.press(JogHeld("left", self.command.press, True, Heard(state.boot, state.sequence)))
            self.world.clock.after(KEY_S, self._say)


def mode(world: World) -> Mode | None:
    state = world.seen.robots.get("left")
    return None if state is None else state.mode


def wait(world: World, done: Callable[[], bool], longest_s: float) -> None:
    assert world.clock.run_until(world.clock.now + longest_s, done), world.seen.robots


def enabled(seed: int, weather: Weather) -> tuple[World, Invariants]:
    world = World(load_bundle(), seed, weather)
    invariants = Invariants(world, planned=False)

    def enable() -> None:
        if mode(world) is Mode.DISABLED:
            world.operate("robot/left", Enable())
        world.clock.after(ORDER_S, enable)

    enable()
    wait(world, lambda: mode(world) is Mode.READY, 20.0)
    return world, invariants


@pytest.mark.parametrize(("seed", "axis"), [(0, "J1"), (1, "X"), (2, "Z")])
def test_a_robot_whose_jog_key_is_no_longer_heard_comes_to_rest(seed: int, axis: str) -> None:
    world, invariants = enabled(seed, WORSE)
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


def test_a_dead_agent_leaves_a_jogged_robot_at_rest() -> None:
    world, invariants = enabled(3, WORSE)
    start = world.seen.feedback["left"].commanded
    Hand(world, Jog("press", "Z", -0.1, JogFrame.TOOL))
    wait(world, lambda: bool(np.abs(world.seen.feedback["left"].commanded - start).max() > 0.03), 10.0)
    world.kill("robot/left")
    world.clock.run_until(world.clock.now + TO_REST_S)
    invariants.check_at_rest()
