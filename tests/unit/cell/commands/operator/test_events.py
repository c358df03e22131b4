"""`cell events`: times, pages and lines."""

from datetime import datetime
from pathlib import Path

import pytest

from cell.commands.errors import CommandError
from cell.commands.operator.events import fetch, lines, moment
from cell.manager.event_store import PAGE, EventStore
from cell.messages import Event, KeptEvent, ListEvents, Severity

ALARM = Event("gateway/bus", 3, Severity.ALARM, "node_silent", "node 3 is silent", "look at its cable")


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("30s", 970.0),
        ("10m", 400.0),
        ("0.1h", 640.0),
        ("3d", 0.0),
        ("9" * 400 + "s", 0.0),
        ("1970-01-01T00:05:00Z", 300.0),
        ("2026-01-31T14:05", datetime(2026, 1, 31, 14, 5).timestamp()),
    ],
)
def test_since_is_so_long_ago_or_a_time(text: str, seconds: float) -> None:
    assert moment(text, 1000.0) == pytest.approx(seconds)


@pytest.mark.parametrize("text", ["", "10", "yesterday", "-5m", "nan", "10 m", "0001-01-01"])
def test_another_since_is_refused_with_what_is_allowed(text: str) -> None:
    with pytest.raises(CommandError, match="allowed are 30s"):
        moment(text, 1000.0)


def test_an_event_is_a_line_with_its_time() -> None:
    kept = KeptEvent(1, "2026-01-31T12:00:00.000Z", ALARM)
    assert lines(kept, Severity.ALARM) == [
        "2026-01-31T12:00:00.000Z alarm: gateway/bus: node 3 is silent; look at its cable [node_silent]"
    ]


def test_lost_events_are_a_line_before_it_whatever_is_asked_for() -> None:
    info = Event("robot/left", 3, Severity.INFO, "code", "text")
    assert lines(KeptEvent(1, "T", info, 2), Severity.ALARM) == ["T 2 events of robot/left were lost"]
    assert lines(KeptEvent(1, "T", info, 1), Severity.INFO) == [
        "T 1 event of robot/left was lost",
        "T info: robot/left: text [code]",
    ]


@pytest.mark.parametrize(("limit", "count"), [(None, 2 * PAGE + 5), (3, 3), (PAGE, PAGE), (PAGE + 1, PAGE + 1)])
def test_pages_are_put_together_in_order_to_the_newest(tmp_path: Path, limit: int | None, count: int) -> None:
    with EventStore(tmp_path / "events") as store:
        store.add([(Event("robot/left", n, Severity.INFO, "code", "text"), 1.0) for n in range(1, 2 * PAGE + 6)])
        found, page = fetch(store.read, ListEvents(), limit)
    assert [kept.number for kept in found] == list(range(2 * PAGE + 6 - count, 2 * PAGE + 6))
    assert page.newest == 2 * PAGE + 5
