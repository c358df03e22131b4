"""The rules of cleared space, on a line of places (`tests.sim.space_checker`): they hold, and each is needed."""

from dataclasses import replace

import pytest

from cell.manager.separation.ledger import MOST_OPEN, Ledger, Whereabouts
from cell.messages import Clearance, Heard, Presence, Way
from robot_agent.agent.space.owned_space import OwnedSpace
from tests.sim.space_checker import STEPS, Line, OnTheLine, Rules, places, presence
from tests.sim.space_checker import sections as cut


@pytest.mark.parametrize("first", range(0, 120, 30))
def test_two_robots_never_meet_whatever_becomes_of_messages_and_processes(first: int) -> None:
    lines = [Line(seed, Rules()) for seed in range(first, first + 30)]
    assert [line.run(STEPS) for line in lines] == [None] * len(lines)
    assert sum(line.moves for line in lines) > 10 * len(lines)


@pytest.mark.soak
def test_nor_in_two_thousand_runs() -> None:
    assert [seed for seed in range(2000) if Line(seed, Rules()).run(STEPS) is not None] == []


class _ForgetsCleared(Ledger):
    """Drops what it has cleared at the next presence, confirmed or not."""

    def hear(self, presence: Presence) -> Whereabouts:
        return super().hear(replace(presence, taken=2**62))


class _BodyOnly(Ledger):
    """Takes what a robot was sent for all that it may use."""

    def hear(self, presence: Presence) -> Whereabouts:
        return super().hear(replace(presence, way=replace(presence.way, owned=presence.way.committed)))


class _WaitsForNobody(Ledger):
    """Clears before all robots have named it."""

    @property
    def awaited(self) -> list[str]:
        return []


class _TakesLate(OwnedSpace):
    """Takes a clearance that it has confirmed, or passed over, before."""

    def take(self, clearance: Clearance) -> None:
        newest, self.taken = self.taken, -1
        super().take(clearance)
        self.taken = max(newest, self.taken)


class _IgnoresEpochs(OwnedSpace):
    """Takes clearances of every manager that it hears."""

    def heard_epoch(self, epoch: int) -> None:
        if epoch != self.epoch:
            self.epoch, self.taken = epoch, 0


_FAULTS = {
    "clearances are dropped unconfirmed": (Rules(ledger=_ForgetsCleared), 24),
    "only the way to rest is reserved": (Rules(ledger=_BodyOnly), 8),
    "a late clearance is used": (Rules(space=_TakesLate), 2406),
    "the manager does not wait for all": (Rules(ledger=_WaitsForNobody), 107),
    "epochs are ignored": (Rules(space=_IgnoresEpochs), 139),
}
"""With the first run in which the robots meet."""


@pytest.mark.parametrize("fault", _FAULTS)
def test_without_one_of_the_rules_they_meet(fault: str) -> None:
    rules, seed = _FAULTS[fault]
    assert Line(seed, rules).run(STEPS) is not None


def _way(sections: range, committed: int, owned: int) -> Way:
    return Way(cut(sections), committed, owned)


def _said(robot: str, way: Way, *, owner: int = 1, sequence: int = 1, taken: int = 0, epoch: int = 1) -> Presence:
    return presence(robot, f"boot {owner}", owner, sequence, way, Heard("m", 1), epoch, taken)


def _ledger() -> Ledger:
    ledger = Ledger({"r0", "r1"}, "m", 1, OnTheLine())
    ledger.hear(_said("r1", _way(range(9, 10), 1, 1)))
    return ledger


def test_what_is_asked_for_is_cleared_up_to_the_margin_from_the_other_robot() -> None:
    ledger = _ledger()
    ledger.hear(_said("r0", _way(range(2, 12), 1, 1)))
    (clearance,) = ledger.clear()
    assert clearance.cleared == 5  # 3 to 7: 8 is beside 9
    assert clearance.refused is not None
    assert clearance.refused.by == "r1"
    assert [places(each) for each in ledger.reserved("r0")] == [[2], [3, 4, 5, 6, 7]]


def test_a_late_presence_of_a_dead_agent_does_not_count_for_the_living_one() -> None:
    ledger = _ledger()
    ledger.hear(_said("r0", _way(range(2, 4), 2, 2), owner=5))
    ledger.hear(_said("r0", _way(range(20, 22), 2, 2), owner=4, sequence=90))
    assert [places(each) for each in ledger.reserved("r0")] == [[2, 3]]


