"""Robots whose programs come to two meetings in different order wait for ever: named, with the way out."""

from dataclasses import replace

from cell.messages import Attendance, Event, Meets, Presence
from tests.unit.manager_world import Robot, World, settings


class AtMeet(Robot):
    """A robot whose program waits at the MEET of a meeting."""

    at = ""

    def presence(self) -> Presence:
        waits = Attendance(self.at, 1) if self.at else None
        return replace(super().presence(), meets=Meets(waits=waits))


def world(**at: str) -> World:
    """Robots left and right meet as `load` and as `unload`."""
    names = ("left", "right")
    made = World(replace(settings(names), meetings={"load": names, "unload": names}))
    for name in names:
        robot = AtMeet(name)
        robot.at = at[name]
        made.robots[name] = robot
    return made


def told(made: World) -> list[Event]:
    return [event for event in made.events if event.code == "meeting_deadlock"]


def test_two_that_wait_at_different_meetings_are_told_once_with_what_frees_them() -> None:
    made = world(left="load", right="unload")
    made.run(5.0)
    [event] = told(made)
    assert event.text in (
        "left waits at meeting load for right; right waits at meeting unload for left",
        "right waits at meeting unload for left; left waits at meeting load for right",
    )
    assert "`cell halt" in event.remedy
    [deadlock] = made.state.deadlocks
    assert sorted(deadlock.robots) == ["left", "right"]


def test_it_is_over_when_one_comes_to_the_other_meeting() -> None:
    made = world(left="load", right="unload")
    made.run(5.0)
    robot = made.robots["right"]
    assert isinstance(robot, AtMeet)
    robot.at = "load"
    assert made.run(1.0).state.deadlocks == ()


def test_who_waits_for_one_that_waits_nowhere_is_in_no_deadlock() -> None:
    made = world(left="load", right="")
    made.run(5.0)
    assert told(made) == []
