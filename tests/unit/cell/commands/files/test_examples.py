"""`cell examples` writes the shipped cells to where the user is."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from tests.unit.repository import ROOT


def files_of(folder: Path) -> dict[str, bytes]:
    """Every file that is kept, by its name below the folder."""
    return {
        str(each.relative_to(folder)): each.read_bytes()
        for each in sorted(folder.rglob("*"))
        if each.is_file() and ".zencell" not in each.parts
    }


def test_the_files_are_the_shipped_ones_and_a_changed_one_is_never_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    said = CliRunner().invoke(app, ["examples"], catch_exceptions=False).output
    assert "pick_and_place" in said
    assert "next: cell up cell_configs/two_arms/cell.yaml" in said
    assert files_of(tmp_path / "cell_configs") == files_of(ROOT / "cell_configs")
    mine = tmp_path / "cell_configs" / "two_arms" / "cell.yaml"
    mine.write_text("mine")
    with pytest.raises(CommandError, match="is there already"):
        CliRunner().invoke(app, ["examples"], catch_exceptions=False)
    assert mine.read_text() == "mine"


def test_a_folder_that_may_not_be_written_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    with pytest.raises(CommandError, match="cannot be written here"):
        CliRunner().invoke(app, ["examples"], catch_exceptions=False)
    tmp_path.mkdir()
