"""`cell check` plans every program before anything moves: what cannot be planned, and where the robot stops."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from cell.commands.cell_command import app
from cell.commands.checks.motions import listed
from tests.unit.config_world import Copy

BELT, PROGRAM = "belt/cell.yaml", "belt/programs/left.prog"
ABOVE = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0"
TOO_FAR = "MC QX=2000 QY=200 Z=1500 X=3500 Y=400 F=9999"


def checked(folder: Path, program: str) -> tuple[Result, str]:
    """The result with this program in the cell of one robot, and its text without the folder."""
    copy = Copy(folder)
    (copy.folder / PROGRAM).write_text(program)
    result = CliRunner().invoke(app, ["check", str(copy.folder / BELT)])
    return result, copy.shown(result.output)


@pytest.mark.parametrize(
    ("program", "line", "refused"),
    [
        (f"{ABOVE}\nML Z=1250 F=9999\n{TOO_FAR}\nHOME", 3, True),
        (f"ML Z=1900 F=9999\n{TOO_FAR}\nHOME", 2, False),
        (f"{ABOVE}\nTRACK belt\n{TOO_FAR}\nTRACK OFF", 3, False),
    ],
    ids=["known place", "from where nobody knows", "while it follows a belt"],
)
def test_move_that_cannot_be_planned_is_named_and_an_error_where_the_place_is_known(
    tmp_path: Path, program: str, line: int, refused: bool
) -> None:
    result, output = checked(tmp_path, program)
    assert result.exit_code == int(refused)
    mark = "" if refused else "warning: "
    assert f"{PROGRAM}:{line}:1: {mark}program: found {TOO_FAR!r}: line {line}" in output
    assert " at X " in output
    assert "what follows was not planned" in output
    assert ("is good" in output) is not refused


def test_a_path_close_to_a_singular_pose_is_a_warning_where_joints_alone_are_none(tmp_path: Path) -> None:
    joints = "MJ J1=0 J2=-12 J3=65 J4=0 J5=-20 J6=0\nMJ J5=20\nMJ J5=2"
    _, output = checked(tmp_path, f"{joints}\nML Z=1500 F=50\nHOME")
    told = [line for line in output.splitlines() if "singular pose" in line]
    assert [line.split(" ")[0] for line in told] == [f"{PROGRAM}:4:1:"]
    assert "'ML Z=1500 F=50': only 0.0" in told[0]
    assert "(wrist), allowed 0.05 or more" in told[0]


def test_a_joint_close_to_a_limit_is_a_warning(tmp_path: Path) -> None:
    result, output = checked(tmp_path, "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0\nMJ J3=74.75 R=0\nMJ J3=60\nHOME")
    assert result.exit_code == 0, output
    told = [line for line in output.splitlines() if "of its limit" in line]
    assert f"{PROGRAM}:2:1: warning: program: found 'MJ J3=74.75 R=0': J3 comes within 0.25 deg of its limit" in told[0]
    assert told[0].endswith("allowed 1 deg or more, as room for jogs and corrections")


def test_stops_that_nothing_asks_for_are_listed_and_each_loop_is_gone_through_twice(tmp_path: Path) -> None:
    program = f"""{ABOVE}
LABEL again
ML Y=100 F=9999
ML Z=1300 R=10
ML Y=0
WAIT 0.1
ML Z=1350 R=0
ML Y=50
ML Y=0
GOTO again 1000
HOME
LABEL forever
MJ J1=10
MJ J1=-10
GOTO forever
"""
    result, output = checked(tmp_path, program)
    assert result.exit_code == 0
    (row,) = [line for line in output.splitlines() if "left.prog" in line]
    assert row.split() == ["left", "left.prog", "10", row.split()[3], "1,", "3,", "8-9,", "11,", "13-14"]
    assert 5.0 < float(row.split()[3]) < 30.0


def test_moves_that_were_not_looked_at_are_a_warning(tmp_path: Path) -> None:
    program = f"{ABOVE}\nGOTO on 1\nML Z=1300 F=9999\nLABEL on\nML Y=1100 F=16\nWAIT 0.1\nML Y=0\nEND"
    result, output = checked(tmp_path, program)
    assert result.exit_code == 0
    assert f"{PROGRAM}:3:1: warning: program: found moves that were not planned, lines 3, 7, allowed " in output


@pytest.mark.parametrize(
    ("moves", "lines"),
    [
        ("ML Y=100 F=9999\nML Y=0 A=0 B=90 C=180\nML Y=100 A=0 B=90 C=0\nML Y=0 A=0 B=90 C=90", ["3", "4"]),
        ("ML A=0 B=90 C=90 F=9999\nML A=0 B=90 C=180", []),
        ("ML Y=100 R=20 F=9999\nML X=1300 A=0 B=90 C=180 R=20\nML Y=0", ["3"]),
        ("MS X=1250 Y=50 F=9999\nMS X=1300 Y=0 A=0 B=90 C=180", ["3"]),
        ("MC QX=1250 QY=50 X=1300 Y=0 A=0 B=90 C=180 F=9999", ["2"]),
        ("MC QX=1250 QY=50 QA=0 QB=90 QC=60 X=1300 Y=0 A=0 B=90 C=180 F=9999", []),
        ("TANG 1\nML X=1300 F=9999\nML X=1200\nTANG 0", ["4"]),
    ],
)
def test_an_exact_half_turn_is_a_warning_that_names_the_line(tmp_path: Path, moves: str, lines: list[str]) -> None:
    result, output = checked(tmp_path, f"{ABOVE}\n{moves}")
    assert result.exit_code == 0, output
    assert (
        re.findall(r"left\.prog:(\d+):1: warning: program: found .*: an exact half turn of the tool", output) == lines
    )


def test_lines_are_listed_in_order_with_neighbours_together() -> None:
    assert listed({12, 3, 4, 5, 9}) == "3-5, 9, 12"


def test_a_program_with_a_byte_order_mark_is_good(tmp_path: Path) -> None:
    result, output = checked(tmp_path, f"\ufeff{ABOVE}\nHOME")
    assert result.exit_code == 0, output
    assert "is good" in output


def test_both_ways_of_an_if_are_planned_in_a_loop_and_out_of_one(tmp_path: Path) -> None:
    program = f"""{ABOVE}
LET n = 0
LABEL again
IF n = 1
ML Y=50 F=9999
ELSE
ML Y=100
ENDIF
LET n = n + 1
IF n < 3
ML Z=1300
GOTO again
ELSE
{TOO_FAR}
ENDIF
ML Z=1350
HOME
"""
    result, output = checked(tmp_path / "far", program)
    assert result.exit_code == 1
    told = [line for line in output.splitlines() if PROGRAM in line]
    assert [line.split(" ")[0] for line in told] == [f"{PROGRAM}:14:1:"], output
    result, output = checked(tmp_path / "near", program.replace(TOO_FAR, "ML Z=1250 F=9999"))
    assert result.exit_code == 0, output
    assert "not planned" not in output
