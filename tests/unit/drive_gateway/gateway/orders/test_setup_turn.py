"""One robot in set-up at a time: what a gateway lets its drives do by themselves, by what the manager says."""

from dataclasses import replace

import pytest

from cell.core import Arrived, Request
from cell.messages import (
    AxisStatus,
    Call,
    DisableDrives,
    EnableDrives,
    Heard,
    HoldSetup,
    ManagerState,
    MoveAxes,
    Reply,
    SetupStatus,
)
from drive_gateway.config.settings import RobotDrives
from tests.unit.gateway_world import KindManager, World, axis, gateway_settings

MOVE = MoveAxes("left", {"J1": 0.1}, True, 1.0, False)


class SetupWorld(World):
    """An operator who holds `held`, and a manager that answers each state of the gateway."""

    def __init__(self, *others: str) -> None:
        robots = {name: RobotDrives(name, (axis("J1", 3 + i),)) for i, name in enumerate(others)}
        super().__init__(replace(gateway_settings(), robots={**gateway_settings().robots, **robots}))
        self.manager = KindManager()
        self.held = ""
        self.said = Reply("", False, "")
        self.ready()
        self.run(0.3)

    def cycle(self, lateness_s: float = 0.0) -> None:
        if self.held and round(self.now / 0.004) % 20 == 0:
            self.hold(self.held)
        super().cycle(lateness_s)

    def hold(self, robot: str, heard: Heard | None = None, order: str = "") -> str:
        self.counted += 1
        name = f"h{self.counted}"
        seen = heard or Heard(self.state.boot, self.state.sequence)
        self.tell(Request(name, Call(name, HoldSetup(robot, order or self.order), seen)))
        return name

    @property
    def order(self) -> str:
        """Id of the newest order that was let in."""
        return self.core._robots["left"].group.setup.order

    @property
    def motion(self) -> bool:
        return self.core._robots["left"].group.setup.motion is not None

    def has_torque(self) -> bool:
        return any(drive.status is not AxisStatus.SWITCH_ON_DISABLED for drive in self.drives.values())

    def moving(self) -> None:
        """`left` moves by itself, held."""
        assert self.ask(MOVE).ok
        self.held = "left"
        self.until(lambda: self.drives[1].status is AxisStatus.OPERATION_ENABLED)

    def say(self, **changes: object) -> None:
        """One state of a manager, in view of the newest state of the gateway."""
        heard = {"left_bus": Heard(self.state.boot, self.state.sequence)}
        self.manager_sequence = getattr(self, "manager_sequence", 100) + 1
        state = ManagerState("c", "m", 1, self.manager_sequence, self.now, "d", heard_gateways=heard)
        self.tell(Arrived(replace(state, **changes), self.now))


def test_a_motion_begins_when_the_manager_says_that_the_robot_is_free_and_not_before() -> None:
    world = SetupWorld()
    world.manager.free = False
    asked = world.request(MOVE)
    world.until(lambda: world.state.setup == ("left",))
    world.held = "left"
    world.run(0.5)
    assert asked not in world.replies
    assert not world.has_torque()
    world.manager.free = True
    world.until(lambda: asked in world.replies)
    assert world.replies[asked].ok
    world.until(world.has_torque)


def test_it_begins_with_its_operators_first_hold_so_who_has_let_go_by_then_moves_nothing() -> None:
    world = SetupWorld()
    assert world.ask(MOVE).ok
    world.until(lambda: "setup_stopped" in world.codes(), within_s=1.0)
    assert {status for drive in world.drives.values() for status in drive.statuses} == {AxisStatus.SWITCH_ON_DISABLED}


def test_a_hold_from_before_it_could_begin_does_not_let_it_begin() -> None:
    world = SetupWorld()
    before = Heard(world.state.boot, world.state.sequence)
    assert world.ask(MOVE).ok
    world.hold("left", before)
    world.run(0.3)
    assert not world.has_torque()


def test_holds_that_the_network_held_back_do_not_go_on_holding() -> None:
    world = SetupWorld()
    world.moving()
    world.held, last = "", Heard(world.state.boot, world.state.sequence)
    let_go = world.now
    while "setup_stopped" not in world.codes():
        world.hold("left", last)
        world.cycle()
        assert world.now - let_go < 0.8


def test_only_who_ordered_a_motion_holds_it() -> None:
    world = SetupWorld()
    world.moving()
    world.held, let_go = "", world.now
    while "setup_stopped" not in world.codes():
        other = world.hold("left", order="somebody else's")
        world.cycle()
        assert world.now - let_go < 0.8
    assert world.replies[other].text == "left: another order moves it"
    assert world.replies[other].data == "stopped"


