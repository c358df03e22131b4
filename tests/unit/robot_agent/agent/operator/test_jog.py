"""An agent under an operator's jog key: it moves while it hears the key, and never otherwise."""

import numpy as np
import pytest

from cell.core import Frozen, Publish
from cell.geometry import body_touches
from cell.messages import (
    Continue,
    Enable,
    Estop,
    Halt,
    Heard,
    Jog,
    Mode,
    Presence,
    ProgramState,
    ResetRobot,
    Return,
    Run,
    SetpointBlock,
    Stop,
    ZoneState,
    ZoneStatus,
)
from robot_agent.agent.operator.jogging import HELD_S
from robot_agent.trajectory.sources import JOG_SPEED_M_S
from tests.unit.agent_world import CYCLE_S, STEP_S, ZONE, AgentWorld
from tests.unit.robot_agent.agent.operator.jog_key import Key, jog

PROGRAM = "MJ J1=30 F=30\nEND"
RAMP_S = 0.4
"""Longer than any braking ramp of these jogs."""


def ready(start_deg: tuple[float, ...] = (0.0,) * 6) -> AgentWorld:
    world = AgentWorld(PROGRAM)
    world.commanded = np.radians(start_deg)
    world.run(0.1)
    world.call(Enable())
    world.run(0.1)
    assert world.state.mode is Mode.READY
    return world


def moves(world: AgentWorld) -> bool:
    return bool(np.any(world.played[-1] != world.played[-2]))


def test_it_moves_while_the_key_is_held_and_rests_when_it_is_let_go() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.1))
    key.hold(1.0)
    assert world.state.mode is Mode.JOGGING
    assert np.diff([q[0] for q in world.played[-2:]])[0] / CYCLE_S == pytest.approx(0.1)
    key.say(False)
    world.run(RAMP_S)
    assert not moves(world)
    assert world.state.mode is Mode.READY
    assert world.commanded[0] > 0.08
    np.testing.assert_array_equal(world.commanded[1:], 0.0)


def test_every_block_ends_at_rest_and_its_body_is_published_before() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.2))
    key.hold(0.5)
    assert all(not block.velocity[-1].any() for block in world.blocks)
    world.agent.receive(world._feedback(), world.now)
    key.say(True)
    kinds = [type(e.message) for e in world.agent.step(world.now) if isinstance(e, Publish)]
    assert kinds.index(Presence) < kinds.index(SetpointBlock)
    assert len(world.presences[-1].body.poses) > 2


def test_without_a_sign_of_the_key_it_rests_and_the_same_press_never_moves_it_again() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.1))
    key.hold(0.6)
    key.hold(HELD_S, lost=True)
    assert "no sign of the jog key" in world.state.waiting_for
    key.hold(RAMP_S)
    assert not moves(world)
    stood = world.commanded
    key.hold(0.5)
    np.testing.assert_array_equal(world.commanded, stood)
    assert "press it again" in Key(world, key.command).refusal


def test_a_sign_that_answers_an_old_state_is_none() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.1))
    key.hold(0.6)
    old = Heard(world.state.boot, world.state.sequence)
    for _ in range(round((HELD_S + RAMP_S) / STEP_S)):
        key.say(True, old)
        world.step()
    assert not moves(world)
    assert world.state.mode is Mode.READY


def test_after_a_freeze_no_earlier_sign_counts() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.1))
    key.hold(0.6)
    heard = Heard(world.state.boot, world.state.sequence)
    world.agent.receive(Frozen(0.4), world.now)
    world.now += 0.4
    key.say(True, heard)
    world.step()
    assert not world.agent.jogging.held


def test_a_step_ends_by_itself() -> None:
    world = ready()
    key = Key(world, jog("J3", -0.2, step=0.05))
    key.hold_to_the_end()
    assert world.commanded[2] == pytest.approx(-0.05, abs=1e-6)


def test_the_tool_moves_straight_and_not_faster_than_reduced_speed() -> None:
    world = ready((0.0, 0.0, 0.0, 0.0, 30.0, 0.0))
    Key(world, jog("Z", -3.0)).hold(0.6)
    way = world.planner.model.forward(np.array(world.played))[:, :3, 3]
    np.testing.assert_allclose(way[:, :2], np.tile(way[0, :2], (len(way), 1)), atol=1e-7)
    assert way[-1, 2] < way[0, 2] - 0.05
    assert np.abs(np.diff(way[:, 2])).max() / CYCLE_S <= JOG_SPEED_M_S * 1.001


