"""Which events are kept, in which order, and how many are known to be lost."""

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as hypothesis_settings

from cell.manager.event_store import LONGEST_TEXT, PAGE, EventStore
from cell.messages import Event, KeptEvents, ListEvents, Reply, Severity
from cell.net.codec import decode, encode
from tests.unit.message_kinds import messages

NOON = 1_769_860_800.0


def event(sequence: int, source: str = "robot/left", boot: str = "b1", severity: Severity = Severity.INFO) -> Event:
    return Event(source, sequence, severity, "code", f"text {sequence}", "remedy", {"node_id": 3}, boot)


def store(path: Path, *events: Event, kept: int = 3000) -> None:
    """Store events one second after the other, by a manager of its own."""
    with EventStore(path, kept=kept) as one:
        for number, each in enumerate(events):
            one.add([(each, NOON + number)])


def read(path: Path, asked: ListEvents | None = None) -> KeptEvents:
    with EventStore(path, existing=True) as one:
        return one.read(asked or ListEvents())


def lost(path: Path) -> list[int]:
    return [kept.lost for kept in read(path).events]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "events.sqlite3"


def test_an_event_comes_back_as_it_was_with_its_time_in_utc(path: Path) -> None:
    store(path, event(1))
    [kept] = read(path).events
    assert kept.event == event(1)
    assert (kept.number, kept.at, kept.lost) == (1, "2026-01-31T12:00:00.000Z", 0)


def test_numbers_and_order_go_on_over_restarts_even_when_the_clock_was_set_back(path: Path) -> None:
    store(path, event(1), event(2))
    store(path, event(3), event(4))
    assert [(kept.number, kept.event.sequence) for kept in read(path).events] == [(1, 1), (2, 2), (3, 3), (4, 4)]
    assert read(path).newest == 4


def test_events_that_were_lost_are_counted_before_the_next_of_their_source(path: Path) -> None:
    store(path, event(1), event(1, "robot/right"), event(4), event(2, "robot/right"))
    assert lost(path) == [0, 0, 2, 0]


def test_events_that_came_while_no_manager_ran_are_counted_too(path: Path) -> None:
    store(path, event(1))
    store(path, event(5))
    assert lost(path) == [0, 3]


def test_a_source_that_was_started_anew_has_lost_only_what_it_said_since(path: Path) -> None:
    store(path, event(7), event(1, boot="b2"), event(4, boot="b3"))
    assert lost(path) == [6, 0, 3]


def test_an_event_that_comes_late_or_twice_is_kept_and_makes_no_gap(path: Path) -> None:
    store(path, event(1), event(3), event(2), event(3), event(4))
    assert lost(path) == [0, 1, 0, 0, 0]


def test_the_newest_of_each_severity_are_kept(path: Path) -> None:
    alarm = event(1, "gateway/bus", severity=Severity.ALARM)
    store(path, alarm, *(event(number) for number in range(1, 21)), kept=5)
    kept = read(path)
    assert [each.event.sequence for each in kept.events] == [1, 16, 17, 18, 19, 20]
    assert kept.newest == 21
    assert lost(path)[-1] == 0


def test_it_is_known_what_was_lost_when_all_events_of_a_source_are_too_old_to_be_kept(path: Path) -> None:
    others = [event(number) for number in range(1, 11)]
    store(path, event(1, "robot/right"), *others, event(2, "robot/right"), kept=5)
    assert lost(path)[-1] == 0


def test_questions_narrow_what_is_told(path: Path) -> None:
    alarm = event(3, severity=Severity.ALARM)
    store(path, event(1), event(2), alarm, event(4))

    def numbers(asked: ListEvents) -> list[int]:
        return [kept.number for kept in read(path, asked).events]

    assert numbers(ListEvents(after=2)) == [3, 4]
    assert numbers(ListEvents(before=3)) == [1, 2]
    assert numbers(ListEvents(before=4, limit=2)) == [2, 3]
    assert numbers(ListEvents(since=NOON + 3.0)) == [4]
    assert numbers(ListEvents(severity=Severity.WARNING)) == [3]
    assert numbers(ListEvents(limit=-1, after=-(2**70), before=2**70)) == []


def test_a_loss_is_told_whatever_the_severity_of_the_event_after_it(path: Path) -> None:
    store(path, event(1), event(3))
    [kept] = read(path, ListEvents(severity=Severity.ALARM)).events
    assert kept.lost == 1


def test_a_page_has_an_end(path: Path) -> None:
    with EventStore(path) as one:
        one.add([(event(number), NOON) for number in range(1, PAGE + 10)])
    assert len(read(path, ListEvents(limit=10**9)).events) == PAGE


@pytest.mark.parametrize("letter", ["\x01", '"', "\\", "\n", "ä", "\U0001f916"])
def test_the_longest_page_fits_into_a_reply(path: Path, letter: str) -> None:
    long = letter * 2 * LONGEST_TEXT
    with EventStore(path) as one:
        said = [
            Event("robot/left", n, Severity.INFO, 128 * letter, long, long, {"y": letter * 900}) for n in range(PAGE)
        ]
        one.add([(each, NOON) for each in said])
    page = read(path, ListEvents(limit=PAGE))
    assert len(page.events) == PAGE
    reply = Reply("id", True, "", data=encode(page).decode())
    assert decode(KeptEvents, decode(Reply, encode(reply)).data.encode()) == page


def test_a_text_of_any_length_does_not_fill_the_disk(path: Path) -> None:
    store(path, Event("robot/left", 1, Severity.INFO, "code", "x" * 10**6, data={"y": "z" * 10**6}))
    [kept] = read(path).events
    assert len(kept.event.text) == LONGEST_TEXT
    assert kept.event.data == {}


@given(messages(Event))
@hypothesis_settings(deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_whatever_fits_the_schema_of_an_event_is_stored_and_told(tmp_path: Path, said: Event) -> None:
    path = tmp_path / "any.sqlite3"
    store(path, decode(Event, encode(said)))
    kept = read(path, ListEvents(limit=1))
    assert kept.events[-1].event.text == "".join(" " if c < " " or c == "\x7f" else c for c in said.text)
    assert decode(KeptEvents, encode(kept)) == kept
