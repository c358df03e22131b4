"""Spaces that an input or the program switches: the robot stands in front of those that are on, or may be."""

from collections.abc import Callable

import numpy as np
import pytest

from cell.messages import Halt, Mode, ProgramState
from tests.unit.agent_runs import at_rest, ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.robot_agent.agent.operator.jog_key import Key, jog
from tests.unit.robot_agent.agent.zones.gate_runs import ROUND, ball, begun, broken, gaps


def failed(world: AgentWorld) -> Callable[[], bool]:
    return lambda: world.state.program.state is ProgramState.FAILED


def test_a_closed_input_opens_the_way() -> None:
    world = begun({"door": True})
    until(world, ended(world))
    assert gaps(world).min() < 0.0
    assert world.state.program.state is ProgramState.DONE


@pytest.mark.parametrize(
    ("inputs", "why"),
    [
        ({"door": False}, "space gate: input door is open"),
        ({"door": None}, "space gate: input door is not known"),
        ({}, "the gateway has not told input door"),
        (None, "the gateway has not told input door"),
    ],
)
def test_an_input_that_is_not_known_to_be_closed_holds_the_robot_in_front_of_the_space(
    inputs: dict[str, bool | None] | None, why: str
) -> None:
    world = begun(inputs)
    until(world, lambda: why in world.state.waiting_for)
    until(world, at_rest(world))
    assert 0.0 < gaps(world).min() < 0.05
    world.inputs = {"door": True}
    until(world, ended(world))


def test_what_the_gateway_said_before_it_fell_silent_does_not_count() -> None:
    world = begun({"door": True}, "MJ J1=-40 F=10\n" + ROUND)
    until(world, lambda: world.state.program.line == 1 and bool(world.queue))
    world.inputs = None
    until(world, lambda: "nothing young is heard of input door" in world.state.waiting_for, seconds=20.0)
    assert gaps(world).min() > 0.0


def test_a_robot_inside_stops_where_it_is_and_is_jogged_out_but_no_deeper() -> None:
    world = begun({"door": True}, "MJ J1=60 F=10\nHOME\nEND")
    until(world, lambda: gaps(world)[-1] < -0.02, seconds=20.0)
    world.inputs = {"door": False}
    until(world, at_rest(world))
    inside = gaps(world)[-1]
    assert inside < -0.02
    until(world, lambda: "input door is open" in world.state.waiting_for)
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED)
    played = len(world.played)
    Key(world, jog("J1", 0.2, press="in")).hold(0.6)
    until(world, lambda: world.state.mode is Mode.READY)
    assert gaps(world)[played:].min() > inside - 1e-6
    Key(world, jog("J1", -0.2, press="out")).hold(2.0)
    assert gaps(world)[played:].min() > inside - 1e-6
    assert gaps(world)[-1] > inside + 0.01


def test_a_program_switches_its_spaces_from_the_next_move_on() -> None:
    gate = ball(by_program=True)
    world = begun(None, "SPACE gate OFF\n" + ROUND, gate)
    until(world, ended(world))
    assert world.state.program.state is ProgramState.DONE
    assert gaps(world, gate).min() < 0.0
    world = begun(None, "SPACE gate OFF\nMJ J1=20\nSPACE gate ON\nMJ J1=60\nEND", gate)
    until(world, failed(world))
    assert "line 4: link" in world.state.program.error
    assert "too near to forbidden space gate" in world.state.program.error
    assert world.commanded[0] == pytest.approx(np.radians(20.0))


def test_moves_do_not_join_where_a_space_is_switched() -> None:
    gate = ball(by_program=True)
    world = begun(None, "MJ J1=10 R=5\nMJ J1=20\nSPACE gate OFF\nMJ J1=60\nEND", gate)
    until(world, ended(world))
    assert [planned.lines for planned in world.planned] == [(1, 2), (4,)]
    assert [planned.spaces_off for planned in world.planned] == [frozenset(), {"gate"}]


def test_after_the_program_all_spaces_are_on() -> None:
    gate = ball(by_program=True)
    world = begun(None, "SPACE gate OFF\nMJ J1=15\nEND", gate)
    until(world, ended(world))
    Key(world, jog("J1", 0.25, press="p")).hold(3.0, until=lambda: "gate" in world.state.waiting_for)
    assert "forbidden space gate is in the way of" in world.state.waiting_for
    assert gaps(world, gate).min() > 0.0


@pytest.mark.parametrize("seed", [3, 4])
def test_what_is_sent_of_a_planned_motion_is_on_the_path_that_was_looked_at(seed: int) -> None:
    """However the robot is halted, slowed, backed up and held: so no block is looked at again for things."""
    assert broken(seed) == ""