def test_it_stops_in_front_of_a_zone_of_another_robot_and_enters_once_it_is_granted() -> None:
    world = ready((0.0, 33.0, -25.0, 0.0, 30.0, 0.0))
    world.zone = ZoneStatus(ZoneState.OCCUPIED, "right", None, (), 1, world.now)
    key = Key(world, jog("J2", 0.3))
    key.hold(3.0, until=lambda: "held by right" in world.state.waiting_for and not moves(world))
    key.hold(2 * STEP_S)
    box = ZONE.solid()
    assert not any(body_touches(presence.body, box) for presence in world.presences)
    assert "handover" in world.presences[-1].wants
    world.grant()
    key.hold(2.0, until=lambda: body_touches(world.presences[-1].body, box))
    assert body_touches(world.presences[-1].body, box)
    assert world.presences[-1].holds == {"handover": world.zone.token}


@pytest.mark.parametrize("silent", ["manager", "estop"])
def test_a_silent_manager_or_an_emergency_stop_ends_the_press(silent: str) -> None:
    world = ready()
    key = Key(world, jog("J1", 0.1))
    key.hold(0.6)
    if silent == "manager":
        world.manager_silent = True
    else:
        world.agent.receive(Estop("e1", True, "tester", "door"), world.now)
    key.hold(0.3 + RAMP_S)
    assert not moves(world)
    stood = world.commanded
    world.manager_silent = False
    world.agent.receive(Estop("e1", False, "tester", "door"), world.now)
    world.enabled = False
    key.hold(0.1)
    world.call(ResetRobot())
    world.call(Enable())
    key.hold(0.5)
    np.testing.assert_array_equal(world.commanded, stood)


def test_lost_blocks_do_not_take_it_out_of_its_way() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.2))
    for turn in range(30):
        world.lose_blocks = turn % 3 > 0
        key.hold(STEP_S)
    world.lose_blocks = False
    key.say(False)
    world.run(RAMP_S)
    q = np.array(world.played)[:, 0]
    assert (np.diff(q) >= 0.0).all()
    assert np.abs(np.diff(q, 2)).max() / CYCLE_S**2 <= world.planner.limits.ramp_acceleration_bounds[1][0] * 1.01


def test_a_running_program_is_not_jogged_and_a_halted_one_is_not_lost() -> None:
    world = ready()
    world.call(Run())
    world.run(0.3)
    assert "halt it first" in Key(world, jog("J1", 0.1)).refusal
    world.call(Halt())
    world.run(1.0)
    left = world.commanded
    key = Key(world, jog("J1", 0.1))
    key.hold(0.3)
    assert moves(world)
    key.say(False)
    world.run(RAMP_S)
    assert world.state.mode is Mode.OFF_PATH
    assert world.state.program.state is ProgramState.INTERRUPTED
    assert "jogged off its path" in world.state.program.error
    call = world.call(Continue())
    world.step()
    assert "beside its path" in world.replies[call].text
    world.call(Return())
    world.run(3.0)
    assert world.state.mode is Mode.HALTED
    np.testing.assert_allclose(world.commanded, left, atol=1e-9)
    world.call(Continue())
    world.run(3.0)
    assert world.state.program.state is ProgramState.DONE


def test_a_jog_within_the_window_needs_no_return() -> None:
    world = ready()
    world.call(Run())
    world.run(0.3)
    world.call(Halt())
    world.run(1.0)
    Key(world, jog("J1", 0.01, step=0.002)).hold(0.5)
    world.run(RAMP_S)
    assert world.state.mode is Mode.HALTED
    world.call(Continue())
    world.run(3.0)
    assert world.state.program.state is ProgramState.DONE


def test_stop_ends_a_jog_and_the_program_that_it_left() -> None:
    world = ready()
    world.call(Run())
    world.run(0.3)
    world.call(Halt())
    world.run(1.0)
    Key(world, jog("J1", 0.1)).hold(0.3)
    world.call(Stop())
    world.run(RAMP_S)
    assert world.state.mode is Mode.READY
    assert world.state.program.state is ProgramState.LOADED


@pytest.mark.parametrize(
    ("command", "found"),
    [
        (jog("J9", 0.1), "allowed are J1, J2"),
        (jog("J1", 0.0), "allowed is any but 0"),
        (jog("X", 0.1, step=-1.0), "above 0"),
        (jog("A", 0.1, step=3.0), "at most 90"),
    ],
)
def test_a_call_that_makes_no_sense_is_refused_with_what_is_allowed(command: Jog, found: str) -> None:
    assert found in Key(ready(), command).refusal


def test_two_keys_at_once_are_one_too_many() -> None:
    world = ready()
    first = Key(world, jog("J1", 0.1))
    first.hold(0.2)
    second = Key(world, jog("J1", -0.1, press="two"))
    first.hold(0.1)
    assert "another key" in second.refusal
    assert world.state.mode is Mode.JOGGING


def test_halt_ends_a_jog() -> None:
    world = ready()
    key = Key(world, jog("J1", 0.1))
    key.hold(0.4)
    world.call(Halt())
    key.hold(RAMP_S)
    assert not moves(world)
    assert world.state.mode is Mode.READY
