"""`cell up` keeps what happened before an alarm, within limits, and says where."""

import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from zenoh import KeyExpr

from cell.commands.up import fault_recorder
from cell.commands.up.fault_recorder import FaultRecorder, make_room
from cell.messages import Event, Severity
from cell.net.codec import encode
from cell.net.inbox import Inbox
from cell.net.keys import Keys
from cell.net.latest import Decoder
from cell.recording.reader import Recorded
from tests.unit.cell.recording.recordings import TWO_ARMS

INFO = Event("robot/left", 1, Severity.INFO, "code", "text")
FAULT = replace(INFO, sequence=2, severity=Severity.ALARM, code="fault")


class Session:
    """Hands on what a test says."""

    def __init__(self) -> None:
        self.keys = Keys("two_arms")
        self._stores: list[tuple[str, Callable[[str, bytes], None]]] = []

    def queue(self, *_: str) -> Inbox:
        inbox = Inbox(Decoder(self.keys))
        self._stores.append(("**", inbox.store))
        return inbox

    def hear(self, key: str, store: Callable[[str, bytes], None]) -> None:
        self._stores.append((key, store))

    def hear_bundles(self, _: object) -> None:
        """Nothing comes in bundles here."""

    def say(self, event: Event) -> None:
        key = self.keys.of(event)
        for pattern, store in self._stores:
            if KeyExpr(pattern).includes(KeyExpr(key)):
                store(key, encode(event))


def run(folder: Path, *events: Event) -> list[str]:
    """What a recorder says that hears these events and then ends."""
    said: list[str] = []
    session = Session()
    with FaultRecorder(TWO_ARMS, session, Session(), folder, threading.Event(), said.append):  # type: ignore[arg-type]
        for event in events:
            session.say(event)
    return said


@pytest.fixture(autouse=True)
def at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fault_recorder, "PACK_S", 0.01)


def test_an_alarm_leaves_a_file_with_what_came_before(tmp_path: Path) -> None:
    said = run(tmp_path / "recordings", INFO, FAULT, replace(FAULT, sequence=3))
    (file,) = (tmp_path / "recordings").iterdir()
    assert file.name.endswith("Z-robot-left-fault.mcap")
    assert [message for message, _ in Recorded(file).messages()] == [INFO, FAULT, replace(FAULT, sequence=3)]
    assert said == [f"what happened before the alarm is kept: cell report {file}"]


def test_without_an_alarm_nothing_is_written(tmp_path: Path) -> None:
    assert run(tmp_path / "recordings", INFO) == []
    assert not (tmp_path / "recordings").exists()


def test_a_folder_that_cannot_be_made_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    (said,) = run(tmp_path / "file" / "recordings", FAULT)
    assert said.startswith("what happened before the alarm is not kept: ")


def test_the_oldest_files_make_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in "abcde":
        (tmp_path / f"{name}.mcap").write_bytes(bytes(100))
    (tmp_path / "a.txt").write_bytes(bytes(1000))
    monkeypatch.setattr(fault_recorder, "MOST_FILES", 4)
    make_room(tmp_path, ".mcap")
    assert sorted(path.stem for path in tmp_path.glob("*.mcap")) == list("bcde")
    monkeypatch.setattr(fault_recorder, "MOST_BYTES", 250)
    make_room(tmp_path, ".mcap")
    assert sorted(path.stem for path in tmp_path.glob("*.mcap")) == list("de")
    monkeypatch.setattr(fault_recorder, "MOST_BYTES", 10)
    make_room(tmp_path, ".mcap")
    assert [path.stem for path in tmp_path.glob("*.mcap")] == ["e"]
