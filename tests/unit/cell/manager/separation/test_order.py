"""Who is let in: wherever robots begin safely, all of them get to the end of their ways."""

import random
from collections.abc import Iterator
from itertools import cycle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry.arrays import Flags
from cell.manager.separation.order import Order
from cell.messages import Body, PlannedWay, Presence, Sections, Stay, Way
from cell.messages.sections import NO_PIECE
from tests.unit.cell.manager.separation.ways import Ways, again_and_again, drawn_ways, pieces_of, two_loop_and_one_waits


@given(st.integers(0, 10**9))
@settings(max_examples=150, deadline=None)
def test_from_a_safe_beginning_everybody_gets_to_the_end_of_its_way(seed: int) -> None:
    ways, rng = drawn_ways(seed), random.Random(seed + 1)
    for _ in range(60 * len(ways.counts)):
        ways.onward(rng.choice(sorted(ways.counts)), rng.randint(1, 4))
    assert ways.done, ways.at


@given(st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_also_where_robots_say_later_than_they_were_let_in_where_they_may_be(seed: int) -> None:
    ways, rng = drawn_ways(seed), random.Random(seed + 1)
    for _ in range(60):
        for robot in rng.sample(sorted(ways.counts), len(ways.counts)):
            ways.let_in(robot, rng.randint(1, 4))
        for robot in ways.counts:
            ways.hear(robot)
    assert ways.done, ways.at


def _with_zones(seed: int) -> Ways:
    """As `drawn_ways`, with ways that lead through zones, some of them through two at a time."""
    once, rng = drawn_ways(seed), random.Random(seed + 2)
    stays: dict[str, tuple[Stay, ...]] = {}
    for robot, count in once.counts.items():
        drawn: list[Stay] = []
        for zone in rng.sample("pqr", rng.randint(0, 3)):
            first = rng.randint(1, count - 2)
            drawn.append(Stay(zone, first, rng.randint(first, count - 2)))
        stays[robot] = tuple(sorted(drawn, key=lambda stay: stay.first))
    return Ways(once.counts, once.known.near, stays)


@given(st.integers(0, 10**9))
@settings(max_examples=150, deadline=None)
def test_through_zones_too_everybody_gets_to_the_end_of_its_way(seed: int) -> None:
    ways, rng = _with_zones(seed), random.Random(seed + 1)
    for _ in range(80 * len(ways.counts)):
        robot = rng.choice(sorted(ways.counts))
        ways.ask(robot, rng.randint(1, 3))
        ways.onward(robot, rng.randint(1, 4))
    assert ways.done, (ways.at, ways.holders)


def test_where_zones_are_granted_without_the_order_some_of_them_wait_for_ever() -> None:
    stuck = 0
    for seed in range(60):
        ways, rng = _with_zones(seed), random.Random(seed + 1)
        ways.order.why_not_grant = lambda _robot, _zones, _going: None  # type: ignore[method-assign]
        for _ in range(80 * len(ways.counts)):
            robot = rng.choice(sorted(ways.counts))
            ways.ask(robot, rng.randint(1, 3))
            ways.onward(robot, rng.randint(1, 4))
        stuck += not ways.done
    assert stuck > 5


@given(st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_through_zones_too_whosever_turn_it_is_everybody_gets_to_the_end_of_its_way(seed: int) -> None:
    ways, rng = _with_zones(seed), random.Random(seed + 1)
    for tries, robot in enumerate(_turns(ways, rng)):
        ways.ask(robot, rng.randint(1, 3))
        ways.onward(robot, rng.randint(1, 4))
        assert tries < 200 * len(ways.counts), (ways.at, ways.holders, ways.order.turn)


def _through_both(zones_of_a: str, zones_of_b: str) -> Ways:
    """Each stands for a while in its first zone before it goes to its second one."""
    stays = {
        robot: (Stay(zones[0], 2, 4), Stay(zones[1], 4, 6)) for robot, zones in (("a", zones_of_a), ("b", zones_of_b))
    }
    return Ways({"a": 8, "b": 8}, set(), stays)


def test_of_two_that_need_each_others_zones_the_second_one_is_put_off() -> None:
    ways = _through_both("pq", "qp")
    assert ways.ask("a", 3) == ""
    assert ways.ask("b", 3) == "a must get through before b", "also where a has it in front of it"
    ways.onward("a", 3)
    assert ways.ask("b", 3) == "a must get through before b"
    assert ways.ask("a", 2) == ""
    ways.onward("a", 4)
    ways.ask("a", 1)
    assert (ways.at["a"], ways.ask("b", 3)) == (7, "")


def test_zones_in_the_same_order_are_granted_one_after_the_other() -> None:
    ways = _through_both("pq", "pq")
    assert ways.ask("a", 3) == ""
    ways.onward("a", 4)
    assert ways.ask("b", 3) == "another one has it"
    assert ways.ask("a", 2) == ""
    ways.onward("a", 1)
    ways.ask("a", 1)
    assert ways.ask("b", 3) == ""


def test_a_zone_and_room_that_two_robots_need_in_turn_are_one_circle() -> None:
    room = {frozenset([("a", i), ("b", j)]) for i in (4, 5) for j in (2, 3)}
    ways = Ways({"a": 8, "b": 8}, room, {"a": (Stay("p", 2, 5),), "b": (Stay("p", 3, 5),)})
    ways.hear("b", 2)
    assert ways.ask("a", 3) == "b must get through before a", "a would stand in p, b in the room before p"


@pytest.mark.parametrize(("at", "stay"), [(2, (2, 4)), (0, (0, 4)), (3, (3, 3)), (4, (2, 4))])
def test_who_stands_in_front_of_a_zone_or_behind_it_without_having_it_keeps_nobody_out(
    at: int, stay: tuple[int, int]
) -> None:
    """Its first piece begins in front of the zone, its last one ends behind it."""
    ways = Ways({"a": 8, "b": 8}, set(), {"a": (Stay("p", *stay),), "b": (Stay("p", 2, 4),)})
    ways.hear("a", at)
    assert ways.ask("b", 3) == ""


def test_who_is_let_in_beyond_a_zone_keeps_nobody_out_before_it_says_so() -> None:
    ways = Ways({"a": 8, "b": 8}, set(), {"a": (Stay("p", 2, 4),), "b": (Stay("p", 2, 4),)})
    ways.hear("a", 2)
    ways.order.let_in("a", [3, 4])
    assert ways.ask("b", 3) == ""


@pytest.mark.parametrize("more", [False, True])
def test_who_ends_in_a_zone_is_granted_it_all_the_same(more: bool) -> None:
    """It may go on, if by another program; who needs the zone after it waits for that, as without an order."""
    ways = Ways({"a": 5, "b": 8}, set(), {"b": (Stay("p", 2, 4),)})
    ways.stays["a"] = (Stay("p", 2, 4),)
    ways.order.planned(PlannedWay("a", "b", 1, 2, more=more, pieces=pieces_of("a", 5), stays=ways.stays["a"]))
    ways.hear("a", plan=2)
    assert ways.ask("a", 3) == ""
    assert ways.ask("b", 3) == "another one has it"


def test_who_is_silent_keeps_nobody_out_of_a_zone_that_is_free() -> None:
    ways = _through_both("pq", "qp")
    ways.ask("a", 3)
    assert ways.ask("b", 3) == "a must get through before b"
    ways.going = {"b"}
    assert ways.ask("b", 3) == ""


def test_nothing_is_granted_by_a_plan_that_has_not_been_heard_yet() -> None:
    ways = _through_both("pq", "qp")
    ways.hear("b", plan=2)
    assert ways.ask("b", 3) == "what b has planned has not been heard yet"
    ways.hear("b", plan=0)
    assert ways.ask("b", 3) == "", "it has none any more"


def test_a_plan_of_a_claim_before_counts_no_more() -> None:
    ways = _through_both("pq", "qp")
    ways.ask("a", 3)
    section = pieces_of("a", 1)
    body, way = Body(True, (0.0, 0.0, 0.0), 1.0), Way(section, 1, 1, plan=1, pieces=np.uint32([0]))
    ways.order.hear(Presence("a", "b", 2, 1, None, "", body, 0.0, way=way), {})
    assert not ways.order.plans("a")


def test_stays_that_nobody_could_have_are_borne() -> None:
    far, strange = 2**62, (Stay("p", 2**62, 2**62), Stay("nowhere", 0, 7), Stay("p", 6, 1), Stay("q", 3, 2**62))
    ways = Ways({"a": 8, "b": 8}, set(), {"a": strange, "b": (Stay("p", 2, 4), Stay("q", 0, far))})
    for robot in "ab":
        ways.order.hold({"p": robot, "q": None})
        ways.order.why_not_grant(robot, ["p", "q"], "ab")
        ways.onward(robot, 4)


def test_who_goes_back_out_of_a_zone_gives_it_back() -> None:
    ways = _through_both("pq", "qp")
    ways.order.why_not_grant = lambda _robot, _zones, _going: None  # type: ignore[method-assign]
    for robot in "ab":
        ways.ask(robot, 3)
        ways.onward(robot, 3)
    ways.order.hold(ways.holders)
    assert ways.at == {"a": 3, "b": 3}
    assert ways.order.way_back("a", ["a", "b"]) == 2


def test_whoever_has_no_planned_way_is_granted_what_is_free() -> None:
    ways = _through_both("pq", "qp")
    ways.ask("a", 3)
    ways.order.leave_out("b")
    assert ways.order.why_not_grant("b", ["q"], "ab") is None


def test_without_an_order_some_of_them_block_each_other() -> None:
    stuck = 0
    for seed in range(60):
        ways, rng = drawn_ways(seed), random.Random(seed + 1)
        ways.order.admitted = lambda _robot, pieces: (len(pieces), None)  # type: ignore[method-assign]
        for _ in range(60 * len(ways.counts)):
            ways.onward(rng.choice(sorted(ways.counts)), rng.randint(1, 4))
        stuck += not ways.done
    assert stuck > 5


def _turns(ways: Ways, rng: random.Random) -> Iterator[str]:
    """Who tries to go on next, at random; meanwhile it is somebody's turn until that one is through."""
    while not ways.done:
        turn = ways.order.turn
        if not turn or ways.order.is_clear(turn) or not ways.order.goes_first(turn):
            ways.order.turn = rng.choice(["", *sorted(ways.counts)])
        yield rng.choice(sorted(ways.counts))


@given(st.integers(0, 10**9))
@settings(max_examples=120, deadline=None)
def test_whosever_turn_it_is_everybody_gets_to_the_end_of_its_way(seed: int) -> None:
    ways, rng = again_and_again(seed, 2), random.Random(seed + 1)
    for tries, robot in enumerate(_turns(ways, rng)):
        ways.onward(robot, rng.randint(1, 4))
        assert tries < 150 * len(ways.counts), (ways.at, ways.order.turn)


@given(st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_who_is_not_before_the_one_whose_turn_it_is_does_not_come_before_it(seed: int) -> None:
    ways, rng = again_and_again(seed, 3), random.Random(seed + 1)
    for robot, _ in zip(_turns(ways, rng), range(100), strict=False):
        turn = ways.order.turn
        before = set() if not turn or turn == robot else ways.order.before(turn)
        ways.onward(robot, rng.randint(1, 4))
        if turn and turn != robot:
            assert ways.order.before(turn) <= before


def _passed_before(ways: Ways) -> int:
    """How many times the two go through the middle before the third one is in there."""
    for robot in cycle("abc"):
        ways.onward(robot, 1)
        if ways.at["c"] >= 3:
            return ways.at["a"] // 6 + ways.at["b"] // 6
    raise AssertionError


def test_two_that_passagain_and_again_let_a_third_one_through_when_it_is_its_turn() -> None:
    assert _passed_before(two_loop_and_one_waits()) > 15, "they are always in its way: the test shows nothing"
    ways = two_loop_and_one_waits()
    ways.order.turn = "c"
    assert _passed_before(ways) <= 2


def test_who_waits_because_it_is_another_one_s_turn_is_told_so() -> None:
    ways = two_loop_and_one_waits()
    ways.onward("c", 1)
    ways.order.turn = "c"
    admitted, why = ways.order.admitted("b", [1, 2])
    assert admitted == 1
    assert why is not None
    text = "b would be in the way of c, which has waited for long and goes first, after a"
    assert (why.by, why.text) == ("a", text), "a can go on at once"


def test_the_rest_of_the_piece_in_which_a_robot_stands_is_ahead_of_it() -> None:
    """By their sections two robots fit in pieces that are too near to each other; neither gets out of its own."""
    ways = Ways({"a": 6, "b": 6}, {frozenset([("a", i), ("b", j)]) for i in (2, 3) for j in (2, 3)})
    ways.hear("a", 2)
    assert ways.order.admitted("b", [1, 1, 2])[0] == 2


def test_who_can_go_to_a_bay_is_let_in_though_others_have_to_pass_behind_it() -> None:
    early = {frozenset([("a", 1), ("b", 3)])}
    late = {frozenset([("a", 4), ("b", j)]) for j in (1, 3)}
    ways = Ways({"a": 6, "b": 6}, early | late)
    ways.hear("a", 1)
    assert ways.order.admitted("b", [1]) == (1, None), "b would be in a's way, a in b's: but a has a bay at 2"


CROSSING = {frozenset([("a", i), ("b", j)]) for i in (2, 3) for j in (2, 3)}


def test_who_would_stand_in_the_way_of_another_one_waits_in_front_of_it() -> None:
    ways = Ways({"a": 6, "b": 6}, CROSSING)
    assert ways.onward("a", 2) == 2
    admitted, why = ways.order.admitted("b", [1, 2])
    assert admitted == 1, "in piece 2 each would stand in the other's way out"
    narrow = {frozenset([("a", i), ("b", j)]) for i in range(1, 5) for j in range(1, 5)}
    ways = Ways({"a": 6, "b": 6}, narrow | {frozenset([("a", 1), ("b", 4)])})
    ways.hear("a", 1)
    admitted, why = ways.order.admitted("b", [1])
    assert admitted == 0
    assert why is not None
    assert why.by == "a"
    assert why.text == "b would be in the way of a, which must get through first"


def test_of_two_that_end_at_one_place_one_gets_there_and_neither_stands_in_its_way() -> None:
    ends = {frozenset([("a", i), ("b", j)]) for i in (3, 4, 5) for j in (3, 4, 5) if i + j > 7}
    ways = Ways({"a": 6, "b": 6}, ends)
    assert ways.onward("a", 3) == 3
    assert ways.onward("b", 5) == 2, "in piece 3 it would keep a from its end"
    assert ways.onward("a", 5) == 2


@given(st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_who_is_refused_waits_in_the_end_for_one_that_can_go_on(seed: int) -> None:
    ways, rng = again_and_again(seed, 2), random.Random(seed + 1)
    for robot in _turns(ways, rng):
        if ways.at[robot] < ways.counts[robot] - 1:
            _, why = ways.order.admitted(robot, [ways.at[robot] + 1])
            if why is not None:
                assert ways.goes_in_the_end(robot)
        ways.onward(robot, rng.randint(1, 4))


def test_who_ends_in_the_way_of_another_one_goes_after_it() -> None:
    ways = Ways({"a": 6, "b": 6}, {frozenset([("a", 5), ("b", 3)])})
    assert ways.order.admitted("b", [1, 2]) == (2, None), "b first, then a: though a could go at once"
    assert ways.order.admitted("a", [1, 2, 3, 4, 5])[0] == 4


def test_a_plan_that_ends_in_the_way_of_another_one_is_too_short() -> None:
    ways = Ways({"a": 6, "b": 6}, {frozenset([("a", 5), ("b", 3)])})
    assert not ways.order.look_further("a"), "there is no more of it"
    ways.order.planned(PlannedWay("a", "b", 1, 2, more=True, pieces=pieces_of("a", 6)))
    section = pieces_of("a", 1)
    body, way = Body(True, (0.0, 0.0, 0.0), 1.0), Way(section, 1, 1, plan=2, pieces=np.uint32([0]))
    ways.order.hear(Presence("a", "b", 1, 2, None, "", body, 0.0, way=way), {int(section.ids[0]): 0})
    assert ways.order.look_further("a")
    assert not ways.order.look_further("b")
    ways.hear("b", 4)
    assert not ways.order.look_further("a"), "b has passed"


def test_a_plan_counts_from_the_presence_that_counts_in_it() -> None:
    ways = Ways({"a": 6, "b": 6}, CROSSING)
    ways.order.planned(PlannedWay("a", "b", 1, 2, more=False, pieces=pieces_of("a", 3)))
    assert ways.order.knows("a", 1)
    assert not ways.order.knows("a", 2)


def test_who_counts_beyond_the_end_of_its_plan_is_let_in_nowhere() -> None:
    ways = Ways({"a": 4, "b": 4}, set())
    ways.order.hold({"p": None})
    ways.hear("a", at=7)
    assert not ways.order.knows("a", 1)
    assert ways.order.why_not_grant("a", ["p"], ["a", "b"]) is not None
    ways.hear("a", at=2)
    assert ways.order.knows("a", 1)
    assert ways.order.why_not_grant("a", ["p"], ["a", "b"]) is None


def test_sections_outside_the_plan_do_not_move_a_robot_along_it() -> None:
    ways = Ways({"a": 6, "b": 6}, CROSSING)
    assert ways.order.admitted("a", [NO_PIECE, NO_PIECE]) == (2, None)


def test_who_has_to_back_is_told_how_far() -> None:
    nose = {frozenset([("a", i), ("b", j)]) for i in (2, 3, 4) for j in (2, 3, 4)}
    ways = Ways({"a": 6, "b": 6}, nose - {frozenset([("a", 2), ("b", 2)])})
    ways.hear("a", 2)
    ways.hear("b", 2)
    assert ways.order.way_back("a", ["a", "b"]) == 1
    assert ways.order.way_back("b", ["a", "b"]) == 1
    assert ways.order.way_back_m("a", ["a", "b"]) == pytest.approx(0.06)
    ways.hear("a", 4)
    assert ways.order.way_back_m("a", ["a", "b"]) == pytest.approx(0.18)
    assert ways.order.way_back_m("c", ["a", "b"]) is None


_BODY = Body(True, (0.0, 0.0, 0.0), 1.0)


def _sections(ids: list[int]) -> Sections:
    return Sections(np.uint64(ids), np.zeros((len(ids), 1, 2, 3), np.float32), np.zeros((len(ids), 1), np.float32))


def _tell(order: Order, robot: str, number: int, ids: list[int], at: int = 0) -> None:
    pieces = _sections(ids)
    order.planned(PlannedWay(robot, "b", 1, number, more=False, pieces=pieces))
    way = Way(pieces[at : at + 1], 1, 1, plan=number, pieces=np.uint32([at]))
    order.hear(Presence(robot, "b", 1, number, None, "", _BODY, 0.0, way=way), {ids[at]: at})


class OfIds:
    """Places are too near to each other as pairs of their ids say."""

    def __init__(self, near: set[frozenset[int]]) -> None:
        self.near = near

    def too_near(self, _robot: str, sections: Sections, _other: str, others: Sections) -> Flags:
        one, its = sections.ids.tolist(), others.ids.tolist()
        return np.array([[frozenset([i, j]) in self.near for j in its] for i in one], bool).reshape(len(one), len(its))


@pytest.mark.parametrize(
    ("near_has", "near_wants", "way_back"),
    [(None, None, 1), (1, None, None), (0, None, 1), (None, 1, 0), (2, 2, 1)],
)
def test_a_way_back_goes_by_where_a_robot_stands_that_is_beside_its_path(
    near_has: int | None, near_wants: int | None, way_back: int | None
) -> None:
    """By its plan alone one was let back in vain, again and again (seed 240004)."""
    near = {frozenset([i, 10 + j]) for i in (2, 3, 4) for j in (0, 2, 3, 4)} - {frozenset([2, 10])}
    near |= {frozenset([near_has, 20]), frozenset([near_wants, 21])}  # type: ignore[arg-type]
    order = Order(OfIds(near))
    _tell(order, "a", 1, list(range(6)), at=2)
    _tell(order, "b", 1, list(range(10, 16)))
    way = Way(_sections([20, 21]), 1, 1, plan=1, pieces=np.uint32([NO_PIECE, NO_PIECE]))
    order.hear(Presence("b", "b", 1, 2, None, "", _BODY, 0.0, way=way), {20: NO_PIECE})
    assert order.way_back("b", ["a", "b"]) is None, "nobody goes back along a path beside which it stands"
    assert order.way_back("a", ["a", "b"]) == way_back


class ById:
    """Places are too near to each other as their ids say; how many pairs were asked for."""

    asked = 0

    def too_near(self, _robot: str, sections: Sections, _other: str, others: Sections) -> Flags:
        self.asked += len(sections) * len(others)
        return (sections.ids[:, None] * np.uint64(7) + others.ids * np.uint64(11)) % np.uint64(3) == 0


@given(st.integers(0, 10**9))
@settings(max_examples=60, deadline=None)
def test_a_plan_that_goes_on_as_the_one_before_is_the_same_to_the_order_as_a_new_one(seed: int) -> None:
    """Some of its places were in the plan before, in any order, and some come several times."""
    rng = random.Random(seed)
    conflicts = ById()
    long, plans = Order(conflicts), dict[str, list[int]]()
    for number in range(1, 8):
        for robot in rng.sample("ab", rng.randint(1, 2)) if number > 1 else "ab":
            before = plans.get(robot, [])
            kept = before[rng.randint(0, len(before)) :]
            plans[robot] = [*kept, *(rng.randint(0, 50) for _ in range(rng.randint(1, 6)))]
            _tell(long, robot, number, plans[robot])
        new = Order(ById())
        for robot, ids in plans.items():
            _tell(new, robot, 1, ids)
        for robot, ids in plans.items():
            asked = range(1, len(ids))
            assert long.admitted(robot, asked) == new.admitted(robot, asked)
            assert long.before(robot) == new.before(robot)


def test_what_is_the_same_in_two_plans_is_measured_once() -> None:
    conflicts = ById()
    order = Order(conflicts)
    for robot, ids in (("a", range(100)), ("b", range(200, 300))):
        _tell(order, robot, 1, list(ids))
    order.before("a")
    before = conflicts.asked
    _tell(order, "a", 2, list(range(10, 110)))
    order.before("a")
    assert conflicts.asked - before == 10 * 100
