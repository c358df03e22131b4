"""One robot in set-up at a time: whom the manager lets in, when it is free, and when that is over."""

from dataclasses import replace

import pytest

from cell.config.settings import CellSettings
from cell.messages import (
    AxisStatus,
    BusCounters,
    ClearSetup,
    GatewayState,
    Heard,
    NodeStatus,
    ResetEstop,
    SetEstop,
    SetupStatus,
)
from tests.unit.manager_world import PERIOD_S, World, settings

COUNTERS = BusCounters(1, 0, 0.0, 0, 0, 0, 0.1)


class Gateway:
    """What it says of its robots; `silent`: its link is cut in both directions."""

    def __init__(self, name: str, *robots: str) -> None:
        self.name = name
        self.robots = robots
        self.boot = "g1"
        self.sequence = 0
        self.setup: tuple[str, ...] = ()
        self.heard: Heard | None = None
        self.silent = False
        self.drive = AxisStatus.SWITCH_ON_DISABLED

    def state(self) -> GatewayState:
        self.sequence += 1
        nodes = tuple(NodeStatus(1, robot, "J1", "Operational", self.drive) for robot in self.robots)
        state = GatewayState(self.name, self.boot, self.sequence, 0.004, "virtual", True, "", {}, None, nodes, COUNTERS)
        return replace(state, setup=self.setup, heard=self.heard, era=int(self.boot[1:]))


def cell(robots: tuple[str, ...] = ("left", "right")) -> CellSettings:
    """Each robot has a gateway of its own."""
    found = settings(robots)
    return replace(found, robots={name: replace(robot, gateway=f"{name}_bus") for name, robot in found.robots.items()})


class SetupWorld(World):
    """All robots are switched off and say so, unless a test changes that."""

    def __init__(self, robots: tuple[str, ...] = ("left", "right")) -> None:
        super().__init__(cell(robots))
        self.gateways = {name: Gateway(f"{name}_bus", name) for name in robots}
        for robot in self.robots.values():
            robot.standing = True
        self.run(0.3)

    def run(self, seconds: float = 0.1) -> "SetupWorld":
        for _ in range(max(1, round(seconds / PERIOD_S))):
            for gateway in self.gateways.values():
                if not gateway.silent:
                    self.manager.receive(gateway.state(), self.now)
            super().run(PERIOD_S)
            for gateway in self.gateways.values():
                if not gateway.silent and self.states:
                    gateway.heard = Heard(self.state.boot, self.state.sequence)
        return self

    def want(self, *robots: str) -> "SetupWorld":
        for robot in robots:
            self.gateways[robot].setup = (robot,)
        return self.run()


@pytest.fixture
def world() -> SetupWorld:
    return SetupWorld()


def test_a_robot_that_is_to_be_set_up_is_let_in_and_free_once_all_others_have_confirmed_it(world: SetupWorld) -> None:
    world.want("left")
    assert world.state.setup == SetupStatus("left", True)
    first = next(state for state in world.states if state.setup is not None)
    free = next(state for state in world.states if state.setup is not None and state.setup.free)
    assert first.setup == SetupStatus("left", False, "right has not confirmed yet that it stands")
    assert free.sequence > first.sequence


def test_the_echo_names_the_newest_state_of_each_gateway(world: SetupWorld) -> None:
    world.run(0.3)
    echo = world.state.heard_gateways["left_bus"]
    assert echo.boot == "g1"
    assert 0 <= world.gateways["left"].sequence - echo.sequence < 10


def test_while_another_robot_is_switched_on_nobody_is_announced_so_nothing_is_halted(world: SetupWorld) -> None:
    world.right.standing = False
    world.run(0.3).want("left")
    assert world.state.setup is None
    assert world.state.setup_refused == {"left": "right is not at rest and switched off: cell disable right"}
    world.right.standing = True
    world.run(0.3)
    assert world.state.setup == SetupStatus("left", True)


def test_one_that_does_not_stand_any_more_takes_the_freedom_away(world: SetupWorld) -> None:
    world.want("left")
    world.right.standing = False
    world.run()
    assert world.state.setup == SetupStatus("left", False, "right is not at rest and switched off: cell disable right")


def test_two_robots_that_are_to_be_set_up_are_let_in_one_after_the_other(world: SetupWorld) -> None:
    world.want("left").want("right")
    assert world.state.setup == SetupStatus("left", True)
    assert world.state.setup_refused == {"right": "left is in set-up; one robot at a time"}
    world.gateways["left"].setup = ()
    world.run()
    assert world.state.setup == SetupStatus("right", True)
    assert world.state.setup_refused == {}


def test_a_robot_that_has_confirmed_may_fall_silent_and_come_back_under_a_new_boot(world: SetupWorld) -> None:
    world.want("left")
    before = len(world.states)
    world.right.silent = True
    world.run(1.0)
    world.right.restart("b2")
    world.run(1.0)
    assert {state.setup for state in world.states[before:]} == {SetupStatus("left", True)}


