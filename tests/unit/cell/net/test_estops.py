"""The emergency stops as each process keeps them."""

from cell.messages import Estop, Heard, ManagerState
from cell.net.estops import Estops, ObeyedEstops

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


def test_an_end_that_comes_before_its_stop_keeps_no_stop_from_being_obeyed() -> None:
    estops = ObeyedEstops("b")
    assert not estops.hear(over(FIRST))
    assert estops.hear(FIRST)
