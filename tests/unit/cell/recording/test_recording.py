"""What is recorded is read as it was said, also from a file that was cut off; Foxglove's schemas lie beside it."""

import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from cell.messages import Event, Severity
from cell.recording.errors import RecordingError
from cell.recording.reader import Recorded
from cell.recording.writer import Recording
from tests.unit.cell.recording.recordings import ANY, BEGIN, read, record, two_arms
from tests.unit.message_kinds import same

EVENT = Event("robot/left", 1, Severity.ALARM, "fault", "J2 is hot", "let it cool", {"axis": "J2"}, "b")


def events(count: int) -> list[Any]:
    return [(replace(EVENT, sequence=i), BEGIN + 0.01 * i) for i in range(1, count + 1)]


@given(st.lists(ANY, min_size=1, max_size=12))
@settings(max_examples=20, suppress_health_check=[HealthCheck.too_slow])
def test_all_messages_come_back_equal_in_their_order(messages: list[Any]) -> None:
    heard = [(message, BEGIN + i / 8.0) for i, message in enumerate(messages)]
    with TemporaryDirectory() as folder:
        back = read(record(Path(folder) / "a.mcap", heard))
    assert [at for _, at in back] == [at for _, at in heard]
    assert all(same(one, other) for (one, _), (other, _) in zip(back, heard, strict=True))


def test_a_closed_file_is_valid_and_has_the_files_of_the_cell(tmp_path: Path) -> None:
    path = record(tmp_path / "a.mcap", events(10))
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        attached = {each.name: each.data for each in reader.iter_attachments()}
        logged = [schema.name for schema, _, _ in reader.iter_messages() if schema]
    assert summary is not None
    assert {"two_arms/cell.yaml", "two_arms/programs/left.prog", "models/six_axis.yaml"} < set(attached)
    assert json.loads(attached["layout.json"])["content"]
    assert logged == ["Event", "foxglove.Log"] * 10
    assert Recorded(path).settings.robots.keys() == {"left", "right"}


def test_every_cut_gives_the_messages_before_it(tmp_path: Path) -> None:
    """Wherever a recorder is killed: no message is made up, and none before the newest flush is lost."""
    whole = tmp_path / "whole.mcap"
    recording = Recording(whole, two_arms(), BEGIN)
    for message, at in events(20):
        recording.add(message, at)
    recording.flush()
    flushed = whole.stat().st_size
    for message, at in [(replace(EVENT, sequence=i), BEGIN + 1.0) for i in range(21, 41)]:
        recording.add(message, at)
    recording.close()
    data, path = whole.read_bytes(), tmp_path / "cut.mcap"
    begin = data.index(b"robot/left")
    for end in [*range(flushed - 40, len(data), 97), len(data) - 1]:
        path.write_bytes(data[:end])
        recorded = Recorded(path)
        found = [message.sequence for message, _ in recorded.messages() if isinstance(message, Event)]
        assert recorded.cut
        assert found == list(range(1, len(found) + 1))
        assert len(found) >= (20 if end >= flushed else 0)
    assert begin < flushed


def test_since_a_moment_begins_with_the_newest_of_each_before(tmp_path: Path) -> None:
    other = replace(EVENT, source="manager")
    path = record(tmp_path / "a.mcap", [(other, BEGIN), *events(10)])
    since = [(message.source, message.sequence) for message, _ in read(path, BEGIN + 0.085)]
    assert since == [("manager", 1), ("robot/left", 8), ("robot/left", 9), ("robot/left", 10)]
    assert [message.sequence for message, _ in read(path, BEGIN + 99.0)] == [1, 10]


def test_a_damaged_file_is_one_sentence(tmp_path: Path) -> None:
    path = record(tmp_path / "a.mcap", events(100))
    data = bytearray(path.read_bytes())
    with path.open("rb") as file:
        chunk = make_reader(file).get_summary().chunk_indexes[-1]  # type: ignore[union-attr]
    data[chunk.chunk_start_offset + chunk.chunk_length // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(RecordingError, match="is damaged at byte"):
        read(path)


@pytest.mark.parametrize("data", [b"", b"hello", b"\x89MCAP0\r\n", b"\x89MCAP0\r\n" * 3, bytes(1000)])
def test_what_is_no_recording_is_one_sentence(tmp_path: Path, data: bytes) -> None:
    path = tmp_path / "a.mcap"
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=r"a\.mcap is no (MCAP file|recording of a cell)"):
        Recorded(path)


def test_a_recording_of_another_version_names_both(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cell.recording.writer.to_json", lambda _: b'{"source": "a", "colour": "red"}')
    monkeypatch.setattr("cell.recording.writer.version", lambda _: "9.9")
    path = record(tmp_path / "a.mcap", events(1))
    with pytest.raises(RecordingError, match=r"was recorded by zencell 9\.9, and this one, .* cannot read it: Event: "):
        read(path)


def test_a_recording_is_never_written_over(tmp_path: Path) -> None:
    path = record(tmp_path / "a.mcap", events(3))
    before = path.read_bytes()
    with pytest.raises(RecordingError, match="there is such a file already"):
        Recording(path, two_arms(), BEGIN)
    assert path.read_bytes() == before


class FullDisk(type(Path())):  # type: ignore[misc]
    def open(self, *_: object) -> Any:
        return open("/dev/full", "wb")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this computer has no /dev/full")
def test_a_full_disk_is_one_sentence_and_nothing_else_is_printed(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(RecordingError, match=r"a\.mcap cannot be written any more: No space left"):
        Recording(FullDisk("a.mcap"), two_arms(), BEGIN)
    assert capfd.readouterr().err == ""
