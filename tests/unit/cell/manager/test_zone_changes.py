"""A zone is changed while all robots stand and know it; nobody ever moves by the zone of before."""

from dataclasses import replace

import pytest

from cell.config.settings import PoseSettings, ZoneSettings
from cell.geometry import SpaceOf
from cell.manager.records import ZoneDecided
from cell.manager.zone_changes import CONFIRMED_WITHIN_S, WRITTEN_WITHIN_S, WriteZone, ZoneNotWritten, ZonesWritten
from cell.messages import Mode, Place, Presence, SetZone, ZoneState
from tests.unit.manager_world import INSIDE, OUTSIDE, Robot, World

THERE = PoseSettings((2.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
MOVE = SetZone("middle", "me", Place(THERE.position_m, THERE.quaternion_xyzw))


@pytest.fixture
def world() -> World:
    return World().run(0.3)


def as_ordered(world: World) -> dict[str, ZoneSettings]:
    return {"middle": replace(world.cell.zones["middle"], pose=THERE)}


def written(world: World) -> World:
    """The file is written as ordered."""
    world.manager.receive(ZonesWritten(as_ordered(world)), world.now)
    return world.run()


def test_the_change_is_announced_confirmed_written_and_then_in_force(world: World) -> None:
    before = world.zone.version
    request = world.ask(MOVE)
    world.run(0.05)
    assert world.state.zone_change == "middle"
    (write,) = world.zone_writes
    assert write == WriteZone(world.cell.file, MOVE, world.cell.zones)
    assert (world.zone.version, request in world.replies) == (before, False)
    written(world)
    assert world.state.zone_change is None
    assert world.replies[request].ok
    assert (
        world.replies[request].text
        == "zone middle: box 400 x 400 x 400 mm at X 2000 Y 0 Z 0 mm, A 0 B 0 C 0 deg, of the body"
    )
    assert world.geometry[-1].position_m == THERE.position_m
    assert world.zone.version == world.geometry[-1].version == int(world.replies[request].data) != before
    assert world.records[-1] == ZoneDecided("middle", "changed", "me", world.replies[request].text)
    assert world.events[-1].code == "zone_changed"


def test_no_state_names_the_new_version_before_the_one_that_ends_the_announcement(world: World) -> None:
    before = world.zone.version
    world.ask(MOVE)
    world.run(0.05)
    written(world)
    said = [(state.zone_change, state.zones["middle"].version != before) for state in world.states]
    assert set(said) == {(None, False), ("middle", False), (None, True)}
    assert said.index((None, True)) > said.index(("middle", False))


def test_a_robot_that_has_not_heard_of_it_yet_is_waited_for_and_after_that_nothing_has_changed(world: World) -> None:
    deaf = world.robots["left"]
    deaf.listen = lambda _: None  # type: ignore[method-assign]
    before, request = world.zone.version, world.ask(MOVE)
    world.run(0.15)
    assert (world.state.zone_change, world.zone_writes) == ("middle", [])
    world.run(CONFIRMED_WITHIN_S)
    assert world.state.zone_change is None
    assert not world.replies[request].ok
    assert "left" in world.replies[request].text
    assert (world.zone.version, world.zone_writes) == (before, [])


def test_a_robot_that_began_to_move_just_then_is_waited_for(world: World) -> None:
    request = world.ask(MOVE)
    world.run(0.01)
    world.left.moving = True
    world.run(0.3)
    assert world.zone_writes == []
    world.left.moving = False
    world.run(0.05)
    assert len(world.zone_writes) == 1
    assert request not in world.replies


def test_one_that_came_to_stand_where_the_zone_is_to_be_keeps_it_as_it_is(world: World) -> None:
    request = world.ask(MOVE)
    world.run(0.01)
    world.left.moving = True
    world.run(0.05)
    world.left.x, world.left.moving = 2.0, False
    world.run(CONFIRMED_WITHIN_S + 0.1)
    assert world.zone_writes == []
    assert "left stands where the zone is to be: lead it out with `cell jog left`" in world.replies[request].text


def goes_on(robot: Robot, mode: Mode) -> None:
    plain = robot.presence

    def presence() -> Presence:
        return replace(plain(), mode=mode)

    robot.presence = presence  # type: ignore[method-assign]


@pytest.mark.parametrize(
    ("hinders", "says"),
    [
        (lambda world: setattr(world.left, "moving", True), "left is not at rest yet"),
        (lambda world: setattr(world.left, "silent", True), "left is silent: start its agent"),
        (lambda world: goes_on(world.left, Mode.RUNNING), "left is running: `cell halt left`"),
        (lambda world: setattr(world.left, "wants", True), "left holds it: lead it out"),
        (lambda world: setattr(world.left, "x", 2.0), "left stands where the zone is to be"),
        (lambda world: setattr(world.left, "known", False), "left does not know where it is"),
    ],
)
def test_it_is_refused_with_who_and_what_to_do_while_somebody_hinders_it(
    world: World, hinders: object, says: str
) -> None:
    world.left.x = 1.9 if "does not know" in says else OUTSIDE
    world.run(0.1)
    hinders(world)  # type: ignore[operator]
    world.run(0.5)
    reply = world.call(MOVE)
    assert not reply.ok
    assert says in reply.text
    assert reply.text.startswith("zone middle is not changed: ")
    assert all(state.zone_change is None for state in world.states)


def test_a_zone_that_is_blocked_is_not_changed(world: World) -> None:
    world.left.wants = True
    world.run(0.2)
    world.left.x = INSIDE
    world.run(0.2)
    world.left.silent = True
    world.run(0.5)
    assert world.zone.state is ZoneState.ORPHANED
    assert "it is blocked" in world.call(MOVE).text


def test_nobody_is_granted_the_zone_meanwhile(world: World) -> None:
    world.ask(MOVE)
    world.run(0.05)
    world.left.wants = True
    world.run(0.3)
    assert (world.zone.state, world.zone.reason) == (ZoneState.FREE, "zone middle is being changed")
    written(world)
    assert world.zone.holder == "left"


def test_a_file_that_cannot_be_written_leaves_all_as_it_was(world: World) -> None:
    before, request = world.zone.version, world.ask(MOVE)
    world.run(0.05)
    world.manager.receive(ZoneNotWritten("disk full"), world.now)
    world.run(1.2)
    assert (world.replies[request].ok, world.replies[request].text) == (False, "zone middle stays as it was: disk full")
    assert (world.state.zone_change, world.zone.version) == (None, before)
    assert world.geometry[-1].position_m == (0.0, 0.0, 0.0)


def test_a_disk_that_hangs_lets_robots_go_on_after_a_while(world: World) -> None:
    before, request = world.zone.version, world.ask(MOVE)
    world.run(WRITTEN_WITHIN_S - 0.5)
    assert (world.state.zone_change, request in world.replies) == ("middle", False)
    world.run(1.0)
    assert (world.state.zone_change, world.zone.version, world.replies[request].ok) == (None, before, False)
    assert "was not written within 5 s: see to the disk" in world.replies[request].text
    again = world.ask(MOVE)
    world.run(0.1)
    assert "is being changed" in world.replies[again].text
    assert len(world.zone_writes) == 1
    written(world)
    assert world.zone.version == before
    world.ask(MOVE)
    world.run(0.1)
    written(world)
    assert world.zone.version != before


def test_who_goes_first_is_changed_while_robots_move(world: World) -> None:
    world.left.moving = True
    world.run(0.1)
    request = world.ask(SetZone("middle", "me", priority={"left": 2}))
    world.run(0.05)
    assert world.state.zone_change is None
    assert len(world.zone_writes) == 1
    zone = replace(world.cell.zones["middle"], priority={"left": 2})
    world.manager.receive(ZonesWritten({"middle": zone}), world.now)
    world.run()
    assert world.replies[request].text.endswith("priority left 2")
    assert world.manager._turns.priorities == {"middle": {"left": 2}}


def test_what_counts_in_it_changes_like_its_place(world: World) -> None:
    before = world.zone.version
    world.ask(SetZone("middle", "me", of=SpaceOf.TCP))
    world.run(0.05)
    world.manager.receive(ZonesWritten({"middle": replace(world.cell.zones["middle"], of=SpaceOf.TCP)}), world.now)
    world.run()
    assert world.zone.version != before
    assert world.geometry[-1].of is SpaceOf.TCP


@pytest.mark.parametrize(
    ("order", "says"),
    [
        (replace(MOVE, zone="elsewhere"), "no zone 'elsewhere'; this cell has middle"),
        (replace(MOVE, priority={"third": 1}), "a priority of third, which may not ask for zone middle; allowed: left"),
    ],
)
def test_what_the_file_does_not_allow_is_refused_before_anybody_is_stopped(
    world: World, order: SetZone, says: str
) -> None:
    assert says in world.call(order).text
    assert all(state.zone_change is None for state in world.states)


def test_one_change_at_a_time(world: World) -> None:
    world.ask(MOVE)
    world.run(0.05)
    assert world.call(MOVE).text == "zone middle is being changed; give the order again in a moment"


def test_an_order_in_view_of_an_old_state_is_not_carried_out(world: World) -> None:
    old = world.robots["left"].heard
    world.run(1.0)
    request = world.ask(MOVE, old)
    world.run()
    assert "too old to be carried out" in world.replies[request].text


def test_after_a_restart_with_the_written_file_the_zone_is_the_new_one(world: World) -> None:
    world.cell = replace(world.cell, zones=as_ordered(world))
    world.restart_manager(8, "m2")
    world.run(0.3)
    assert world.geometry[-1].position_m == THERE.position_m
    world.left.wants, world.left.x = True, OUTSIDE
    world.run(0.2)
    assert world.zone.holder == "left"
