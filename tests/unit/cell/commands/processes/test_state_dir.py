"""One process per part of a cell and state folder."""

import os
from pathlib import Path

import pytest

from cell.commands.errors import CommandError
from cell.commands.processes.state_dir import Lock, state_folder


def test_the_default_folder_is_beside_the_cell_file(tmp_path: Path) -> None:
    assert state_folder(tmp_path / "cell.yaml", "two_arms", None) == tmp_path / ".zencell" / "two_arms"


def test_a_second_process_is_refused_and_told_who_runs(tmp_path: Path) -> None:
    with Lock(tmp_path, "manager"), pytest.raises(CommandError, match=f"process {os.getpid()}"):
        Lock(tmp_path, "manager")


def test_the_lock_goes_with_its_holder(tmp_path: Path) -> None:
    Lock(tmp_path, "manager").close()
    Lock(tmp_path, "manager").close()


def test_an_unwritable_folder_is_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(CommandError, match="Not a directory"):
        state_folder(tmp_path / "cell.yaml", "c", tmp_path / "file" / "below")


def test_a_folder_that_is_a_file_is_refused_with_the_next_step(tmp_path: Path) -> None:
    file = tmp_path / "state"
    file.write_text("")
    with pytest.raises(CommandError) as error:
        state_folder(tmp_path / "cell.yaml", "c", file)
    assert f"{file} cannot be used to keep the state of the cell: it is a file, not a folder" in error.value.what
    assert "--state-dir" in error.value.next_step


def test_a_lock_that_cannot_be_made_is_refused_with_the_next_step(tmp_path: Path) -> None:
    with pytest.raises(CommandError) as error:
        Lock(tmp_path / "missing", "manager")
    assert "manager.lock cannot be used" in error.value.what
