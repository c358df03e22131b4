"""`cell plot` draws a program, and names the line that cannot be planned."""

import itertools
import json
import re
import sys
from html import unescape
from pathlib import Path

import pytest
from typer.testing import CliRunner

from cell.commands.cell_command import app
from cell.commands.errors import CommandError
from tests.unit.repository import ROOT

MODEL = str(ROOT / "cell_configs" / "models" / "six_axis.yaml")


def plotted(tmp_path: Path, text: str, model: str = MODEL) -> str:
    program, page = tmp_path / "p.prog", tmp_path / "p.html"
    program.write_text(text)
    CliRunner().invoke(app, ["plot", str(program), "--model", model, "-o", str(page)], catch_exceptions=False)
    return page.read_text()


def test_page_shows_path_speed_and_joint_speeds_against_their_limits(tmp_path: Path) -> None:
    page = plotted(tmp_path, "ML Z=1800 F=300 R=30\nML Y=200\nWAIT 1\nHOME")
    for title in ("Path of the TCP", "Speed of the TCP", "Joint speeds in percent of their limits", "J6"):
        assert title in page
    assert "in 2 motions" in page


def test_a_spline_joins_the_joint_moves_around_it_and_r0_stops_there(tmp_path: Path) -> None:
    program = "MJ J1=10 J2=5 {}\nMS X=1100 Y=400 F=9999\nMS X=1000 Y=600 Z=1500\n{}HOME"
    assert "in 1 motions" in plotted(tmp_path, program.format("", ""))
    assert "in 2 motions" in plotted(tmp_path, program.format("R=0", ""))
    assert "in 2 motions" in plotted(tmp_path, program.format("", "WAIT 1\n"))


@pytest.mark.parametrize(
    ("program", "passed", "motions"),
    [
        ("MJ J1=10\nMJ J1=20\nMJ J1=40", ["1 to 2", "2 to 3"], 1),
        ("MJ J1=10 J2=5\nMJ J1=20 J2=11\nMJ J1=40 J2=23", ["2 to 3"], 2),
        ("ML Z=1800 F=9999\nMJ J1=10\nMJ J1=20", ["2 to 3"], 2),
        ("MJ J1=10 R=0\nMJ J1=20", [], 2),
        ("MJ J1=10 SYNC=0\nMJ J1=20", [], 2),
        ("MJ J1=20\nMJ J1=10", [], 2),
    ],
)
def test_joint_moves_that_go_straight_on_are_one_motion(
    tmp_path: Path, program: str, passed: list[str], motions: int
) -> None:
    page = plotted(tmp_path, program)
    assert f"in {motions} motions" in page
    assert re.findall(r"line (\d to \d): C2, passes<", page) == passed


def test_page_says_how_far_each_move_goes_and_how_moves_meet(tmp_path: Path) -> None:
    page = unescape(plotted(tmp_path, "HOME\nML Z=1800 F=300 R=30\nML Y=200 R=200\nML X=1250\nML X=1200\nWAIT 1\nHOME"))
    for text in (
        "line 5: 50.0 mm, 0.0 deg, joints",
        "line 2 to 3: C0, rounds the corner, 7.95 mm beside it (the path turns by 90.0 deg; round edge of 30 mm)",
        "round edge of 200 mm, cut to 100.0 mm: half of the shorter move",
        "line 4 to 5: C0, stops (the path turns by 180.0 deg; there is no round edge)",
        "line 5 to 7: stops, the next move is planned by itself (WAIT 1 in line 6 comes before the next move)",
    ):
        assert text in page


def test_a_page_that_cannot_be_written_is_an_error_for_people(tmp_path: Path) -> None:
    program, page = tmp_path / "p.prog", tmp_path / "missing" / "p.html"
    program.write_text("HOME\nMJ J1=10")
    result = CliRunner().invoke(app, ["plot", str(program), "--model", MODEL, "-o", str(page)])
    assert isinstance(result.exception, CommandError)
    assert result.exception.what == f"{page} cannot be written: No such file or directory"


def test_a_picture_is_not_what_is_written_and_the_name_of_one_is_refused(tmp_path: Path) -> None:
    program = tmp_path / "p.prog"
    program.write_text("MJ J1=10")
    result = CliRunner().invoke(app, ["plot", str(program), "--model", MODEL, "-o", str(tmp_path / "p.png")])
    assert isinstance(result.exception, CommandError)
    assert result.exception.next_step == "name a file like p.html"
    assert not (tmp_path / "p.png").exists()


def test_each_line_of_the_program_has_its_times_a_loop_one_for_each_round(tmp_path: Path) -> None:
    page = plotted(tmp_path, "HOME ; <b>\nMJ J1=10\nLABEL a\nMJ J1=0\nMJ J1=10\nGOTO a 2")
    lines = re.findall(r"<li(?: data-at='([^']*)')?><b>(\d)</b>([^<]*)</li>", page)
    assert [text for _, _, text in lines] == [
        "HOME ; &lt;b&gt;", "MJ J1=10", "LABEL a", "MJ J1=0", "MJ J1=10", "GOTO a 2"
    ]  # fmt: skip
    times = [json.loads(at) if at else [] for at, _, _ in lines]
    assert list(map(len, times)) == [0, 1, 0, 3, 3, 0]
    flat = sorted(map(tuple, itertools.chain.from_iterable(times)))
    assert flat[0][0] == 0.0
    assert all(before[1] == pytest.approx(after[0]) for before, after in itertools.pairwise(flat))


