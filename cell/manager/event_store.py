"""The file in which the manager keeps the events of a cell: the newest ones, over restarts."""

import json
import sqlite3
from collections.abc import Iterable
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from cell.messages import Event, KeptEvent, KeptEvents, ListEvents, Severity

EVENTS_FILE = "events.sqlite3"
KEPT = 3000
"""So many events of each severity: what is common pushes no alarm out."""
LONGEST_TEXT = 1000
PAGE = 100
"""The longest events of so many fit into a reply (`Reply.data`)."""
_MOST_SOURCES = 256
_LARGEST = 2**63 - 1
_SEVERITIES = tuple(Severity)
_CONTROLS = dict.fromkeys([*range(32), 127], " ")
_COLUMNS = {"number", "at", "severity", "source", "boot", "sequence", "code", "text", "remedy", "data", "lost"}
_TABLES = """
CREATE TABLE IF NOT EXISTS events (
    number INTEGER PRIMARY KEY AUTOINCREMENT, at REAL NOT NULL, severity INTEGER NOT NULL, source TEXT NOT NULL,
    boot TEXT NOT NULL, sequence INTEGER NOT NULL, code TEXT NOT NULL, text TEXT NOT NULL, remedy TEXT NOT NULL,
    data TEXT NOT NULL, lost INTEGER NOT NULL
);
CREATE INDEX IF NOT EXISTS severities ON events (severity, number);
CREATE TABLE IF NOT EXISTS sources (
    source TEXT PRIMARY KEY, boot TEXT NOT NULL, sequence INTEGER NOT NULL, newest INTEGER NOT NULL
);
"""


class EventStore:
    """A context manager; used by one thread. Every method raises `sqlite3.Error` when the file cannot be used."""

    def __init__(self, path: Path, *, existing: bool = False, kept: int = KEPT) -> None:
        """`existing`: for a reader, which makes no file where there is none."""
        self._kept = kept
        if existing:
            self._db = sqlite3.connect(f"{path.absolute().as_uri()}?mode=rw", uri=True)
            return
        self._db = sqlite3.connect(path)
        try:
            if {name for _, name, *_ in self._db.execute("PRAGMA table_info(events)")} not in (set(), _COLUMNS):
                raise sqlite3.DatabaseError("it has other columns than those of this version")
            self._db.executescript(_TABLES)
        except sqlite3.Error:
            self._db.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        self._db.close()

    def add(self, heard: Iterable[tuple[Event, float]]) -> None:
        """Store events, each with the moment [s since 1970, UTC] at which it was heard; all of them or none."""
        with self._db:
            for event, at in heard:
                self._add(event, at)
            for severity in range(len(_SEVERITIES)):
                self._db.execute(
                    "DELETE FROM events WHERE severity = ? AND number <= (SELECT number FROM events "
                    "WHERE severity = ? ORDER BY number DESC LIMIT 1 OFFSET ?)",
                    (severity, severity, self._kept),
                )
            self._db.execute(
                "DELETE FROM sources WHERE source NOT IN (SELECT source FROM sources ORDER BY newest DESC LIMIT ?)",
                (_MOST_SOURCES,),
            )

    def _add(self, event: Event, at: float) -> None:
        sequence = max(0, min(event.sequence, _LARGEST))
        known = self._db.execute("SELECT boot, sequence FROM sources WHERE source = ?", (event.source,)).fetchone()
        before = known[1] if known is not None and known[0] == event.boot else 0
        data = json.dumps(event.data)
        row = (
            at,
            _SEVERITIES.index(event.severity),
            event.source,
            event.boot,
            sequence,
            _short(event.code),
            _short(event.text),
            _short(event.remedy),
            data if len(data) <= LONGEST_TEXT else "{}",
            max(0, sequence - before - 1),
        )
        number = self._db.execute(
            "INSERT INTO events (at, severity, source, boot, sequence, code, text, remedy, data, lost) "
            "VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
            row,
        ).lastrowid
        if sequence > before:
            source = (event.source, event.boot, sequence, number)
            self._db.execute("INSERT OR REPLACE INTO sources VALUES (?, ?, ?, ?)", source)

    def read(self, asked: ListEvents) -> KeptEvents:
        """What was asked for; see `ListEvents`."""
        conditions = {
            "number > ?": max(0, min(asked.after, _LARGEST)),
            "number < ?": _LARGEST if asked.before is None else max(0, min(asked.before, _LARGEST)),
            "(severity >= ? OR lost > 0)": _SEVERITIES.index(asked.severity),
            "at >= ?": 0.0 if asked.since is None else asked.since,
        }
        rows = self._db.execute(
            "SELECT number, at, severity, source, boot, sequence, code, text, remedy, data, lost FROM events "
            f"WHERE {' AND '.join(conditions)} ORDER BY number DESC LIMIT ?",
            (*conditions.values(), max(0, min(asked.limit, PAGE))),
        ).fetchall()
        [(newest,)] = self._db.execute("SELECT coalesce(max(number), 0) FROM events")
        try:
            return KeptEvents(tuple(_kept_event(*row) for row in reversed(rows)), newest)
        except (ValueError, TypeError, LookupError, OverflowError) as error:
            raise sqlite3.DatabaseError(f"a row in it is no event ({error})") from error


def _kept_event(
    number: int,
    at: float,
    severity: int,
    source: str,
    boot: str,
    sequence: int,
    code: str,
    text: str,
    remedy: str,
    data: str,
    lost: int,
) -> KeptEvent:
    words = _printable(code), _printable(text), _printable(remedy)
    event = Event(source, sequence, _SEVERITIES[severity], *words, json.loads(data), boot)
    when = datetime.fromtimestamp(at, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
    return KeptEvent(number, when, event, lost)


def _printable(text: str) -> str:
    """Without control characters, which take six times their length in a reply."""
    return text.translate(_CONTROLS)


def _short(text: str) -> str:
    return text if len(text) <= LONGEST_TEXT else f"{text[: LONGEST_TEXT - 1]}…"
