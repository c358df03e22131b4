"""WAIT: it stands still with the program, and gives back the zone after it meanwhile."""

import numpy as np
import pytest

from cell.messages import Continue, Estop, Halt, Mode, ProgramState
from tests.unit.agent_runs import BACK, INTO, TO_START, near_zone, running, until
from tests.unit.agent_world import AgentWorld


def waiting(program: str) -> AgentWorld:
    world = running(program)
    world.grant()
    until(world, lambda: "WAIT" in world.state.waiting_for)
    return world


def left_s(world: AgentWorld) -> float:
    return float(world.state.waiting_for.removeprefix("WAIT, ").removesuffix(" s left"))


def test_a_zone_behind_a_pause_is_given_back_and_is_there_again_when_the_pause_ends() -> None:
    world = waiting(f"MJ {near_zone()}\nWAIT 5\n{INTO}\n{BACK}\nEND")
    until(world, lambda: left_s(world) < 4.5)
    assert world.presences[-1].holds == {}
    until(world, lambda: left_s(world) < 1.5)
    assert not any(presence.holds or presence.wants for presence in world.presences[-100:])
    until(world, lambda: world.state.waiting_for == "")
    assert world.presences[-1].holds != {}
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    assert world.state.waited_s == {}


def test_a_zone_that_the_robot_stands_in_is_kept_over_a_pause() -> None:
    world = waiting(f"{TO_START}\n{INTO}\nWAIT 3\n{BACK}\nEND")
    for _ in range(100):
        world.step()
        assert world.presences[-1].holds != {}


def test_a_pause_stands_still_while_the_program_is_halted() -> None:
    world = waiting("MJ J1=20\nWAIT 2\nMJ J1=0\nEND")
    until(world, lambda: left_s(world) < 1.2)
    world.call(Halt())
    world.run(5.0)
    assert world.state.mode is Mode.HALTED
    assert (world.state.program.state, world.state.program.line) == (ProgramState.RUNNING, 2)
    world.call(Continue())
    went_on = world.now
    until(world, lambda: world.state.program.line == 3)
    assert world.now - went_on == pytest.approx(1.1, abs=0.15)


def test_a_program_that_is_halted_in_its_last_pause_ends_when_it_goes_on() -> None:
    world = waiting("MJ J1=20\nWAIT 1\nEND")
    world.call(Halt())
    world.run(3.0)
    assert (world.state.mode, world.state.program.state) == (Mode.HALTED, ProgramState.RUNNING)
    world.call(Continue())
    until(world, lambda: world.state.program.state is ProgramState.DONE, 1.5)
    assert world.state.mode is Mode.READY


def test_a_pause_goes_on_with_its_rest_after_a_stop() -> None:
    world = waiting("MJ J1=20\nWAIT 2\nMJ J1=0\nEND")
    until(world, lambda: left_s(world) < 1.2)
    world.agent.receive(Estop("e1", True, "test", "test"), world.now)
    world.run(5.0)
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Continue())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    went_on = world.now
    until(world, lambda: world.state.program.line == 3)
    assert world.now - went_on == pytest.approx(1.1, abs=0.2)


def test_a_pause_whose_motion_ends_in_a_halt_begins_when_the_program_goes_on() -> None:
    world = running("MJ J1=20\nWAIT 1\nMJ J1=0\nEND")
    until(world, lambda: np.degrees(world.blocks[-1].position[-1, 0]) > 20.0 - 1e-9)
    world.call(Halt())
    world.run(3.0)
    world.call(Continue())
    until(world, lambda: "WAIT" in world.state.waiting_for)
    assert left_s(world) >= 0.9
