"""Stores the events of a cell beside the manager's loop, and answers what is asked about them."""

import logging
import queue
import sqlite3
import threading
import time
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from cell.core import Answer, Effect, Publish, Request
from cell.manager.event_store import EventStore
from cell.messages import Call, Event, KeptEvents, ListEvents, Reply, Severity
from cell.net.codec import encode
from cell.net.inbox import Inbox

SOURCE = "manager/events"
WAITING_LIMIT = 1000
"""So many events wait for a disk that cannot be written; later ones are counted as lost."""
_POLL_S = 0.05
_RETRY_S = 1.0
_END_TIMEOUT_S = 2.0
_LOG = logging.getLogger("cell.manager")


class EventRecorder:
    """A context manager around the thread that owns the store.

    The manager's loop hands over (`tell`, `ask`) and carries out `effects`, all without waiting. A disk that is full,
    broken or slow stops no more than this thread: an event tells of it, and new events wait. A file that is no store is
    moved aside to `<name>.broken`.
    """

    def __init__(self, path: Path, events: Inbox, boot: str) -> None:
        """`events` is what the others publish on `event/**`."""
        self._path = path
        self._events = events
        self._boot = boot
        self._store: EventStore | None = None
        self._waiting: list[tuple[Event, float]] = []
        self._problem = ""
        self._retry_at = 0.0
        self._told = 0
        self._asked: queue.SimpleQueue[Request] = queue.SimpleQueue()
        self._effects: queue.SimpleQueue[Effect] = queue.SimpleQueue()
        self._wake, self._end = threading.Event(), threading.Event()
        # A hung disk must not keep the manager from ending.
        self._thread = threading.Thread(target=self._run, name="events", daemon=True)

    def __enter__(self) -> Self:
        self._say(Severity.INFO, "manager_started", f"a manager has started (boot {self._boot}) and keeps events", "")
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end.set()
        self._wake.set()
        self._thread.join(_END_TIMEOUT_S)

    def tell(self, event: Event) -> None:
        """Store an event of the manager itself."""
        self._events.tell(event)

    def ask(self, request: Request) -> None:
        """Take a call `ListEvents`."""
        self._asked.put(request)
        self._wake.set()

    def effects(self) -> list[Effect]:
        """Answers, and events about the store itself, for the loop to carry out."""
        effects = []
        with suppress(queue.Empty):
            while True:
                effects.append(self._effects.get_nowait())
        return effects

    def _run(self) -> None:
        while not self._end.is_set():
            self._wake.wait(_POLL_S)
            self._wake.clear()
            self._store_new()
            self._answer()
        self._store_new()
        if self._store is not None:
            self._store.close()

    def _store_new(self) -> None:
        wall = time.time() - time.monotonic()
        new = [(a.message, wall + a.at) for a in self._events.take_arrived() if isinstance(a.message, Event)]
        self._waiting += new[: max(0, WAITING_LIMIT - len(self._waiting))]
        if not self._waiting or (self._problem and time.monotonic() < self._retry_at and not self._end.is_set()):
            return
        try:
            self._opened().add(self._waiting)
        except (sqlite3.Error, OSError) as error:
            self._failed(error)
            return
        self._waiting.clear()
        if self._problem:
            self._problem = ""
            self._say(Severity.INFO, "events_kept", f"events are kept again in {self._path}", "")

    def _answer(self) -> None:
        with suppress(queue.Empty):
            while True:
                request = self._asked.get_nowait()
                match request.call:
                    case Call(id=call_id, command=ListEvents() as asked):
                        self._effects.put(Answer(request.request_id, self._reply(call_id, asked)))

    def _reply(self, call_id: str, asked: ListEvents) -> Reply:
        try:
            kept = self._opened().read(asked)
        except (sqlite3.Error, OSError) as error:
            self._failed(error)
            return Reply(call_id, False, self._problem)
        data = encode(KeptEvents(kept.events, kept.newest, self._problem)).decode()
        return Reply(call_id, True, f"{len(kept.events)} events", data=data)

    def _opened(self) -> EventStore:
        if self._store is None:
            self._store = EventStore(self._path)
        return self._store

    def _failed(self, error: Exception) -> None:
        self._retry_at = time.monotonic() + _RETRY_S
        if self._store is not None:
            self._store.close()
            self._store = None
        remedy = f"make room on the disk of {self._path.parent}, or see to it that the manager may write there"
        if type(error) is sqlite3.DatabaseError:
            aside = self._path.with_name(f"{self._path.name}.broken")
            with suppress(OSError):
                self._path.replace(aside)
                remedy = f"what was kept before is in {aside}"
        problem = f"events cannot be kept in {self._path}: {error}"
        if problem != self._problem:
            self._problem = problem
            self._say(Severity.WARNING, "events_not_kept", problem, remedy)

    def _say(self, severity: Severity, code: str, text: str, remedy: str) -> None:
        self._told += 1
        if severity is not Severity.INFO:
            _LOG.warning("%s; %s", text, remedy)
        self._effects.put(Publish(Event(SOURCE, self._told, severity, code, text, remedy, boot=self._boot)))
