"""`stop`: the robot brakes on its path, and what moved it has ended."""

import numpy as np
import pytest

from cell.messages import Enable, Halt, Heard, Jog, JogFrame, Mode, ProgramState, ResetRobot, Return, Run, Stop
from tests.unit.agent_runs import SHORT, at_rest, enabled, ended, running, until
from tests.unit.agent_world import CYCLE_S, AgentWorld


def stopped(world: AgentWorld) -> str:
    id = world.call(Stop())
    world.step()
    assert world.replies[id].ok
    until(world, at_rest(world))
    return world.replies[id].text


def interrupted() -> AgentWorld:
    """In a fault, beside its path."""
    world = running(SHORT)
    until(world, lambda: world.state.program.line == 2)
    world.quick_stop(beside=0.1)
    until(world, lambda: world.state.mode is Mode.FAULT)
    return world


def off_path() -> AgentWorld:
    world = interrupted()
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.OFF_PATH)
    return world


def test_a_stopped_program_has_ended_on_its_path_without_an_alarm_and_begins_anew() -> None:
    world, whole = running(SHORT), running(SHORT)
    until(whole, ended(whole))
    until(world, lambda: world.state.program.line == 2)
    assert stopped(world).startswith("left brakes on its path, and has ended its program")
    path, planned = np.array(world.played), np.array(whole.played)
    assert max(np.abs(planned - q).max(axis=1).min() for q in path[::5]) < 0.01
    assert (world.state.mode, world.state.program.state) == (Mode.READY, ProgramState.LOADED)
    assert world.state.alarms == ()
    assert [event.code for event in world.events] == []
    world.call(Run())
    until(world, ended(world))


def test_a_halted_program_is_ended_too() -> None:
    world = running(SHORT)
    world.run(0.5)
    world.call(Halt())
    until(world, at_rest(world))
    assert stopped(world).startswith("left has ended its program")
    assert world.state.mode is Mode.READY


@pytest.mark.parametrize("fault", [False, True])
def test_an_interrupted_program_is_ended_where_the_robot_is_off_its_path(fault: bool) -> None:
    world = interrupted() if fault else off_path()
    stopped(world)
    assert world.state.mode is (Mode.FAULT if fault else Mode.READY)
    assert world.state.program.state is ProgramState.LOADED


def test_on_its_way_back_it_comes_to_rest_there() -> None:
    world = off_path()
    begins = len(world.played)
    world.call(Return())
    until(world, lambda: world.state.mode is Mode.RETURNING and float(np.abs(world.velocity).max()) > 0.01)
    stopped(world)
    assert world.state.mode is Mode.READY
    accelerations = np.abs(np.diff(np.array(world.played[begins:]), n=2, axis=0)) / CYCLE_S**2
    assert (accelerations < 1.01 * world.planner.limits.ramp_acceleration_bounds[1]).all()  # a ramp, no jump


def test_a_jog_ends() -> None:
    world = enabled(SHORT)
    world.call(Jog("press", "J1", 0.2, JogFrame.WORLD))
    world.run(0.1)
    assert world.state.mode is Mode.JOGGING
    assert stopped(world) == "left comes to rest"
    assert world.state.mode is Mode.READY


def test_it_is_never_too_late_to_stop() -> None:
    world = running(SHORT)
    id = world.call(Stop(), Heard("somebody", 1))
    world.step()
    assert world.replies[id].ok


def test_without_a_program_there_is_nothing_to_stop() -> None:
    assert stopped(enabled(SHORT)) == "left is not running a program"
