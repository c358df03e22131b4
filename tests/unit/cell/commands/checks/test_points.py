"""`cell check` reads points files: what is wrong with them, and with programs that name points and frames."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.motions import check_motions
from tests.unit.config_world import CELL, Copy

PROGRAM = "two_arms/programs/left.prog"
POINTS = "two_arms/programs/left.points.yaml"
FRAMES = "frames: {table: {pose: {X: 1500, Y: 0, Z: 2000, A: 0, B: 0, C: 0}}}"
UP = "up: {J1: 0, J2: 0, J3: 0, J4: 0, J5: 40, J6: 0}"


def cell(folder: Path, program: str, points: str = "points: {}") -> Copy:
    copy = Copy(folder).add(CELL, FRAMES)
    (copy.folder / PROGRAM).write_text(program)
    (copy.folder / POINTS).write_text(points)
    return copy


def problems(copy: Copy) -> list[str]:
    found = [copy.shown(each) for each in check_cell(copy.cell)[1]]
    return [each for each in found if PROGRAM in each or POINTS in each]


def test_unknown_points_and_frames_are_told_with_the_line_and_the_nearest_name(tmp_path: Path) -> None:
    copy = cell(tmp_path, "MJ P=upp\nML X=0 Z=tabel F=9999\n", f"points: {{{UP}}}")
    assert problems(copy) == [
        f"{PROGRAM}:1:4: program: found unknown point `upp`, allowed up",
        f"{PROGRAM}:2:8: program: found unknown frame `tabel`, allowed table; Z0 is the base",
    ]


def test_a_points_file_is_checked_against_robot_cell_and_drives(tmp_path: Path) -> None:
    points = (
        "points:\n  a: {J1: 0}\n  b: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0, frame: tabel, branch: SIDE}\n"
        "signals: {clamp: {output: griper}}\n"
    )
    one, two, three = problems(cell(tmp_path, "HOME", points))
    assert one.startswith(f"{POINTS}:2:6: points.a: found nothing for J2, J3, J4, J5, J6, allowed all of J1")
    assert two.startswith(f"{POINTS}:3:50: points.b.frame: found unknown frame 'tabel', allowed table")
    assert three.startswith(f"{POINTS}:3:65: points.b.branch: found unknown branch 'SIDE', allowed one of")


@pytest.mark.parametrize(
    ("signals", "problem"),
    [
        ("clamp: {output: griper}", "signals.clamp.output: found unknown output 'griper', allowed "),
        ("there: {input: nothing}", "signals.there.input: found unknown input 'nothing', allowed "),
    ],
)
def test_another_name_stands_for_a_signal_of_the_drives_file(tmp_path: Path, signals: str, problem: str) -> None:
    (found,) = problems(cell(tmp_path, "HOME", f"signals: {{{signals}}}"))
    assert problem in found


def test_a_program_with_points_and_frames_is_planned_where_the_cell_file_says(tmp_path: Path) -> None:
    text = f"points: {{{UP}, HOME: {{J1: 5, J2: 0, J3: 0, J4: 0, J5: 40, J6: 0}}}}"
    copy = cell(tmp_path, "HOME\nMJ P=up\nML Z=-20 Z=table F=100\nML X=9000 Z=table\n", text)
    bundle, found = check_cell(copy.cell)
    assert bundle is not None, found
    _, planned = check_motions(bundle)
    (failure,) = [str(each) for each in planned if "left.prog" in str(each) and "not planned" in str(each)]
    assert "left.prog:4:1: program: found 'ML X=9000 Z=table': line 4" in failure