def test_nobody_who_answers_within_the_patience_of_the_call_is_told_as_the_reason() -> None:
    world = SetupWorld()
    world.manager.free = False
    assert world.ask(MOVE).text == "left is not set up: right moves"
    assert world.state.setup == ()
    assert not world.motion


def test_without_a_manager_it_is_refused_and_with_the_flag_only_while_none_is_heard() -> None:
    world = SetupWorld()
    alone = replace(MOVE, alone=True)
    world.say()
    world.cycle()
    assert world.ask(alone).text == "left is not set up: a manager is heard, so ask for it with the manager"
    world.manager = None
    world.run(1.1)
    assert "the manager is silent, and only it keeps the other robots still" in world.ask(MOVE).text
    assert world.ask(alone).ok
    world.held = "left"
    world.until(world.has_torque)


def test_a_manager_that_is_heard_again_ends_a_motion_that_began_without_one() -> None:
    world = SetupWorld()
    world.manager = None
    world.run(1.1)
    assert world.ask(replace(MOVE, alone=True)).ok
    world.held = "left"
    world.until(world.has_torque)
    world.say()
    world.until(lambda: "setup_stopped" in world.codes(), within_s=1.0)


@pytest.mark.parametrize("how", ["dead", "not free", "another robot", "nobody"])
def test_a_manager_that_dies_or_takes_its_word_back_halts_the_motion_within_the_freshness_time(how: str) -> None:
    world = SetupWorld()
    world.moving()
    world.manager = None
    begun = world.now
    words = {
        "not free": SetupStatus("left", False, "right moves"),
        "another robot": SetupStatus("right", True),
        "nobody": None,
    }
    while world.core._robots["left"].group.setup.motion.problem == "":
        if how != "dead":
            world.say(setup=words[how])
        world.cycle()
        assert world.now - begun <= 0.25 + 0.03
    world.held = "left"
    world.until(lambda: "setup_stopped" in world.codes() and not world.has_torque(), within_s=3.0)


def test_what_a_manager_said_for_an_earlier_order_lets_no_later_one_begin() -> None:
    world = SetupWorld()
    world.manager = None
    earlier = Heard(world.state.boot, world.state.sequence)
    asked = world.request(MOVE)
    for _ in range(20):
        world.say(setup=SetupStatus("left", True), heard_gateways={"left_bus": earlier})
        world.cycle()
    assert asked not in world.replies
    world.say(setup=SetupStatus("left", True))
    world.cycle()
    world.cycle()
    assert world.replies[asked].ok


def test_a_manager_with_another_configuration_is_not_believed_and_both_digests_are_named() -> None:
    world = SetupWorld()
    world.manager = KindManager("other")
    text = world.ask(MOVE).text
    found = "the manager's configuration is other, this gateway's is d"
    assert text == f"left is not set up: {found}; start both with the same cell file"


def test_an_order_that_waits_keeps_its_robot_and_the_others_of_its_bus_off() -> None:
    world = SetupWorld("middle")
    owner = world.claim()
    world.manager.free = False
    asked = world.request(MOVE)
    world.until(lambda: world.state.setup == ("left",))
    assert world.ask(EnableDrives("left", owner)).text == "left is to be set up; enable it when that is done"
    second = world.ask(replace(MOVE, robot="middle"))
    assert second.text == "left is being set up; one robot at a time"
    assert world.ask(DisableDrives("left", owner)).ok
    assert world.replies[asked].text == "left: it was disabled"


def test_a_second_order_for_a_robot_that_waits_is_refused_and_the_first_one_is_answered() -> None:
    world = SetupWorld()
    world.manager.free = False
    first = world.request(MOVE)
    world.until(lambda: world.state.setup == ("left",))
    assert world.ask(MOVE).text == "left is being set up already"
    world.manager.free = True
    world.until(lambda: first in world.replies)
    assert world.replies[first].ok


def test_a_robot_that_the_manager_has_in_set_up_stays_so_for_a_gateway_that_starts_until_it_is_measured_at_rest() -> (
    None
):
    world = World()
    world.manager = None
    while world.state is None or not world.state.ready:
        if world.state is not None:
            heard = {"left_bus": Heard(world.state.boot, world.state.sequence)}
            state = ManagerState("c", "m", 1, round(1000 * world.now), world.now, "d", heard_gateways=heard)
            world.tell(Arrived(replace(state, setup=SetupStatus("left", False)), world.now))
            if not all(drive.nmt == 5 for drive in world.drives.values()) and world.now > 10.1:
                assert world.state.setup == ("left",)
        world.cycle()
    world.run(0.3)
    assert world.state.setup == ()