def test_without_the_group_the_numbers_are_printed_and_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "plotly.graph_objects", None)
    monkeypatch.delitem(sys.modules, "cell.commands.pages.page", raising=False)
    program = tmp_path / "p.prog"
    program.write_text("MJ J1=10")
    result = CliRunner().invoke(app, ["plot", str(program), "--model", MODEL, "-o", str(tmp_path / "p.html")])
    assert "line 1: " in result.output
    assert isinstance(result.exception, CommandError)
    assert result.exception.next_step == "install them: pip install 'zencell[view]'"
    assert not (tmp_path / "p.html").exists()


def test_endless_program_is_cut_off(tmp_path: Path) -> None:
    program = tmp_path / "p.prog"
    program.write_text("LABEL a\nMJ J1=10\nMJ J1=-10\nGOTO a")
    arguments = ["plot", str(program), "--model", MODEL, "-o", str(tmp_path / "p.html"), "--longest", "3"]
    result = CliRunner().invoke(app, arguments, catch_exceptions=False)
    assert result.exit_code == 0


@pytest.mark.parametrize(
    "loop",
    [
        "WAIT 1",
        "SET DO x\nWAIT 1\nRESET DO x\nWAIT 1",
        "HOME\nWAIT 1",
        "HOME",
        "MJ J1=0\nMJ J4=0\nWAIT 0",
        "WAIT 0\nGOTO a 3000",
    ],
)
def test_a_loop_in_which_nothing_moves_ends_what_is_drawn(tmp_path: Path, loop: str) -> None:
    rounds = f"LABEL a\n{loop}\nGOTO a"
    assert "in 2 motions" in plotted(tmp_path, f"MJ J1=10\nHOME R=0\n{rounds}")
    with pytest.raises(CommandError, match="moves nothing"):
        plotted(tmp_path, f"HOME\n{rounds}")


def test_a_move_after_many_rounds_of_waiting_is_drawn(tmp_path: Path) -> None:
    assert "in 1 motions" in plotted(tmp_path, "LABEL a\nWAIT 1\nGOTO a 300\nMJ J1=10\nLABEL b\nWAIT 1\nGOTO b")


@pytest.mark.parametrize("waits", range(1, 9))
def test_moves_that_are_planned_ahead_while_the_robot_waits_are_drawn(tmp_path: Path, waits: int) -> None:
    program = "WAIT 1\n" * waits + "LABEL a\nMJ J1=10 R=0\nMJ J1=-10 R=0\nGOTO a 2"
    assert "in 6 motions" in plotted(tmp_path, program)
    assert "in 6 motions" in plotted(tmp_path, program.replace("GOTO a 2", "WAIT 1\nGOTO a 2"))


def test_a_program_with_a_byte_order_mark_is_drawn_and_another_encoding_is_told_by_its_line(tmp_path: Path) -> None:
    assert "in 1 motions" in plotted(tmp_path, "\ufeffMJ J1=10")
    program = tmp_path / "latin.prog"
    program.write_bytes("HOME\n; Größe\nMJ J1=10".encode("latin-1"))
    result = CliRunner().invoke(app, ["plot", str(program), "--model", MODEL, "-o", str(tmp_path / "l.html")])
    assert isinstance(result.exception, CommandError)
    assert "latin.prog:2:5: file: found the byte 0xf6, allowed text in UTF-8" in result.exception.what


def test_line_that_cannot_be_planned_is_named_and_what_comes_before_it_is_drawn(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match="line 2"):
        plotted(tmp_path, "MJ J1=10\nML X=9000 F=9999")
    assert (tmp_path / "p.html").exists()


@pytest.mark.parametrize(
    ("program", "why"),
    [
        (
            "MJ J1=10\nMS X=1000 Y=0 F=9999\nMS X=800 Y=0\nMS X=1000 Y=0",
            "line 4: the spline turns back on itself",
        ),
        ("MJ J1=10\nTANG 1\nML X=1000 A=0 B=90 C=0 F=9999", "line 3: A, B and C are named while TANG is on"),
    ],
)
def test_what_no_robot_can_do_is_named_with_its_line(tmp_path: Path, program: str, why: str) -> None:
    with pytest.raises(CommandError, match=why):
        plotted(tmp_path, program)


@pytest.mark.parametrize(
    ("name", "program", "joint"),
    [
        ("scara", "MJ J3=-100\nML X=400 Y=100 F=9999", "J4"),
        ("delta", "ML X=150 Z=-600 F=9999", "J4"),
        ("gantry", "MJ J1=1100 J3=400\nML Y=-200 F=9999", "J6"),
        ("palletizer", "ML X=1400 Z=1200 F=9999", "J4"),
    ],
)
def test_programs_of_every_kind_of_robot_are_drawn(tmp_path: Path, name: str, program: str, joint: str) -> None:
    page = plotted(tmp_path, program, str(ROOT / "cell_configs" / "models" / f"{name}.yaml"))
    assert joint in page


def test_a_slide_that_would_leave_its_range_is_named_in_millimetres(tmp_path: Path) -> None:
    with pytest.raises(CommandError, match=r"joint J3 would need 400.00 mm, allowed -150.00 to 40.00"):
        plotted(tmp_path, "MJ J3=400", str(ROOT / "cell_configs" / "models" / "scara.yaml"))
