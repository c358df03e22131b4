"""While another robot is in set-up: nothing moves this one, and it says that it stands."""

import pytest

from cell.messages import (
    Continue,
    Disable,
    Enable,
    Halt,
    Jog,
    JogFrame,
    JogHeld,
    Mode,
    Return,
    Run,
    SetupStatus,
    Step,
)
from cell.messages.common import Heard
from tests.unit.agent_runs import SHORT, enabled, running, until
from tests.unit.agent_world import AgentWorld

OTHER, OWN = SetupStatus("right", False), SetupStatus("left", True)
JOG = Jog("p1", "J1", 0.1, JogFrame.WORLD)


def disabled() -> AgentWorld:
    world = AgentWorld(SHORT)
    until(world, lambda: bool(world.states) and world.state.mode is Mode.DISABLED)
    return world


@pytest.mark.parametrize("command", [Enable(), Run(), Continue(), Return(), Step(), JOG], ids=lambda c: c.verb)
def test_no_order_that_moves_is_taken_and_the_reason_names_who_is_set_up(command: object) -> None:
    for setup, who in ((OTHER, "right"), (OWN, "it")):
        world = enabled(SHORT)
        world.setup = setup
        world.step()
        id = world.call(command)  # type: ignore[arg-type]
        until(world, lambda w=world, i=id: i in w.replies)
        assert not world.replies[id].ok
        assert world.replies[id].text == (
            f"left stays at rest: {who} is in set-up; call again when that is over, by `cell status`"
        )
        assert world.state.waiting_for == f"{who} is in set-up"


@pytest.mark.parametrize("command", [Halt(), Disable()], ids=lambda c: c.verb)
def test_what_stops_or_switches_off_is_taken(command: object) -> None:
    world = enabled(SHORT)
    world.setup = OTHER
    world.step()
    id = world.call(command)  # type: ignore[arg-type]
    until(world, lambda: id in world.replies)
    assert world.replies[id].ok


def test_a_robot_without_torque_says_that_it_stands_and_one_that_has_it_or_gets_it_does_not() -> None:
    world = disabled()
    world.step()
    assert world.presences[-1].standing
    world.answers_held = True
    world.call(Enable())
    world.step()
    assert world.state.mode is Mode.ENABLING
    assert not world.presences[-1].standing
    world.release_answers()
    until(world, lambda: world.state.mode is Mode.READY)
    assert not world.presences[-1].standing


def test_a_program_that_runs_when_it_hears_of_it_is_halted_and_goes_on_only_by_its_operator() -> None:
    world = running(SHORT)
    until(world, lambda: (world.state.tcp_speed_m_s or 0.0) > 0.1)
    world.setup = OTHER
    until(world, lambda: world.state.mode is Mode.HALTED)
    until(world, lambda: world.state.tcp_speed_m_s == 0.0)
    until(world, lambda: world.state.waiting_for == "right is in set-up")
    world.setup = None
    world.run(1.0)
    assert world.state.mode is Mode.HALTED
    assert [event.text for event in world.events if event.code == "setup"] == ["halted: right is in set-up"]
    id = world.call(Continue())
    until(world, lambda: id in world.replies)
    assert world.replies[id].ok


def test_a_jog_ends_though_its_key_is_held() -> None:
    world = enabled(SHORT)
    world.call(JOG)
    world.step()
    assert world.state.mode is Mode.JOGGING
    world.setup = OTHER
    for _ in range(100):
        seen = Heard(world.state.boot, world.state.sequence)
        world.agent.receive(JogHeld("left", "p1", True, seen), world.now)
        world.step()
    assert world.state.mode is Mode.READY
    assert world.state.tcp_speed_m_s == 0.0
