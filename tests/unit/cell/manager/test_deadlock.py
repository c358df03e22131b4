"""Circles of robots that wait for each other's zones: found once they last, named, and over when they are."""

from dataclasses import replace

import pytest

from cell.manager.deadlock import DeadlockWatch
from cell.manager.zones import Sight, Zone
from cell.messages import Deadlock, Event, Presence, Refusal, Token, ZoneState
from tests.unit.manager_world import Robot, World, settings

ROBOTS = ("a", "b", "c")
ZONES = ("z1", "z2", "z3")


class Needy(Robot):
    """A robot that keeps the zone `has` once it is granted, and then needs the zone `needs` in `in_s`."""

    has = needs = also = ""
    in_s = 0.0

    def presence(self) -> Presence:
        said = super().presence()
        token = said.holds.get(self.has)
        wants = {self.has: 0.0} | ({self.needs: self.in_s, self.also: self.in_s} if token is not None else {})
        holds: dict[str, Token] = {} if token is None else {self.has: token}
        return replace(said, holds=holds, wants={zone: s for zone, s in wants.items() if zone})


def world(*needs: tuple[str, str]) -> World:
    """Robots a, b and c, each with the zone that it has and the one that it needs."""
    made = World(settings(robots=ROBOTS, zones=ZONES))
    for name, (has, needed) in zip(ROBOTS, needs, strict=True):
        robot = Needy(name, wants=True)
        robot.has, robot.needs = has, needed
        made.robots[name] = robot
    return made


def told(made: World) -> list[Event]:
    return [event for event in made.events if event.code == "zone_deadlock"]


def present(made: World) -> tuple[Deadlock, ...]:
    return made.state.deadlocks


def test_a_circle_of_three_is_told_once_it_lasts_a_second_and_once_only() -> None:
    made = world(("z1", "z2"), ("z2", "z3"), ("z3", "z1"))
    made.run(0.9)
    assert told(made) == []
    made.run(5.0)
    [event] = told(made)
    assert event.text == ("a waits for zone z2 held by b; b waits for zone z3 held by c; c waits for zone z1 held by a")
    [deadlock] = present(made)
    assert (deadlock.robots, deadlock.zones) == (("a", "b", "c"), ("z2", "z3", "z1"))


def test_who_merely_waits_for_one_of_them_is_not_named() -> None:
    made = world(("z1", "z2"), ("z2", "z1"), ("z3", "z1"))
    made.run(3.0)
    [deadlock] = present(made)
    assert deadlock.robots == ("a", "b")


def test_a_circle_through_the_second_of_two_zones_that_are_needed_is_found() -> None:
    made = world(("z1", "z2"), ("z2", ""), ("z3", "z1"))
    made.robots["a"].also = "z3"  # type: ignore[attr-defined]
    made.run(3.0)
    [deadlock] = present(made)
    assert (deadlock.robots, deadlock.zones) == (("a", "c"), ("z3", "z1"))


def test_the_one_that_got_its_zone_last_is_sent_back() -> None:
    made = world(("", "z2"), ("z2", "z1"), ("", ""))
    made.run(0.5)
    made.robots["a"].has = "z1"  # type: ignore[attr-defined]
    made.run(3.0)
    [event] = told(made)
    assert "`cell override a -100` until it is out of z1" in event.remedy
    assert "b goes on by itself" in event.remedy


def test_robots_that_need_each_others_zones_only_later_are_no_deadlock() -> None:
    made = world(("z1", "z2"), ("z2", "z1"), ("", ""))
    for robot in made.robots.values():
        robot.in_s = 1.5  # type: ignore[attr-defined]
    made.run(5.0)
    assert told(made) == []


def test_a_chain_that_is_no_circle_is_no_deadlock() -> None:
    made = world(("z1", "z2"), ("z2", "z3"), ("z3", ""))
    made.run(5.0)
    assert told(made) == []


def test_it_is_over_when_one_gives_its_zone_up() -> None:
    made = world(("z1", "z2"), ("z2", "z1"), ("", ""))
    made.run(3.0)
    assert present(made) != ()
    made.robots["a"].has, made.robots["a"].needs = "", ""  # type: ignore[attr-defined]
    made.run(1.5)
    assert present(made) == ()


def test_who_holds_a_zone_and_is_kept_out_of_the_room_of_one_that_needs_it_is_told_the_way_back_out() -> None:
    zone = Zone("z1", ("a", "b"), (), 1)
    zone.state, zone.holder, zone.token, zone.queue = ZoneState.OCCUPIED, "a", Token(1, 1), ["b"]
    waits = Sight("b-1", True, True, False, False, None, True, 1, "", needed_in_s=0.0)
    kept_out = {"a": Refusal("b", "a would come within 20 mm of where b may be")}
    watch = DeadlockWatch()
    assert watch.look({"z1": zone}, {"z1": {"b": waits}}, kept_out, {}, 0.0, 0.0) == []
    [deadlock] = watch.look({"z1": zone}, {"z1": {"b": waits}}, kept_out, {}, 1.0, 1.0)
    assert (deadlock.robots, deadlock.zones) == (("a", "b"), ("z1",))
    assert deadlock.text == "a would come within 20 mm of where b may be; b waits for zone z1 held by a"
    assert "`cell override a -100` until it is out of z1, then `cell halt a`" in deadlock.remedy
    assert "b goes on by itself" in deadlock.remedy


def test_robots_that_want_nothing_but_room_are_left_to_the_watch_of_stand_offs() -> None:
    kept_out = {"a": Refusal("b", "a is in the way"), "b": Refusal("a", "b is in the way")}
    watch = DeadlockWatch()
    for now in (0.0, 1.0, 2.0):
        assert watch.look({}, {}, kept_out, {}, now, now) == []


@pytest.mark.parametrize("by", ["room", "zone"])
def test_who_waits_at_a_meet_in_the_way_of_one_that_is_waited_for_is_told_the_way_back(by: str) -> None:
    zone = Zone("z1", ("a", "b"), ("a", "b"), 1)
    zone.state, zone.holder, zone.queue = ZoneState.OCCUPIED, "a", ["b"]
    sights = {"b": Sight("b-1", True, True, False, False, None, True, 1, "", needed_in_s=0.0)}
    zones, kept_out = {"z1": zone}, {}
    if by == "room":
        zones, kept_out = {}, {"b": Refusal("a", "b would be in the way of a, which must get through first")}
    watch, at_meetings = DeadlockWatch(), {"a": ("load", ("b",))}
    assert watch.look(zones, {"z1": sights}, kept_out, at_meetings, 0.0, 0.0) == []
    [deadlock] = watch.look(zones, {"z1": sights}, kept_out, at_meetings, 1.0, 1.0)
    assert set(deadlock.robots) == {"a", "b"}
    assert "a waits at meeting load for b" in deadlock.text
    assert deadlock.remedy.startswith("let a back from its MEET: `cell override a -100` until b has got through, then")
    for now in (2.0, 3.0, 4.0):
        assert watch.look(zones, {"z1": sights}, kept_out, {}, now, now) == []
    assert watch.present == ()


def test_robots_that_wait_at_meets_alone_are_left_to_those() -> None:
    watch, at_meetings = DeadlockWatch(), {"a": ("load", ("b",)), "b": ("unload", ("a",))}
    for now in (0.0, 1.0, 2.0):
        assert watch.look({}, {}, {}, at_meetings, now, now) == []
