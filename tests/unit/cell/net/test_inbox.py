"""Events: in order, bounded, with a count of what did not fit."""

from cell.core import AskDone
from cell.messages import Estop
from cell.net.codec import encode
from cell.net.inbox import Inbox
from cell.net.keys import Keys
from cell.net.latest import Decoder


def estop(number: int) -> Estop:
    return Estop(f"e{number}", True, "me", "test")


def inbox(size: int) -> Inbox:
    return Inbox(Decoder(Keys("c")), size)


def test_messages_come_in_order_and_once() -> None:
    box = inbox(8)
    for number in (1, 2, 3):
        box.store("cell/c/estop", encode(estop(number)))
    assert box.take() == [estop(1), estop(2), estop(3)]
    assert box.take() == []


def test_what_does_not_fit_is_dropped_and_counted() -> None:
    box = inbox(2)
    for number in range(5):
        box.store("cell/c/estop", encode(estop(number)))
    assert box.take() == [estop(0), estop(1)]
    assert box.dropped == 3


def test_an_outcome_always_fits() -> None:
    box = inbox(0)
    box.tell(AskDone("a", None, "nobody"))
    assert box.take() == [AskDone("a", None, "nobody")]
