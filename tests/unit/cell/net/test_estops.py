"""The emergency stops as each process keeps them."""

from cell.messages import Estop, Heard, ManagerState
from cell.net.estops import MOST_OBEYED, REMEMBERED, Estops, ObeyedEstops

FIRST, SECOND = Estop("e1", True, "anna", "door"), Estop("e2", True, "bert", "trial")


def over(estop: Estop) -> Estop:
    return Estop(estop.id, False, "manager", "")


def test_a_cell_stands_until_the_last_stop_is_cleared() -> None:
    estops = Estops()
    assert [estops.hear(FIRST), estops.hear(SECOND), estops.hear(FIRST)] == [True, True, False]
    assert estops.in_force == (FIRST, SECOND)
    assert estops.hear(over(FIRST))
    assert estops.first == SECOND
    assert estops.hear(over(SECOND))
    assert estops.first is None


def test_a_late_copy_of_a_cleared_stop_does_nothing() -> None:
    estops = Estops(in_force=(FIRST,))
    estops.hear(over(FIRST))
    assert not estops.hear(FIRST)
    assert (estops.in_force, estops.was_cleared("e1")) == ((), True)


def test_a_stop_that_was_cleared_before_it_was_heard_never_comes_into_force() -> None:
    estops = Estops(cleared=("e1",))
    assert not estops.hear(over(SECOND))
    assert not estops.hear(SECOND)
    assert not estops.hear(FIRST)
    assert estops.in_force == ()


def test_the_newest_stops_that_were_cleared_are_remembered() -> None:
    estops = Estops()
    for number in range(REMEMBERED + 1):
        estops.hear(over(Estop(f"e{number}", True, "anna", "door")))
    assert (estops.was_cleared("e0"), estops.was_cleared("e1")) == (False, True)


def says(*in_force: Estop) -> ManagerState:
    return ManagerState("c", "m", 1, 1, 0.0, "d", estops=in_force)


def test_nobody_but_the_manager_ends_a_stop_that_an_agent_or_gateway_obeys() -> None:
    estops = ObeyedEstops("b")
    estops.hear(FIRST)
    estops.named("e1", 7)
    for state, heard in (
        (says(), None),
        (says(), Heard("b", 6)),
        (says(), Heard("before", 900)),
        (says(FIRST), Heard("b", 8)),
    ):
        estops.answered(state, heard)
        assert not estops.hear(over(FIRST))
    estops.answered(says(), Heard("b", 7))
    assert estops.in_force == (FIRST,)
    assert estops.hear(over(FIRST))
    assert not estops.hear(FIRST)


def test_who_obeys_as_many_as_it_keeps_goes_on_standing_under_a_later_one() -> None:
    estops = ObeyedEstops("b")
    kept = tuple(Estop(f"k{number}", True, "anna", "door") for number in range(MOST_OBEYED))
    assert all(map(estops.hear, kept))
    assert not estops.hear(SECOND)
    for sequence, each in enumerate(kept):
        estops.named(each.id, sequence)
        estops.answered(says(SECOND), Heard("b", sequence))
        estops.hear(SECOND)
        assert estops.hear(over(each))
        assert estops.first is not None
    assert estops.in_force == (SECOND,)


def test_an_end_that_comes_before_its_stop_keeps_no_stop_from_being_obeyed() -> None:
    estops = ObeyedEstops("b")
    assert not estops.hear(over(FIRST))
    assert estops.hear(FIRST)