def test_a_robot_that_does_not_know_where_it_is_stops_the_others_and_keeps_what_it_had() -> None:
    ledger = _ledger()
    said = _said("r1", Way(), owner=2)
    ledger.hear(replace(said, body=replace(said.body, known=False)))
    ledger.hear(_said("r0", _way(range(2, 5), 1, 1)))
    (clearance,) = ledger.clear()
    assert clearance.cleared == 0
    assert clearance.refused is not None
    assert "may be anywhere" in clearance.refused.text
    assert [places(each) for each in ledger.reserved("r1")] == [[9]]


def test_a_robot_that_is_where_nothing_was_reserved_for_it_is_there_from_now_on() -> None:
    ledger = _ledger()
    assert ledger.hear(_said("r0", _way(range(2, 4), 2, 2))) is Whereabouts.APPEARED
    assert ledger.hear(_said("r0", _way(range(7, 8), 1, 1), sequence=2)) is Whereabouts.BESIDE
    assert [places(each) for each in ledger.reserved("r0")] == [[7]]
    anew = _said("r0", _way(range(12, 13), 1, 1), owner=2)
    assert ledger.hear(anew) is Whereabouts.APPEARED, "a new claim begins anew"


def test_no_more_than_a_few_clearances_wait_for_their_confirmation() -> None:
    ledger = _ledger()
    for sequence in range(1, 2 * MOST_OPEN):
        ledger.hear(_said("r0", _way(range(2, 5), 1, 1), sequence=sequence))
        (clearance,) = ledger.clear()
        assert clearance.number == min(sequence, MOST_OPEN), "the newest one is repeated: all may have been lost"
    ledger.hear(_said("r0", _way(range(2, 5), 1, 1), sequence=99, taken=1))
    assert ledger.clear()[0].number == MOST_OPEN + 1


def test_clearances_of_a_claim_before_do_not_count_for_a_robot_that_has_to_find_out_first_where_it_is() -> None:
    ledger = _ledger()
    for sequence in range(1, MOST_OPEN + 1):
        ledger.hear(_said("r0", _way(range(2, 5), 1, 1), sequence=sequence))
        ledger.clear()
    lost = _said("r0", Way(), owner=2)
    ledger.hear(replace(lost, body=replace(lost.body, known=False)))
    assert [3, 4] in [places(each) for each in ledger.reserved("r0")], "it may still be there"
    ledger.hear(_said("r0", _way(range(2, 5), 1, 1), owner=2, sequence=2))
    assert [places(each) for each in ledger.reserved("r0")] == [[2]]
    (clearance,) = ledger.clear()
    assert (clearance.owner, clearance.cleared) == (2, 2)


def test_a_manager_that_hears_of_a_newer_one_clears_nothing_any_more() -> None:
    ledger = _ledger()
    ledger.hear(_said("r0", _way(range(2, 5), 1, 1), epoch=2))
    ledger.hear(_said("r0", _way(range(2, 5), 1, 1), sequence=2))
    assert ledger.deposed
    assert ledger.clear()[0].cleared == 0


def _clearance(number: int, report: int, cleared: int) -> Clearance:
    return Clearance("r0", "m", 1, 1, report, number, cleared)


def test_a_clearance_that_does_not_continue_what_is_owned_is_taken_and_thrown_away() -> None:
    space = OwnedSpace(1, 1)
    way = [3, 4, 5, 6]
    assert space.follow(way, 1) == 1
    space.ask(1, way[1:])
    back = [3, 2, 1]
    assert space.follow(back, 1) == 1
    space.take(_clearance(1, 1, 3))
    assert space.taken == 1
    assert space.follow(back, 1) == 1
    assert space.follow(way, 1) == 1, "what was thrown away does not come back"


def test_what_lies_behind_and_what_is_renounced_is_given_up() -> None:
    space = OwnedSpace(1, 1)
    way = [3, 4, 5, 6]
    space.follow(way, 1)
    space.ask(1, way[1:])
    space.take(_clearance(1, 1, 3))
    assert space.follow(way, 1) == 4
    assert space.follow(way[1:], 1) == 3
    assert space.follow(way[1:], 2, renounce=True) == 2
    assert space.follow(way[1:], 1) == 2
