"""The manager's disk: the real journal in memory, and what may become of its file."""

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Self

from cell.manager.journal import Journal, JournalError, JournalWriter
from cell.manager.records import JournalFailed, JournalWritten, Record
from cell.manager.shell import JOURNAL_FILE


class Disk:
    """Holds the journal's file as bytes, and every version of it. A manager that runs goes on writing to the file that
    it has opened, whatever takes that one's place."""

    def __init__(self) -> None:
        self.file: bytes | None = None
        self.full = False
        self._versions: list[bytes | None] = []
        self._replaced = 0

    def lose(self) -> None:
        """The file is gone at the manager's next start."""
        self.file, self._versions = None, []
        self._replaced += 1

    def fill(self, full: bool) -> None:
        """Whether writing fails for want of room."""
        self.full = full

    def roll_back(self, n: int) -> None:
        """The newest `n` writes are gone at the manager's next start: the file is an old copy."""
        for _ in range(min(n, len(self._versions))):
            self.file = self._versions.pop()
        self._replaced += 1

    def open(self, unix: Callable[[], float]) -> Journal:
        """The journal as a manager opens it. Raises `JournalError`."""
        return _SimJournal(self, unix)

    @property
    def replaced(self) -> int:
        """How often another file took the place of the one that is written."""
        return self._replaced

    def keep(self, file: bytes) -> None:
        """The file has been written."""
        self._versions.append(self.file)
        self.file = file


class _SimJournal(Journal):
    """The real journal; after each write its database goes to the disk."""

    def __init__(self, disk: Disk, unix: Callable[[], float]) -> None:
        self._disk = disk
        self._opened = disk.replaced
        super().__init__(Path(JOURNAL_FILE), unix, self._connect)

    def __enter__(self) -> Self:
        return self

    def _connect(self, _path: Path) -> sqlite3.Connection:
        if self._disk.file is None and self._disk.full:
            raise sqlite3.OperationalError("database or disk is full")
        connection = sqlite3.connect(":memory:")
        if self._disk.file is not None:
            connection.deserialize(self._disk.file)
        return connection

    def _write(self, sql: str, *values: str | int | float) -> None:
        if self._disk.full:
            raise JournalError(self.path, "database or disk is full")
        super()._write(sql, *values)
        if self._disk.replaced == self._opened:
            self._disk.keep(self._db.serialize())


class SimWriter(JournalWriter):
    """Writes at once what the disk takes, and tries again whenever the manager looks for news, without a thread."""

    def store(self, record: Record) -> None:
        super().store(record)
        self.write_waiting()

    def news(self) -> list[JournalFailed | JournalWritten]:
        self.write_waiting()
        return super().news()
