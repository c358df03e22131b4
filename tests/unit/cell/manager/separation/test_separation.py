"""What people are told of robots that are kept apart."""

from dataclasses import replace

import numpy as np
import pytest

from cell.manager.separation.separation import Separation, SpaceNews
from cell.messages import Heard, PlannedWay, Presence, Sections, Stay, Way
from tests.unit.manager_world import settings
from tests.unit.plain_body import plain_body


def _section(number: int, x: float) -> Sections:
    """A ball of 0.1 m."""
    points = np.broadcast_to(np.float32([x, 0.0, 0.0]), (1, 1, 2, 3))
    return Sections(np.uint64([number]), points, np.float32([[0.1]]))


class Two:
    """Two balls on a line, and the manager that keeps them apart."""

    def __init__(self) -> None:
        self.separation = Separation(settings(), "m", 5)
        self._sequence = 0
        self.told: list[SpaceNews] = []
        self.cell_time = 0.0
        for robot, x in (("left", 0.0), ("right", 1.0)):
            self.says(robot, _section(ord(robot[0]), x), x)

    def says(
        self,
        robot: str,
        sections: Sections,
        x: float,
        owned: int = 1,
        plan: int = 0,
        stop_time_s: float = 0.0,
        owner: int = 1,
        known: bool = True,
    ) -> None:
        """It is at `x`, owns so many of these sections, and asks for the others; a plan begins there."""
        self._sequence += 1
        body = plain_body((0.1,), (((x, 0.0, 0.0, x, 0.0, 0.0),),), (0.0,), reach_m=0.5)
        body = replace(body, known=known, tcp_m=np.array([[x, 0.0, 1.25]], np.float32))
        pieces = np.zeros(len(sections) if plan else 0, np.uint32)
        way = Way(sections, owned, owned, ("hand",), plan=plan, pieces=pieces)
        heard = Heard("m", 1)
        presence = Presence(
            robot, f"{robot}{owner}", owner, self._sequence, heard, "digest", body, stop_time_s, epoch=5, way=way
        )
        self.told += self.separation.hear(presence)

    def answers(self, seconds: float = 0.02) -> dict[str, str]:
        """By robot, why nothing was cleared."""
        self.cell_time += seconds
        clearances, told = self.separation.clear(self.cell_time)
        self.told += told
        return {each.robot: each.refused.text for each in clearances if each.refused is not None}

    @property
    def codes(self) -> list[str]:
        return [each.code for each in self.told]


def test_a_robot_that_is_where_nothing_was_cleared_is_told_of_once() -> None:
    cell = Two()
    for step in range(5):
        cell.says("left", _section(10 + step, 0.3 + 0.01 * step), 0.3 + 0.01 * step)
    assert cell.codes == ["space_forced"]
    cell.says("left", _section(14, 0.34), 0.34)
    cell.says("left", _section(20, 0.2), 0.2)
    assert cell.codes == ["space_forced"] * 2


def test_a_robot_in_space_of_another_one_stops_all_once() -> None:
    cell = Two()
    for step in range(5):
        cell.says("left", _section(10 + step, 0.85 + 0.01 * step), 0.85 + 0.01 * step)
    assert cell.codes == ["space_breach"]
    assert cell.told[0].stops
    assert cell.told[0].text == "left is in space that is cleared for right"


def _going(cell: Two, stop_time_s: float) -> None:
    """Left owns its way to 0.45 m, and is at its beginning."""
    way = _section(ord("l"), 0.0)
    for number in range(1, 10):
        way = way.joined(_section(100 + number, 0.05 * number))
    cell.says("left", way, 0.0, stop_time_s=stop_time_s)
    cell.answers()
    cell.says("left", way, 0.0, owned=len(way), stop_time_s=stop_time_s)


@pytest.mark.parametrize("stop_time_s", [0.0, 0.3])
@pytest.mark.parametrize("how", ["started again", "referenced"])
def test_a_robot_that_appears_in_space_of_another_one_stops_all(how: str, stop_time_s: float) -> None:
    """It may have been pushed there while its agent was off; whether the other one drives or waits on its way."""
    cell = Two()
    _going(cell, stop_time_s)
    if how == "referenced":
        cell.says("right", _section(50, 1.0), 1.0, known=False)
    for _ in range(3):
        cell.says("right", _section(51, 0.35), 0.35, owner=2 if how == "started again" else 1)
    assert cell.codes == ["space_breach"]
    assert cell.told[0].stops
    assert cell.told[0].text == "right is in space that is cleared for left"


