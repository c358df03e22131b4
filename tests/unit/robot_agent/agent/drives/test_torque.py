"""The torques that an agent sends with its samples."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cell.messages import Enable, Mode, ProgramState, Run
from robot_agent.dynamics import axis_torques
from robot_agent.kinematics import Model, model_of
from robot_agent.model import LinkMass
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.six_axis_arm import description

COUPLING = np.eye(6)
COUPLING[4, 3] = 0.5
MASSES = (
    LinkMass(2, 60.0, (0.0, 0.0, 0.5), np.diag([5.0, 5.0, 1.0]), "a test"),
    LinkMass(5, 12.0, (0.1, 0.0, 0.02), np.diag([0.1, 0.1, 0.1]), "a test"),
)
HOME = np.radians([0, -20, 30, 40, 60, 0])


def _arm(masses: tuple[LinkMass, ...] = MASSES) -> Model:
    return model_of(replace(description(), coupling=COUPLING, home=HOME, masses=masses))


def _ran(asked: bool, arm: Model) -> AgentWorld:
    world = AgentWorld("MJ J1=20 J2=10 J4=90\nEND", arm=arm)
    world.torques, world.commanded = asked, arm.coupling.axes(HOME)
    _until(world, lambda: bool(world.states) and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    _until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    _until(world, lambda: world.state.program.state is ProgramState.DONE)
    return world


def _until(world: AgentWorld, happened: Callable[[], bool]) -> None:
    for _ in range(2000):
        world.step()
        if happened():
            return
    raise AssertionError("not reached")


def test_each_sample_has_the_torque_of_its_motion_and_the_last_one_carries_the_arm() -> None:
    arm = _arm()
    world, torques = _ran(True, arm), axis_torques(arm, np.eye(4))
    assert torques is not None
    for block in world.blocks:
        assert block.torque is not None
        rest = arm.coupling.joints(block.position[-1:])
        np.testing.assert_allclose(block.torque[-1:], torques.standing(rest), atol=1e-6)
    block = max(world.blocks, key=lambda block: float(np.abs(np.diff(block.velocity, axis=0)).max()))
    assert block.torque is not None
    q, qd = arm.coupling.joints(block.position), arm.coupling.joints(block.velocity)
    slope = (qd[2:] - qd[:-2]) / (2 * CYCLE_S)
    expected = torques.of(q[1:-1], qd[1:-1], slope)
    moving = np.abs(expected - torques.standing(q[1:-1])).max(axis=0)
    np.testing.assert_allclose(block.torque[1:-1], expected, atol=0.02 * moving.max())
    assert moving.max() > 30.0


def test_two_blocks_say_the_same_of_a_sample_that_they_share() -> None:
    blocks = _ran(True, _arm()).blocks
    shared = 0
    for before, after in pairwise(blocks):
        k = after.first_tick - before.first_tick
        if 0 < k < len(before.position):
            assert before.torque is not None
            assert after.torque is not None
            # Second differences look at the neighbours: the same motion goes on through the join.
            goes_on = not np.array_equal(after.position[0], after.position[1])
            if goes_on and np.array_equal(before.position[k : k + 2], after.position[:2]):
                np.testing.assert_allclose(after.torque[0], before.torque[k], atol=1e-6)
                shared += 1
    assert shared > 20


def test_signs_of_life_say_what_carries_the_arm_before_it_is_switched_on() -> None:
    arm = _arm()
    world, torques = _ran(True, arm), axis_torques(arm, np.eye(4))
    assert torques is not None
    sign = world.signs_of_life[0]
    assert sign.torque is not None
    np.testing.assert_allclose(sign.torque, np.repeat(torques.standing(HOME[None]), 3, axis=0), atol=1e-9)


def test_of_a_robot_that_does_not_know_where_it_is_nobody_knows_what_carries_it() -> None:
    world = AgentWorld("END", arm=_arm())
    world.torques, world.referenced = True, False
    _until(world, lambda: len(world.signs_of_life) > 3)
    assert all(block.torque is None for block in world.signs_of_life)


def test_there_are_none_where_no_drive_takes_them_or_nobody_knows_them() -> None:
    for world in (_ran(False, _arm()), _ran(True, _arm(masses=()))):
        assert all(block.torque is None for block in [*world.blocks, *world.signs_of_life])
