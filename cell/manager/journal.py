"""What the manager remembers over restarts, in an SQLite file in the cell's state folder."""

import json
import sqlite3
import time
from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import Path
from threading import Condition, Thread
from types import TracebackType
from typing import Self, assert_never

import numpy as np

from cell.manager.records import (
    AssuranceEnded,
    Assured,
    EstopCleared,
    EstopLatched,
    JournalFailed,
    JournalWritten,
    Record,
    Stored,
    ZoneDecided,
    next_epoch,
)
from cell.messages import Assurance, Confinement, Estop, Sections
from cell.net.estops import REMEMBERED

RETRY_S = 1.0
_CONNECT = partial(sqlite3.connect, check_same_thread=False)
_MOST_WAITING = 1000
_END_S = 5.0
"""A disk that takes longer over the last records does not keep the process."""

_TABLES = """
CREATE TABLE IF NOT EXISTS epochs (epoch INTEGER PRIMARY KEY, boot TEXT NOT NULL, at REAL NOT NULL);
CREATE TABLE IF NOT EXISTS estops (
    id TEXT PRIMARY KEY, set_by TEXT NOT NULL, reason TEXT NOT NULL, set_at REAL NOT NULL,
    cleared_by TEXT, cleared_at REAL
);
CREATE TABLE IF NOT EXISTS zone_decisions (
    zone TEXT NOT NULL, decision TEXT NOT NULL, by TEXT NOT NULL, found TEXT NOT NULL, at REAL NOT NULL
);
CREATE TABLE IF NOT EXISTS assurances (
    robot TEXT PRIMARY KEY, by TEXT NOT NULL, box TEXT, capsules INTEGER NOT NULL,
    ids BLOB NOT NULL, radii BLOB NOT NULL, points BLOB NOT NULL, at REAL NOT NULL
);
"""