@pytest.mark.parametrize("x", [0.195, 0.2, 0.215])
def test_a_robot_that_appears_at_the_side_of_one_that_rests_stops_nobody(x: float) -> None:
    """Sections are 10 mm thicker than the robot: such robots may part."""
    cell = Two()
    ball = np.broadcast_to(np.float32([0.0, 0.0, 0.0]), (1, 1, 2, 3))
    cell.says("left", Sections(np.uint64([70]), ball, np.float32([[0.11]])), 0.0)
    cell.told.clear()
    cell.says("right", _section(51, x), x, owner=2)
    assert cell.codes == []


def test_nobody_parts_from_a_robot_that_moves() -> None:
    cell = Two()
    asks = _section(ord("r"), 1.0).joined(_section(40, 1.005))
    cell.says("left", _section(10, 0.79), 0.79, stop_time_s=0.3)
    cell.says("right", asks, 1.0)
    assert cell.answers() == {
        "right": "right's hand would come within 15.0 mm of where left's hand may be; 30 mm are kept"
    }
    cell.says("left", _section(10, 0.79), 0.79)
    cell.says("right", asks, 1.0)
    assert cell.answers() == {}


def test_robots_that_are_refused_for_each_other_for_a_second_are_a_stand_off() -> None:
    cell = Two()
    ahead = {"left": _section(30, 0.9), "right": _section(31, 0.1)}
    for _ in range(70):
        cell.says("left", _section(ord("l"), 0.0).joined(ahead["left"]), 0.0)
        cell.says("right", _section(ord("r"), 1.0).joined(ahead["right"]), 1.0)
        refused = cell.answers()
    assert refused == {
        "left": "left's hand would come into where right's hand may be; 30 mm are kept",
        "right": "right's hand would come into where left's hand may be; 30 mm are kept",
    }
    assert cell.codes == ["space_standoff"]
    (standoff,) = cell.separation.standoffs
    assert standoff.robots == ("left", "right")
    places = "the TCP of left is at X 0, Y 0, Z 1250 mm; the TCP of right is at X 1000, Y 0, Z 1250 mm"
    assert standoff.text == f"left and right wait for each other: {refused['left']}; {refused['right']}; {places}"
    for _ in range(70):
        cell.says("left", _section(ord("l"), 0.0), 0.0)
        cell.answers()
    assert cell.separation.standoffs == ()


def test_who_is_put_off_for_a_zone_waits_as_one_that_is_cleared_no_room() -> None:
    cell = Two()
    for robot, zones, x in (("left", "pq", 0.0), ("right", "qp", 1.0)):
        far = Sections()
        for number in range(8):
            far = far.joined(_section(50 + number, 100.0 * x + 50.0 + number))
        stays = (Stay(zones[0], 2, 4), Stay(zones[1], 4, 6))
        cell.separation.planned(PlannedWay(robot, robot, 1, 1, more=False, pieces=far, stays=stays))
        cell.says(robot, _section(ord(robot[0]), x), x, plan=1)
    cell.separation.hold({"p": "left", "q": None})
    for _ in range(2):
        why = cell.separation.why_not_grant("right", ["q"], ["left", "right"], cell.cell_time)
        assert why is not None
        assert why.text == "left must get through before right"
        cell.answers()
        assert cell.separation.waiting["right"].by == "left"
    cell.answers(1.0)
    assert cell.separation.waiting == {}, "it asks no more"


def test_who_has_not_reported_keeps_all_waiting_by_name() -> None:
    cell = Two()
    fresh = Separation(settings(), "m", 5)
    cell.separation = fresh
    cell.says("left", _section(ord("l"), 0.0).joined(_section(40, 0.2)), 0.0)
    say = "start its agent, or say where it stays: `cell confine right`"
    assert cell.answers() == {"left": f"right not heard yet: {say}"}
