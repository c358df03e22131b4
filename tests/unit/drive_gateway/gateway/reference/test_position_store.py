"""The file in which a gateway keeps where its axes stand."""

from pathlib import Path

import pytest

from drive_gateway.gateway.reference.encoder_record import EncoderRecord
from drive_gateway.gateway.reference.position_store import PositionStore, PositionStoreError

ONE = EncoderRecord(-3, 4711, 12, "abcdef01")
OTHER = EncoderRecord(0, 1, None, "abcdef01")


def test_what_is_kept_is_read_by_the_next_process(tmp_path: Path) -> None:
    path = tmp_path / "positions-bus.json"
    with PositionStore(path) as store:
        assert store.records == {}
        store.keep("left.J1", ONE)
        store.keep("left.J2", OTHER)
        store.keep("left.J2", ONE)
    assert PositionStore(path).records == {"left.J1": ONE, "left.J2": ONE}
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("content", ['{"left.J1": {"turns": 1', '{"left.J1": {"turns": "x"}}'])
def test_a_spoilt_file_is_named_with_what_to_do(tmp_path: Path, content: str) -> None:
    path = tmp_path / "positions-bus.json"
    path.write_text(content)
    with pytest.raises(PositionStoreError, match=r"positions-bus\.json: .*repair the file, or remove it"):
        PositionStore(path)


def test_a_disk_that_takes_nothing_is_told(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with PositionStore(tmp_path / "gone" / "positions-bus.json") as store:
        store.keep("left.J1", ONE)
    assert "positions are not stored" in caplog.text
