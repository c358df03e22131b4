"""Whose turn it is: all zones of a wish or none, priorities, and nobody waits for ever."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.manager.zone_turns import ZoneTurns
from cell.manager.zones import Sight, Zone
from cell.messages import Token

EPOCH = 5


class Line:
    """Robots outside of zones, which want some, keep what they are granted, and let it go again."""

    def __init__(self, robots: str, zones: str, priorities: dict[str, dict[str, int]] | None = None) -> None:
        self.robots = robots
        self.zones = {name: Zone(name, robots, (), EPOCH) for name in zones}
        self.turns = ZoneTurns({name: (priorities or {}).get(name, {}) for name in zones})
        self.wants: dict[str, dict[str, float]] = {robot: {} for robot in robots}
        self.has: dict[str, dict[str, Token]] = {robot: {} for robot in robots}
        self.lost: set[str] = set()
        """Robots that do not know where they are."""
        self.silent: set[str] = set()
        self.cycles = 0

    def want(self, robot: str, zones: str, in_s: float = 0.0) -> None:
        self.wants[robot] |= dict.fromkeys(zones, in_s)

    def leave(self, robot: str, zones: str) -> None:
        for name in zones:
            self.has[robot].pop(name, None)
            self.wants[robot].pop(name, None)

    def _sight(self, robot: str, name: str) -> Sight:
        wants, known = name in self.wants[robot], robot not in self.lost
        return Sight(
            "boot", robot not in self.silent, known, False, False, self.has[robot].get(name), wants, self.cycles, "",
            needed_in_s=self.wants[robot].get(name, float("inf")),
        )  # fmt: skip

    def cycle(self) -> list[tuple[str, str]]:
        """One of the manager's; what is granted: zones and robots."""
        sights = {name: {robot: self._sight(robot, name) for robot in self.robots} for name in self.zones}
        for name, zone in self.zones.items():
            zone.look(sights[name], self.cycles + 1)
        self.turns.line_up(self.zones, sights)
        granted = self.turns.grant(self.zones, sights, lambda: Token(EPOCH, self.cycles), self.cycles + 1)
        self.cycles += 1
        for name, robot in granted:
            token = self.zones[name].token
            assert token is not None
            self.has[robot][name] = token
        return granted

    def queue(self, name: str) -> str:
        return "".join(self.zones[name].queue)

    def why(self, name: str) -> str:
        return self.turns.why_free(name, self.zones).text


def test_zones_that_are_needed_together_are_granted_together_or_not_at_all() -> None:
    line = Line("ab", "xy")
    line.want("a", "y")
    assert line.cycle() == [("y", "a")]
    line.want("b", "xy")
    assert line.cycle() == []
    assert (line.queue("x"), line.why("x")) == ("b", "b needs with it zone y, held by a")
    line.leave("a", "y")
    assert line.cycle() == [("x", "b"), ("y", "b")]


def test_zones_that_are_needed_at_different_times_are_granted_one_by_one() -> None:
    line = Line("ab", "xy")
    line.want("a", "y")
    line.cycle()
    line.want("b", "x", 0.1)
    line.want("b", "y", 0.4)
    assert line.cycle() == [("x", "b")]


def test_what_a_robot_has_already_of_its_wish_it_does_not_wait_for() -> None:
    line = Line("ab", "xy")
    line.want("a", "x")
    line.cycle()
    line.want("a", "y")
    assert line.cycle() == [("y", "a")]


def test_who_waits_for_several_zones_is_not_overtaken_in_one_of_them() -> None:
    line = Line("abc", "xy")
    line.want("a", "y")
    line.cycle()
    line.want("b", "xy")
    line.cycle()
    line.want("c", "x")
    assert line.cycle() == []
    line.leave("a", "y")
    assert line.cycle() == [("x", "b"), ("y", "b")]


def test_a_zone_that_is_kept_because_another_one_is_kept_says_so() -> None:
    line = Line("abc", "xyz")
    for robot, zones in (("a", "y"), ("b", "xy"), ("c", "xz")):
        line.want(robot, zones)
        line.cycle()
    assert line.has["c"] == {}
    assert line.why("z") == "c needs with it zone x, for which b waits first"


def test_a_zone_is_not_kept_from_a_robot_that_holds_another_since_it_may_be_waited_for() -> None:
    line = Line("ab", "xy")
    line.want("a", "y")
    line.cycle()
    line.want("b", "xy")
    line.cycle()
    line.want("a", "x")
    assert line.cycle() == [("x", "a")]


@pytest.mark.parametrize("why", ["orphaned", "closed", "lost"])
def test_a_wish_that_only_a_person_can_help_keeps_no_zone_from_others(why: str) -> None:
    line = Line("abc", "xy")
    if why == "orphaned":
        line.want("a", "y")
        line.cycle()
        line.silent.add("a")
        found = "zone y, which is orphaned"
    elif why == "closed":
        line.zones["y"].robots = frozenset("ac")
        found = "zone y, which is closed for it"
    else:
        line.lost.add("b")
        found = ""
    line.want("b", "xy")
    line.cycle()
    assert found in line.why("x")
    line.want("c", "x")
    assert line.cycle() == [("x", "c")]


def test_a_higher_priority_goes_first_as_often_as_it_is_higher() -> None:
    line = Line("abc", "x", {"x": {"b": 2}})
    for robot in "cab":
        line.want(robot, "x")
        line.cycle()
    line.leave("c", "x")
    order = ""
    for _ in range(3):
        [(_, robot)] = line.cycle()
        order += robot
        line.has[robot].clear()  # gives it up, and asks for it again at once
    assert order == "bba"


def test_without_priorities_first_come_is_first_served() -> None:
    line = Line("abcd", "x")
    for robot in "dbca":
        line.want(robot, "x")
        line.cycle()
    assert line.queue("x") == "bca"
    line.leave("d", "x")
    line.cycle()
    line.want("d", "x")
    line.cycle()
    assert line.queue("x") == "cad"


@given(
    robots=st.integers(2, 5),
    priorities=st.dictionaries(
        st.sampled_from("xyz"), st.dictionaries(st.sampled_from("abcde"), st.integers(0, 4)), max_size=3
    ),
    seed=st.integers(0, 10_000),
)
@settings(max_examples=60, deadline=None)
def test_a_robot_that_waits_has_its_zones_after_a_bounded_number_of_grants(
    robots: int, priorities: dict[str, dict[str, int]], seed: int
) -> None:
    """Of grants in its zones: at most one to each of the others, and as many more as priorities differ."""
    names, chance = "abcde"[:robots], random.Random(seed)
    line = Line(names, "xyz", priorities)
    highest = max((n for each in priorities.values() for n in each.values()), default=0)
    passed = dict.fromkeys(names, 0)
    for _ in range(120):
        for robot in names:
            wish = line.wants[robot]
            if not wish and chance.random() < 0.7:
                line.want(robot, "".join(chance.sample("xyz", chance.choice((1, 1, 2, 3)))))
                passed[robot] = 0
            elif line.has[robot] and chance.random() < 0.5:
                line.leave(robot, "xyz")
        granted = line.cycle()
        for winner in {robot for _, robot in granted}:
            assert line.has[winner].keys() == line.wants[winner].keys(), "all or none"
            for robot in names:
                waits = line.wants[robot].keys() if not line.has[robot] else set()
                passed[robot] += bool(waits & line.wants[winner].keys())
                assert passed[robot] <= robots - 1 + highest
    for _ in range(2 * robots + 2):
        for robot in names:
            if line.has[robot]:
                line.leave(robot, "xyz")
        line.cycle()
    assert not any(line.wants.values()), "everybody had a turn"
