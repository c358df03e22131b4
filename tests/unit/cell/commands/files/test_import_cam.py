"""`cell import` writes what `CALL` of a CAM file runs."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from cell.config.points_file import CamSettings
from robot_agent.language import Names, parse_program
from robot_agent.language.form import formatted
from tests.unit.repository import ROOT

EXAMPLE = ROOT / "cell_configs" / "engraving" / "programs"
POINTS = str(EXAMPLE / "left.points.yaml")


def imported(*words: str) -> str:
    return CliRunner().invoke(app, ["import", *words], catch_exceptions=False).output


def test_the_program_is_what_the_call_runs_with_its_blocks_as_comments(tmp_path: Path) -> None:
    written = tmp_path / "plate.prog"
    said = imported(str(EXAMPLE / "plate.nc"), "--points", POINTS, "-o", str(written))
    text = written.read_text()
    assert said == f"{written}: 25 statements\n"
    assert "ML X=70 Y=5 Z=-0.4 F=40 ; N50 X70 F2400\n" in text
    assert "\n; (HOLE, DOWN A HELIX)\n" in text
    assert formatted(text) == text
    codes = {"M3": ("SET DO spindle", "WAIT 0.5"), "M5": ("RESET DO spindle",), "S": ()}
    names = Names(("J1",), cam=CamSettings(rapid_mm_s=200.0, codes=codes))
    called = parse_program((EXAMPLE / "plate.nc").read_text(), "plate.nc", names).statements
    again = parse_program(text, "plate.prog", names).statements
    plain = [[repr(each).replace(f"line={int(each.line)}", "") for each in some] for some in (called, again)]
    assert plain[0] == plain[1]


def test_a_program_that_is_there_stays_unless_it_is_to_be_replaced(tmp_path: Path) -> None:
    part, written = tmp_path / "part.nc", tmp_path / "part.prog"
    part.write_text("G0 X1\n\nX2\n")
    imported(str(part))
    assert written.read_text() == "; part.nc, written by cell import\nML X=1 F=250 ; G0 X1\n\nML X=2 ; X2\n"
    written.write_text("; mine\n")
    with pytest.raises(CommandError, match="is there already"):
        imported(str(part))
    assert written.read_text() == "; mine\n"
    imported(str(part), "--replace")
    assert "ML X=2" in written.read_text()


@pytest.mark.parametrize(
    ("name", "text", "points", "said"),
    [
        ("part.nc", "G0 X1\nG77 X2\nM3", "", r"part.nc:2:1: found `G77`(.|\n)*part.nc:3:1: found `M3`"),
        ("part.nc", None, "", "no such file"),
        ("part.dxf", "", "", r"part.dxf found, allowed a file .nc, "),
        ("part.nc", "G0 X1", "cam: {rapid: 0}", "cam.rapid: found 0"),
        ("part.nc", "M2", "", "a program without statements"),
    ],
)
def test_what_cannot_be_imported_is_told_and_nothing_is_written(
    tmp_path: Path, name: str, text: str | None, points: str, said: str
) -> None:
    (tmp_path / "points.yaml").write_text(points or "points: {}")
    if text is not None:
        (tmp_path / name).write_text(text)
    with pytest.raises(CommandError, match=said):
        imported(str(tmp_path / name), "--points", str(tmp_path / "points.yaml"))
    assert not list(tmp_path.glob("*.prog"))
