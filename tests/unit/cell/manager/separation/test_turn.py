"""Whose turn it is: nobody waits for ever while others pass again and again."""

from hypothesis import given, settings
from hypothesis import strategies as st

from cell.manager.separation.turn import PATIENCE_S, Turn
from cell.messages import Clearance, Refusal
from tests.unit.cell.manager.separation.ways import Ways, again_and_again, two_loop_and_one_waits

_STEP_S = 0.1


class Answered:
    """Robots on planned ways that ask in every step, and are let on by one piece where they may."""

    def __init__(self, ways: Ways) -> None:
        self.ways, self.turn = ways, Turn(ways.order)
        self.now, self.refused = 0.0, dict[str, Refusal]()
        self.halted = ""
        self.longest_s = 0.0
        """That a robot waited."""

    def step(self) -> None:
        """They ask in their order: whoever comes first takes the room."""
        self.now += _STEP_S
        for robot, count in self.ways.counts.items():
            if robot == self.halted or self.ways.at[robot] == count - 1:
                self.refused.pop(robot, None)
                continue
            went = self.ways.onward(robot, 1)
            self.turn.answered(Clearance(robot, "m", 5, 1, 1, 1, went), self.now)
            if went:
                waited = self.refused.pop(robot, None)
                self.longest_s = max(self.longest_s, self.now - waited.since if waited else 0.0)
            elif robot not in self.refused:
                other = self.ways.in_the_way_of(robot)
                self.refused[robot] = Refusal(other, "", since=self.now)
        self.turn.pass_on(self.refused, self.now)

    def lasts(self, seconds: float) -> None:
        until = self.now + seconds
        while self.now < until:
            self.step()


def test_who_was_cleared_nothing_for_two_seconds_is_next_until_it_is_through() -> None:
    cell = Answered(two_loop_and_one_waits())
    cell.lasts(PATIENCE_S)
    assert cell.ways.order.turn == ""
    cell.lasts(0.5)
    assert cell.ways.order.turn == "c"
    cell.lasts(1.0)
    assert cell.ways.at["c"] == 5
    assert cell.ways.order.turn == ""


def test_while_who_is_in_its_way_stands_others_go_on() -> None:
    cell = Answered(two_loop_and_one_waits())
    cell.halted = "a"
    cell.lasts(2.0 * PATIENCE_S)
    assert cell.ways.at["c"] < 2
    assert cell.ways.order.turn == ""
    cell.lasts(5.0)
    assert cell.ways.at["b"] == 61
    cell.halted = ""
    cell.lasts(3.0)
    assert cell.ways.at["c"] == 5


def test_who_waits_for_one_without_a_planned_way_keeps_nobody_else_waiting() -> None:
    ways = two_loop_and_one_waits()
    turn = Turn(ways.order)
    turn.answered(Clearance("c", "m", 5, 1, 1, 1, 0), 3.0)
    for robot in "ab":
        turn.answered(Clearance(robot, "m", 5, 1, 1, 1, 1), 3.0)
    turn.pass_on({"c": Refusal("jogged", "", since=0.0)}, 3.0)
    assert ways.order.turn == ""
    turn.pass_on({"c": Refusal("a", "", since=0.0)}, 3.0)
    assert ways.order.turn == "c"


@given(st.integers(0, 10**9))
@settings(max_examples=20, deadline=None)
def test_nobody_waits_for_longer_than_a_turn_of_each_takes(seed: int) -> None:
    ways = again_and_again(seed, 12)
    cell = Answered(ways)
    once_s = _STEP_S * sum(ways.counts.values()) / 12
    while not ways.done:
        cell.step()
        assert cell.now < 100.0 * once_s, ways.at
    assert cell.longest_s < (PATIENCE_S + once_s) * len(ways.counts)
