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


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 5))))
def test_accepted_news_grows_within_a_boot_and_a_replaced_boot_never_returns(messages: list[tuple[str, int]]) -> None:
    newest = NewestOf()
    accepted = [message for message in messages if newest.accept(*message)]
    boots = [boot for boot, _ in accepted]
    changes = [boot for i, boot in enumerate(boots) if i == 0 or boots[i - 1] != boot]
    assert len(changes) == len(set(changes))
    for boot in changes:
        sequences = [sequence for b, sequence in accepted if b == boot]
        assert sequences == sorted(set(sequences))


def test_a_new_boot_may_begin_with_any_sequence() -> None:
    newest = NewestOf()
    assert newest.accept("old", 100)
    assert newest.accept("new", 1)
    assert not newest.accept("old", 101)