class JournalError(Exception):
    """The journal cannot be read or written; without it no manager may run."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"journal {path}: {reason}; repair or move the file, or choose another --state-dir")
        self.path = path
        self.reason = reason


class Journal:
    """A context manager; every write is on disk before the method returns. Raises `JournalError`.

    For one thread at a time.
    """

    def __init__(
        self,
        path: Path,
        unix: Callable[[], float] = time.time,
        connect: Callable[[Path], sqlite3.Connection] = _CONNECT,
    ) -> None:
        self.path = path
        self._unix = unix
        try:
            self._db = connect(path)
            self._db.execute("PRAGMA synchronous = FULL")
            self._db.executescript(_TABLES)
        except sqlite3.Error as error:
            raise JournalError(path, str(error)) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        self._db.close()

    def read(self) -> Stored:
        """Everything a new manager must know."""
        try:
            [(epoch,)] = self._db.execute("SELECT coalesce(max(epoch), 0) FROM epochs")
            stops = self._db.execute(_IN_FORCE)
            in_force = tuple(Estop(id_, True, by, reason) for id_, by, reason in stops)
            cleared = tuple(id_ for (id_,) in self._db.execute(_CLEARED))[::-1]
            assured = tuple(map(_assured, self._db.execute(f"SELECT {_ASSURANCE} FROM assurances ORDER BY robot")))
        except (sqlite3.Error, ValueError, TypeError) as error:
            raise JournalError(self.path, str(error)) from error
        return Stored(epoch, in_force, cleared, assured)

    def begin_epoch(self, boot: str) -> int:
        """The number of a new epoch, stored before it is used."""
        unix_s = self._unix()
        epoch = next_epoch(self.read().epoch, unix_s)
        self._write(("INSERT INTO epochs VALUES (?, ?, ?)", (epoch, boot, unix_s)))
        return epoch

    def write(self, record: Record) -> None:
        """Store one record."""
        at = self._unix()
        match record:
            case EstopLatched(estop, instead_of):
                replaced = ((_CLEAR, (f"emergency stop {estop.id}", at, each)) for each in instead_of)
                self._write((_LATCH, (estop.id, estop.by, estop.reason, at)), *replaced, (_FORGET, ()))
            case EstopCleared(id=estop_id, by=by):
                self._write((_CLEAR, (by, at, estop_id)), (_FORGET, ()))
            case ZoneDecided(zone, decision, by, found):
                self._write(("INSERT INTO zone_decisions VALUES (?, ?, ?, ?, ?)", (zone, decision, by, found, at)))
            case Assured():
                sql = "INSERT OR REPLACE INTO assurances VALUES (?, ?, ?, ?, ?, ?, ?, ?)"
                self._write((sql, (*_row(record), at)))
            case AssuranceEnded(robot):
                self._write(("DELETE FROM assurances WHERE robot = ?", (robot,)))
            case _:
                assert_never(record)

    def _write(self, *statements: tuple[str, tuple[str | int | float | bytes | None, ...]]) -> None:
        """All of them, or none."""
        try:
            with self._db:
                for sql, values in statements:
                    self._db.execute(sql, values)
        except sqlite3.Error as error:
            raise JournalError(self.path, str(error)) from error


_IN_FORCE = "SELECT id, set_by, reason FROM estops WHERE cleared_at IS NULL ORDER BY set_at, rowid"
_CLEARED = f"""
SELECT id FROM estops WHERE cleared_at IS NOT NULL ORDER BY cleared_at DESC, rowid DESC LIMIT {REMEMBERED}
"""
_LATCH = """
INSERT INTO estops (id, set_by, reason, set_at) VALUES (?, ?, ?, ?)
ON CONFLICT (id) DO UPDATE SET reason = excluded.reason, cleared_by = NULL, cleared_at = NULL
"""
_CLEAR = "UPDATE estops SET cleared_by = ?, cleared_at = ? WHERE id = ? AND cleared_at IS NULL"
_FORGET = f"DELETE FROM estops WHERE cleared_at IS NOT NULL AND id NOT IN ({_CLEARED})"
_ASSURANCE = "robot, by, box, capsules, ids, radii, points"


def _row(record: Assured) -> tuple[str, str, str | None, int, bytes, bytes, bytes]:
    box, place = record.assurance.box, record.place
    numbers = None if box is None else json.dumps([*box.size_m, *box.position_m, *box.quaternion_xyzw])
    arrays = place.ids.tobytes(), place.radii.tobytes(), place.points.tobytes()
    return record.robot, record.assurance.by, numbers, place.radii.shape[1], *arrays


def _assured(row: tuple[str, str, str | None, int, bytes, bytes, bytes]) -> Assured:
    """Raises `ValueError` or `TypeError` for what no manager has written."""
    robot, by, numbers, capsules, ids, radii, points = row
    box = None
    if numbers is not None:
        sx, sy, sz, x, y, z, qx, qy, qz, qw = map(float, json.loads(numbers))
        box = Confinement((sx, sy, sz), (x, y, z), (qx, qy, qz, qw))
    which = np.frombuffer(ids, np.uint64)
    place = Sections(
        which,
        np.frombuffer(points, np.float32).reshape(len(which), capsules, 2, 3),
        np.frombuffer(radii, np.float32).reshape(len(which), capsules),
    )
    return Assured(robot, Assurance(by, box), place)


class JournalWriter:
    """Writes records in their order, on a thread of its own: no disk, full or slow, holds the manager's loop up.

    What cannot be written waits and is tried again; `news` says so. A context manager: at its end what waits is tried
    once more.
    """

    def __init__(self, journal: Journal, retry_s: float = RETRY_S) -> None:
        self._journal = journal
        self._retry_s = retry_s
        self._changed = Condition()
        self._waiting: deque[Record] = deque()
        self._news: deque[JournalFailed | JournalWritten] = deque(maxlen=_MOST_WAITING)
        self._told = 0
        """So many of those that wait were told as unsaved."""
        self._ending = False
        self._thread = Thread(target=self._run, name="journal", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        with self._changed:
            self._ending = True
            self._changed.notify()
        self._thread.join(_END_S)

    def store(self, record: Record) -> None:
        """Write it soon. Where too many wait already the oldest is given up; it was told as unsaved."""
        with self._changed:
            if len(self._waiting) >= _MOST_WAITING:
                self._waiting.popleft()
                self._told -= 1
            self._waiting.append(record)
            self._changed.notify()

    def news(self) -> list[JournalFailed | JournalWritten]:
        """What happened since the last call."""
        with self._changed:
            news = list(self._news)
            self._news.clear()
        return news

    def write_waiting(self) -> bool:
        """Write what waits, as far as the disk lets it; whether nothing waits any more."""
        while (record := self._first()) is not None:
            try:
                self._journal.write(record)
            except JournalError as error:
                self._failed(error)
                return False
            self._written(record)
        return True

    def _run(self) -> None:
        last = False
        while not last:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._ending)
                last = self._ending
            if not self.write_waiting():
                with self._changed:
                    self._changed.wait_for(lambda: self._ending, 0.0 if last else self._retry_s)

    def _first(self) -> Record | None:
        with self._changed:
            return self._waiting[0] if self._waiting else None

    def _failed(self, error: JournalError) -> None:
        with self._changed:
            if self._told < len(self._waiting):
                self._told = len(self._waiting)
                self._news.append(JournalFailed(f"{error.path}: {error.reason}", tuple(self._waiting)))

    def _written(self, record: Record) -> None:
        with self._changed:
            if self._waiting and self._waiting[0] is record:
                self._waiting.popleft()
            if self._told and not self._waiting:
                self._news.append(JournalWritten())
            self._told = min(self._told, len(self._waiting))
