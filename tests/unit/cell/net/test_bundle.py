"""Bundles hold what was published, each message with its age, and leave only while somebody hears them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.net.bundle import EVERY_S, MOST_BYTES, Bundler, unbundled
from cell.net.errors import CodecError

MESSAGES = st.lists(st.tuples(st.text(max_size=20), st.binary(max_size=100)), max_size=20)


class Sender:
    """A process with its clock, and what leaves it."""

    def __init__(self) -> None:
        self.now = 0.0
        self.wanted = True
        self.sent: list[bytes] = []
        self.bundler = Bundler(self.sent.append, lambda: self.wanted, lambda: self.now)


@given(MESSAGES)
def test_what_is_unbundled_is_what_was_published(messages: list[tuple[str, bytes]]) -> None:
    sender = Sender()
    for key, payload in messages:
        sender.bundler.add(key, payload)
    sender.bundler.flush()
    assert [(key, payload) for data in sender.sent for key, payload, _ in unbundled(data)] == messages


def test_each_message_says_how_old_it_is_when_the_bundle_leaves() -> None:
    sender = Sender()
    sender.bundler.add("a", b"1")
    sender.now = EVERY_S
    sender.bundler.add("a", b"2")
    (data,) = sender.sent
    assert [age_s for _, _, age_s in unbundled(data)] == pytest.approx([EVERY_S, 0.0])


def test_a_bundle_leaves_before_it_is_larger_than_a_link_takes_at_once() -> None:
    sender = Sender()
    for _ in range(8):
        sender.bundler.add("a", bytes(MOST_BYTES // 4))
    assert [len(unbundled(data)) for data in sender.sent] == [4, 4]


def test_nothing_leaves_or_is_kept_while_nobody_hears_it() -> None:
    sender = Sender()
    sender.wanted = False
    sender.bundler.add("a", b"before")
    sender.bundler.flush()
    sender.wanted = True
    sender.bundler.add("a", b"after")
    sender.bundler.flush()
    assert [unbundled(data)[0][1] for data in sender.sent] == [b"after"]


@given(st.binary(max_size=60), st.booleans())
def test_no_strangers_bytes_raise_anything_else(data: bytes, begun: bool) -> None:
    try:
        unbundled(b"ZBU1" * begun + data)
    except CodecError:
        return


def test_a_bundle_that_is_cut_off_is_none() -> None:
    sender = Sender()
    sender.bundler.add("a", b"payload")
    sender.bundler.flush()
    for length in range(5, len(sender.sent[0])):
        with pytest.raises(CodecError):
            unbundled(sender.sent[0][:length])
