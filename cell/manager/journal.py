"""What the manager remembers over restarts, in an SQLite file in the cell's state folder."""

import sqlite3
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self, assert_never

from cell.manager.records import EstopCleared, EstopLatched, Record, Stored, ZoneDecided, next_epoch
from cell.messages import Estop

_TABLES = """
CREATE TABLE IF NOT EXISTS epochs (epoch INTEGER PRIMARY KEY, boot TEXT NOT NULL, at REAL NOT NULL);
CREATE TABLE IF NOT EXISTS estops (
    id TEXT PRIMARY KEY, set_by TEXT NOT NULL, reason TEXT NOT NULL, set_at REAL NOT NULL,
    cleared_by TEXT, cleared_at REAL
);
CREATE TABLE IF NOT EXISTS zone_decisions (
    zone TEXT NOT NULL, decision TEXT NOT NULL, by TEXT NOT NULL, found TEXT NOT NULL, at REAL NOT NULL
);
"""


class JournalError(Exception):
    """The journal cannot be read or written; without it no manager may run."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(f"journal {path}: {reason}; repair or move the file, or choose another --state-dir")
        self.path = path
        self.reason = reason


class Journal:
    """A context manager; every write is on disk before the method returns. Raises `JournalError`."""

    def __init__(
        self,
        path: Path,
        unix: Callable[[], float] = time.time,
        connect: Callable[[Path], sqlite3.Connection] = sqlite3.connect,
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
            rows = self._db.execute("SELECT id, set_by, reason, cleared_at FROM estops ORDER BY set_at").fetchall()
        except sqlite3.Error as error:
            raise JournalError(self.path, str(error)) from error
        active = tuple(Estop(id_, True, by, reason) for id_, by, reason, cleared in rows if cleared is None)
        return Stored(epoch, active, frozenset(id_ for id_, _, _, cleared in rows if cleared is not None))

    def begin_epoch(self, boot: str) -> int:
        """The number of a new epoch, stored before it is used."""
        unix_s = self._unix()
        epoch = next_epoch(self.read().epoch, unix_s)
        self._write("INSERT INTO epochs VALUES (?, ?, ?)", epoch, boot, unix_s)
        return epoch

    def write(self, record: Record) -> None:
        """Store one record."""
        at = self._unix()
        match record:
            case EstopLatched(estop):
                sql = "INSERT OR IGNORE INTO estops (id, set_by, reason, set_at) VALUES (?, ?, ?, ?)"
                self._write(sql, estop.id, estop.by, estop.reason, at)
            case EstopCleared(id=estop_id, by=by):
                self._write("UPDATE estops SET cleared_by = ?, cleared_at = ? WHERE id = ?", by, at, estop_id)
            case ZoneDecided(zone, decision, by, found):
                self._write("INSERT INTO zone_decisions VALUES (?, ?, ?, ?, ?)", zone, decision, by, found, at)
            case _:
                assert_never(record)

    def _write(self, sql: str, *values: str | int | float) -> None:
        try:
            with self._db:
                self._db.execute(sql, values)
        except sqlite3.Error as error:
            raise JournalError(self.path, str(error)) from error
