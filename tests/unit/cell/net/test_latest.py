"""State: one slot per key, newest wins, and garbage is reported once."""

from cell.messages import Estop, Event, Severity
from cell.net.codec import encode
from cell.net.keys import Keys
from cell.net.latest import MOST_KEYS, Decoder, Latest

KEYS = Keys("c")


def estop(number: int) -> Estop:
    return Estop(f"e{number}", True, "me", "test")


def test_only_the_newest_of_a_key_is_taken_and_only_once() -> None:
    latest = Latest(Decoder(KEYS))
    for number in (1, 2, 3):
        latest.store("cell/c/estop", encode(estop(number)))
    assert latest.take_new() == [estop(3)]
    assert latest.take_new() == []


def test_garbage_is_counted_and_reported_once_per_key() -> None:
    reports: list[str] = []
    decoder = Decoder(KEYS, reports.append)
    latest = Latest(decoder)
    for _ in range(3):
        latest.store("cell/c/estop", b"\xff")
        latest.store("cell/c/other", b"\xff")
        assert latest.take_new() == []
    assert decoder.failures == {"cell/c/estop": 3, "cell/c/other": 3}
    assert len(reports) == 2
    assert reports[0].startswith("cell/c/estop: ignored, Estop: ")


def test_a_message_under_another_senders_key_is_garbage() -> None:
    reports: list[str] = []
    event = Event("robot/left", 1, Severity.INFO, "code", "text")
    assert Decoder(KEYS, reports.append).decode("cell/c/event/robot/right", encode(event)) is None
    assert "it belongs on cell/c/event/robot/left" in reports[0]


def test_keys_of_strangers_take_no_memory_without_bound() -> None:
    decoder = Decoder(KEYS, lambda _: None)
    latest = Latest(decoder)
    for number in range(2 * MOST_KEYS):
        latest.store(f"cell/c/robot/r{number}/presence", b"{}")
        decoder.decode(f"cell/c/event/r{number}", b"")
    latest.store("cell/c/robot/r0/presence", b"")
    assert latest.take_new() == []
    assert len(decoder.failures) == MOST_KEYS
