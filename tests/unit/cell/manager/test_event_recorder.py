"""The thread that stores events: it answers, and no disk stops more than it."""

import sqlite3
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from cell.core import Answer, Effect, Publish, Request
from cell.manager import event_recorder as module
from cell.manager.event_recorder import WAITING_LIMIT, EventRecorder
from cell.messages import Call, Event, KeptEvents, ListEvents, Reply, Severity
from cell.net.codec import decode
from cell.net.inbox import Inbox
from cell.net.keys import Keys
from cell.net.latest import Decoder

DEADLINE_S = 20.0


class Manager:
    """What the manager's loop does with a recorder."""

    def __init__(self, path: Path, boot: str = "m1") -> None:
        self.recorder = EventRecorder(path, Inbox(Decoder(Keys("line"))), boot)
        self.events: list[Event] = []
        self.replies: list[Reply] = []

    def loop(self) -> None:
        for effect in self.recorder.effects():
            self._perform(effect)

    def _perform(self, effect: Effect) -> None:
        match effect:
            case Publish(Event() as event):
                self.events.append(event)
                self.recorder.tell(event)
            case Answer(_, Reply() as reply):
                self.replies.append(reply)

    def until(self, condition: Callable[[], object]) -> None:
        deadline = time.monotonic() + DEADLINE_S
        pause = threading.Event()
        while not condition():
            assert time.monotonic() < deadline, "did not happen in time"
            self.loop()
            pause.wait(0.01)

    def listed(self) -> Reply:
        count = len(self.replies)
        self.recorder.ask(Request("r1", Call("c1", ListEvents())))
        self.until(lambda: len(self.replies) > count)
        return self.replies[-1]

    def kept(self) -> list[str]:
        """Codes of all events that are stored."""
        reply = self.listed()
        return [kept.event.code for kept in decode(KeptEvents, reply.data.encode()).events] if reply.ok else []

    def codes(self) -> list[str]:
        return [event.code for event in self.events]


def happened(code: str, sequence: int = 1) -> Event:
    return Event("manager", sequence, Severity.INFO, code, "text", boot="m1")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_RETRY_S", 0.05)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "events.sqlite3"


@pytest.fixture
def manager(path: Path) -> Iterator[Manager]:
    manager = Manager(path)
    with manager.recorder:
        yield manager


def test_what_is_told_is_listed(manager: Manager) -> None:
    manager.recorder.tell(happened("zone_orphaned"))
    manager.until(lambda: manager.kept() == ["zone_orphaned", "manager_started"] or len(manager.kept()) == 2)
    assert set(manager.kept()) == {"zone_orphaned", "manager_started"}


def test_events_are_there_after_a_restart_of_the_manager(path: Path) -> None:
    first = Manager(path)
    with first.recorder:
        first.loop()
        first.recorder.tell(happened("estop"))
    second = Manager(path, "m2")
    with second.recorder:
        second.until(lambda: len(second.kept()) == 3)
        assert second.kept() == ["manager_started", "estop", "manager_started"]


def test_a_disk_that_cannot_be_written_is_told_and_nothing_is_lost_when_it_is_back(tmp_path: Path) -> None:
    manager = Manager(tmp_path / "missing" / "events.sqlite3")
    with manager.recorder:
        manager.recorder.tell(happened("estop"))
        manager.until(lambda: "events_not_kept" in manager.codes())
        reply = manager.listed()
        assert not reply.ok
        assert "cannot be kept" in reply.text
        (tmp_path / "missing").mkdir()
        manager.until(lambda: "events_kept" in manager.codes())
        manager.until(lambda: {"estop", "events_not_kept", "events_kept"} <= set(manager.kept()))
    assert manager.codes().count("events_not_kept") == 1


def test_what_waits_for_a_disk_is_bounded_and_the_rest_is_counted_as_lost(tmp_path: Path) -> None:
    manager = Manager(tmp_path / "missing" / "events.sqlite3")
    with manager.recorder:
        for sequence in range(1, WAITING_LIMIT + 100):
            manager.recorder.tell(happened("flood", sequence))
        manager.until(lambda: "events_not_kept" in manager.codes())
        (tmp_path / "missing").mkdir()
        manager.until(lambda: "events_kept" in manager.codes())
        manager.recorder.tell(happened("next", WAITING_LIMIT + 100))
        manager.until(lambda: "next" in manager.kept())
        listed = decode(KeptEvents, manager.listed().data.encode())
        [after] = [kept for kept in listed.events if kept.event.code == "next"]
        assert after.lost >= 99


def test_a_file_that_is_no_store_is_moved_aside_and_told(path: Path) -> None:
    path.write_bytes(b"no database" * 100)
    manager = Manager(path)
    with manager.recorder:
        manager.until(lambda: "events_kept" in manager.codes())
        manager.until(lambda: "events_not_kept" in manager.kept())
    assert path.with_name("events.sqlite3.broken").read_bytes() == b"no database" * 100
    assert "not a database" in next(event.text for event in manager.events if event.code == "events_not_kept")


@pytest.mark.parametrize("damage", ["UPDATE events SET data = '{'", "UPDATE events SET at = 1e300"])
def test_a_row_that_is_no_event_is_told_and_events_are_kept_from_then_on(path: Path, damage: str) -> None:
    manager = Manager(path)
    with manager.recorder:
        manager.recorder.tell(happened("before"))
        manager.until(lambda: "before" in manager.kept())
        with sqlite3.connect(path) as other:
            other.execute(damage)
        other.close()
        assert not manager.listed().ok
        manager.until(lambda: "events_not_kept" in manager.kept())
        manager.recorder.tell(happened("after"))
        manager.until(lambda: "after" in manager.kept())
    assert path.with_name("events.sqlite3.broken").exists()


def test_a_store_of_another_version_is_moved_aside(path: Path) -> None:
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE events (number INTEGER PRIMARY KEY, text TEXT)")
    other.close()
    manager = Manager(path)
    with manager.recorder:
        manager.until(lambda: "events_not_kept" in manager.kept())
    told = next(event for event in manager.events if event.code == "events_not_kept")
    assert "columns" in told.text
    assert str(path.with_name("events.sqlite3.broken")) in told.remedy


def test_what_was_told_last_is_stored_before_the_manager_ends(path: Path) -> None:
    first = Manager(path)
    with first.recorder:
        first.recorder.tell(happened("last"))
    second = Manager(path)
    with second.recorder:
        second.until(lambda: "last" in second.kept())