def test_a_robot_that_never_confirmed_and_is_silent_is_waited_for_as_long_as_any_braking_can_last() -> None:
    world = SetupWorld()
    world.right.silent = True
    since = world.now
    world.want("left")
    longest = world.cell.times.fresh_s + world.cell.times.nominal_s + world.cell.times.estop_delay_s
    while not (world.state.setup and world.state.setup.free):
        assert world.now - since < longest + 0.1
        world.run(PERIOD_S)
    assert world.now - since >= longest
    told = {state.setup.reason for state in world.states if state.setup is not None}
    assert "right is silent; it counts as at rest after 2.37 s" in told


def test_a_silent_robot_that_its_gateway_shows_switched_on_is_never_taken_for_one_that_is_off() -> None:
    world = SetupWorld()
    world.right.silent = True
    world.gateways["right"].drive = AxisStatus.OPERATION_ENABLED
    world.run(20.0).want("left")
    assert world.state.setup is None
    why = "right is switched on and its agent silent: start its agent, then cell disable right"
    assert world.state.setup_refused == {"left": why}


def test_one_that_was_silent_and_is_heard_without_its_confirmation_takes_the_freedom_away() -> None:
    world = SetupWorld()
    world.right.silent = True
    world.run(3.0).want("left")
    assert world.state.setup.free
    world.right.silent, world.right.standing = False, False
    world.run()
    assert not world.state.setup.free


def test_under_an_emergency_stop_nobody_is_set_up(world: SetupWorld) -> None:
    world.want("left")
    world.call(SetEstop("e1", "me", "test"))
    assert world.state.setup == SetupStatus("left", False, "an emergency stop is set: cell reset")
    world.call(ResetEstop("me", ("e1",)))
    world.run()
    assert world.state.setup == SetupStatus("left", True)


def test_it_is_over_when_its_gateway_says_so_in_view_of_it_and_not_by_an_older_word(world: SetupWorld) -> None:
    world.want("left")
    gateway = world.gateways["left"]
    before = replace(gateway.state(), setup=(), heard=Heard("m1", 1))
    world.manager.receive(before, world.now)
    world.run(PERIOD_S)
    assert world.state.setup == SetupStatus("left", True)
    gateway.setup = ()
    world.run(0.05)
    assert world.state.setup is None
    assert world.codes()[-2:] == ["setup_begins", "setup_over"]


def test_a_silent_gateway_keeps_its_robot_in_set_up_and_the_remedy_is_named(world: SetupWorld) -> None:
    world.want("left")
    world.gateways["left"].silent = True
    world.run(20.0)
    assert world.state.setup.robot == "left"
    assert not world.state.setup.free
    assert world.state.setup.reason == (
        "its gateway left_bus is silent: start it again, or look at left and say: cell setup clear left"
    )
    assert world.codes().count("setup_silent") == 1


def test_a_gateway_that_was_started_again_ends_it_by_its_own_word(world: SetupWorld) -> None:
    world.want("left")
    gateway = world.gateways["left"]
    gateway.silent = True
    world.run(1.0)
    gateway.boot, gateway.sequence, gateway.heard, gateway.silent = "g2", 0, None, False
    world.run(0.05)
    assert world.state.setup.robot == "left"
    gateway.setup = ()
    world.run(0.05)
    assert world.state.setup is None


def test_an_operators_word_ends_it_only_while_the_gateway_is_silent(world: SetupWorld) -> None:
    clear = ClearSetup("left", "me")
    assert world.call(clear).text == "left is not in set-up"
    world.want("left")
    refused = world.call(clear)
    assert not refused.ok
    assert refused.text == "gateway left_bus is alive and has left in set-up: let go of its motion"
    world.gateways["left"].silent = True
    world.run(0.5)
    assert world.call(clear).ok
    assert "setup_cleared" in [event.code for event in world.events]
    world.run()
    assert world.state.setup is None
    world.want("right")
    assert world.state.setup == SetupStatus("right", True)


def test_a_manager_that_starts_takes_over_what_the_gateways_say(world: SetupWorld) -> None:
    world.want("left")
    world.restart_manager(8, "m2")
    world.run(0.3)
    assert world.state.boot == "m2"
    assert world.state.setup == SetupStatus("left", True)


def test_a_gateway_speaks_for_its_own_robots_alone(world: SetupWorld) -> None:
    world.gateways["left"].setup = ("right", "nobody")
    stranger = replace(world.gateways["right"].state(), gateway="stranger", setup=("left",))
    world.manager.receive(stranger, world.now)
    world.run()
    assert world.state.setup is None
    assert world.state.setup_refused == {}
