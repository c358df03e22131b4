"""Between joints and axes: what the agent plans, says and hears when gears couple its joints."""

from dataclasses import replace

import numpy as np
import pytest

from cell.messages import Enable, Mode, ProgramState, Run
from robot_agent.agent.drives.axes import feedback_in_joints
from robot_agent.kinematics import model_of
from tests.unit.agent_world import AgentWorld
from tests.unit.six_axis_arm import description

COUPLING = np.eye(6)
COUPLING[4, 3], COUPLING[5, 3], COUPLING[5, 4] = 0.02, -0.013, 0.5
ARM = model_of(replace(description(), coupling=COUPLING, home=np.radians([0, -20, 30, 40, 60, 0])))


def step_until(world: AgentWorld, mode: Mode | None = None, state: ProgramState | None = None) -> None:
    for _ in range(2000):
        world.step()
        if world.states and mode in (None, world.state.mode) and state in (None, world.state.program.state):
            return
    raise AssertionError(f"not reached; state {world.states[-1:]}")


def test_a_program_in_joints_ends_at_the_axes_that_the_gears_ask_for() -> None:
    world = AgentWorld("MJ J1=20 J4=90 J5=51.8 J6=58.83\nEND", arm=ARM)
    world.commanded = ARM.coupling.axes(ARM.home)
    step_until(world, mode=Mode.DISABLED)
    np.testing.assert_allclose(world.state.joints, ARM.home, atol=1e-9)
    world.call(Enable())
    step_until(world, mode=Mode.READY)
    world.call(Run())
    step_until(world, state=ProgramState.DONE)
    axes = np.degrees(world.commanded)
    np.testing.assert_allclose(axes[[0, 3, 4, 5]], [20, 90, 50, 58.83 + 0.013 * 90 - 0.5 * 50], atol=1e-6)
    np.testing.assert_allclose(np.degrees(world.state.joints)[[3, 4, 5]], [90, 51.8, 58.83], atol=1e-6)


def test_the_speeds_of_a_block_are_those_of_the_axes() -> None:
    world = AgentWorld("MJ J4=90\nEND", arm=ARM)
    world.commanded = ARM.coupling.axes(ARM.home)
    step_until(world, mode=Mode.DISABLED)
    world.call(Enable())
    step_until(world, mode=Mode.READY)
    world.call(Run())
    step_until(world, state=ProgramState.DONE)
    block = max(world.blocks, key=lambda block: float(abs(block.velocity).max()))
    fastest = int(abs(block.velocity[:, 3]).argmax())
    speed = block.velocity[fastest]
    assert abs(speed[3]) > 0.5
    np.testing.assert_allclose(speed[4], -0.02 * speed[3], atol=1e-12)


def test_torques_of_the_axes_are_heard_as_those_that_the_joints_feel() -> None:
    feedback = replace(AgentWorld("END")._feedback(), torque=np.array([5.0, -40.0, 12.0, 3.0, 2.0, 1.0]))
    heard = feedback_in_joints(ARM.coupling, feedback)
    assert heard.torque is not None
    assert feedback.torque is not None
    speeds = np.array([0.1, 0.2, -0.3, 1.0, -2.0, 0.7])
    assert heard.torque @ ARM.coupling.joints(speeds) == pytest.approx(feedback.torque @ speeds)


def test_without_coupling_feedback_stays_as_it_is() -> None:
    world = AgentWorld("END")
    feedback = world._feedback()
    heard = feedback_in_joints(model_of(description()).coupling, feedback)
    np.testing.assert_array_equal(heard.position, feedback.position)
    np.testing.assert_array_equal(heard.commanded, feedback.commanded)
