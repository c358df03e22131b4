"""What a recording holds, and which files it takes."""

import threading
from pathlib import Path

import can
import pytest

from drive_gateway.config.settings import BusSettings
from drive_gateway.gateway.bus.recorder import FORMATS, Recorder, RecordError

BUS = BusSettings("virtual", "recorder_test", 500_000, {})


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_gives_the_frames_back(tmp_path: Path, suffix: str) -> None:
    file, stop = tmp_path / f"bus{suffix}", threading.Event()
    with can.Bus(interface="virtual", channel="recorder_test") as sender, Recorder(BUS, file) as recorder:
        for number in range(3):
            sender.send(can.Message(arbitration_id=0x181, data=bytes([number]), is_extended_id=False))
        assert recorder.run(0.5, stop) == 3
    with can.LogReader(file) as frames:
        found = [(frame.arbitration_id, bytes(frame.data)) for frame in frames]
    assert found == [(0x181, bytes([number])) for number in range(3)]


def test_another_suffix_is_refused_with_those_that_are_allowed(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match=r"allowed are \.log \(candump\)"):
        Recorder(BUS, tmp_path / "bus.pdf")


def test_a_folder_that_does_not_exist_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="cannot be written"):
        Recorder(BUS, tmp_path / "nowhere" / "bus.asc")


def test_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordError, match="cannot be written"):
        Recorder(BUS, tmp_path / "bus\0.asc")
