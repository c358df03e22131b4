"""A message is as young as the sending of what it repeats; replaced processes stay replaced."""

from math import inf

from hypothesis import given
from hypothesis import strategies as st

from cell.messages import Heard
from cell.net.freshness import NewestOf, Sent


def test_an_echo_is_as_old_as_the_message_it_repeats() -> None:
    sent = Sent("b1")
    sent.record(1, 10.0)
    sent.record(2, 10.1)
    assert sent.age(Heard("b1", 1), 10.3) == 10.3 - 10.0


def test_the_echo_of_nothing_of_another_boot_or_of_the_unknown_proves_nothing() -> None:
    sent = Sent("b1")
    sent.record(1, 10.0)
    assert sent.age(None, 10.0) == inf
    assert sent.age(Heard("b0", 1), 10.0) == inf
    assert sent.age(Heard("b1", 2), 10.0) == inf


def test_what_was_sent_before_an_own_freeze_proves_nothing() -> None:
    sent = Sent("b1")
    sent.record(1, 10.0)
    sent.forget()
    assert sent.age(Heard("b1", 1), 10.1) == inf


def test_what_is_long_ago_is_forgotten() -> None:
    sent = Sent("b1", keep_s=2.0)
    sent.record(1, 10.0)
    sent.record(2, 12.5)
    assert sent.age(Heard("b1", 1), 12.5) == inf
    assert sent.age(Heard("b1", 2), 12.5) == 0.0


RUNS = st.sampled_from([("a", 1), ("b", 2), ("c", 3)])


@given(st.lists(st.tuples(RUNS, st.integers(0, 5))))
def test_accepted_news_only_grows_by_run_and_sequence(messages: list[tuple[tuple[str, int], int]]) -> None:
    newest = NewestOf()
    accepted = [(era, sequence) for (boot, era), sequence in messages if newest.accept(boot, era, sequence)]
    assert accepted == sorted(set(accepted))


@given(st.lists(st.tuples(RUNS, st.integers(0, 5))), st.integers(0, 100))
def test_no_late_message_keeps_the_living_run_from_being_heard(
    late: list[tuple[tuple[str, int], int]], sequence: int
) -> None:
    newest = NewestOf()
    for (boot, era), old in late:
        newest.accept(boot, era, old)
    assert newest.accept("living", 4, sequence)
    for (boot, era), old in late:
        assert not newest.accept(boot, era, old + 1000)
    assert newest.accept("living", 4, sequence + 1)


def test_a_new_run_may_begin_with_any_sequence() -> None:
    newest = NewestOf()
    assert newest.accept("old", 1, 100)
    assert newest.accept("new", 2, 1)
    assert not newest.accept("old", 1, 101)


def test_of_two_runs_that_claim_one_era_the_first_counts() -> None:
    newest = NewestOf()
    assert newest.accept("one", 1, 100)
    assert not newest.accept("other", 1, 101)
