"""What the manager remembers, on a real file."""

import threading
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from cell.manager.journal import Journal, JournalError, JournalWriter
from cell.manager.records import (
    EstopCleared,
    EstopLatched,
    JournalFailed,
    JournalWritten,
    Record,
    Stored,
    ZoneDecided,
    next_epoch,
)
from cell.messages import Estop

STOP = Estop("e1", True, "me", "test")


def read(path: Path) -> Stored:
    with Journal(path) as journal:
        return journal.read()


def test_a_new_journal_knows_nothing(tmp_path: Path) -> None:
    assert read(tmp_path / "j") == Stored(0, (), ())


def test_a_latched_stop_is_there_after_a_restart(tmp_path: Path) -> None:
    with Journal(tmp_path / "j") as journal:
        journal.write(EstopLatched(STOP))
        journal.write(EstopLatched(STOP))
    assert read(tmp_path / "j").estops == (STOP,)


def test_a_cleared_stop_leaves_its_id(tmp_path: Path) -> None:
    with Journal(tmp_path / "j") as journal:
        journal.write(EstopLatched(STOP))
        journal.write(EstopCleared("e1", "me"))
        journal.write(ZoneDecided("middle", "cleared", "me", "zone middle is free"))
    assert read(tmp_path / "j") == Stored(0, (), ("e1",))


def test_epochs_grow_over_restarts(tmp_path: Path) -> None:
    epochs = []
    for _ in range(3):
        with Journal(tmp_path / "j") as journal:
            epochs.append(journal.begin_epoch("boot"))
    assert epochs == sorted(set(epochs))
    assert read(tmp_path / "j").epoch == epochs[-1]


@pytest.mark.parametrize(("stored", "unix_s", "epoch"), [(0, 1.0009, 1000), (5000, 1.0, 5001), (1000, 1.0, 1001)])
def test_an_epoch_grows_though_the_clock_goes_back_or_the_journal_is_lost(
    stored: int, unix_s: float, epoch: int
) -> None:
    assert next_epoch(stored, unix_s) == epoch


def test_a_file_that_is_no_journal_is_named(tmp_path: Path) -> None:
    (tmp_path / "j").write_text("this is no database, but a text that is long enough to be taken for one" * 20)
    with pytest.raises(JournalError, match="choose another --state-dir"):
        Journal(tmp_path / "j")


class FullDisk(Journal):
    """A journal whose disk is full until somebody makes room."""

    full = True
    tries = 0

    def write(self, record: Record) -> None:
        self.tries += 1
        if self.full:
            raise JournalError(self.path, "database or disk is full")
        super().write(record)


def until(done: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10.0
    while not done():
        assert time.monotonic() < deadline
        threading.Event().wait(0.005)


def test_what_a_full_disk_did_not_take_is_told_tried_again_and_written_in_order_once_there_is_room(
    tmp_path: Path,
) -> None:
    news: list[object] = []
    with FullDisk(tmp_path / "j") as journal, JournalWriter(journal, retry_s=0.01) as writer:
        writer.store(EstopLatched(STOP))
        until(lambda: journal.tries > 2)
        writer.store(EstopCleared("e1", "me"))
        until(lambda: bool(news.extend(writer.news())) or len(news) == 2)
        journal.full = False
        until(lambda: bool(news.extend(writer.news())) or len(news) == 3)
    assert [type(each) for each in news] == [JournalFailed, JournalFailed, JournalWritten]
    assert news[1] == JournalFailed(
        f"{tmp_path / 'j'}: database or disk is full", (EstopLatched(STOP), EstopCleared("e1", "me"))
    )
    assert read(tmp_path / "j").cleared == ("e1",)


def test_a_manager_that_ends_does_not_wait_for_a_full_disk(tmp_path: Path) -> None:
    with FullDisk(tmp_path / "j") as journal, JournalWriter(journal, retry_s=1000.0) as writer:
        writer.store(EstopLatched(STOP))
        until(lambda: journal.tries == 1)
    assert journal.tries == 2


def test_what_was_stored_is_written_before_the_manager_ends(tmp_path: Path) -> None:
    with Journal(tmp_path / "j") as journal, JournalWriter(journal) as writer:
        writer.store(EstopLatched(STOP))
    assert read(tmp_path / "j").estops == (STOP,)
