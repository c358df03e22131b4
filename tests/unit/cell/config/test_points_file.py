"""The points file: what it may say, and how a point is written into it."""

import math
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cell.config import ConfigError, load_cell
from cell.config.points_edit import write_point
from cell.config.points_file import (
    CamSettings,
    JointPoint,
    PointsOwner,
    PosePoint,
    Signal,
    SignalKind,
    load_points,
    read_points,
)
from cell.config.yaml_edit import NotWritten
from tests.unit.config_world import Copy

NAME = r"[A-Za-z][A-Za-z0-9_]{0,8}"
OWNER = PointsOwner(("J1", "lift"), {"lift"}, ("fixture",), ("gripper",), ("FRONT/UP", "BACK/UP"))
TEXT = """\
# taught on a Monday
points:   # in mm
  pick: {X: 600, Y: 0, Z: 400.5, A: 180, B: 0, C: 0, frame: fixture, tool: gripper, branch: UP} # over the part

  # nobody is there
  up:
    J1: 90   # sideways
    lift: 250
signals:
  part_there: {input: part_present}
  clamp: {output: gripper}
  door: {key: plant/door, fresh: 0.25}
# the end
"""


def file_of(folder: Path, text: str) -> Path:
    file = folder / "left.points.yaml"
    file.write_bytes(text.encode())
    return file


def found(folder: Path, text: str) -> list[str]:
    return [str(each).removeprefix(f"{folder}/") for each in read_points(file_of(folder, text), OWNER).problems]


def test_a_point_is_a_pose_in_a_frame_or_joints_and_a_signal_another_name(tmp_path: Path) -> None:
    read = load_points(file_of(tmp_path, TEXT), OWNER)
    pick = PosePoint((0.6, 0.0, 0.4005), (math.pi, 0.0, 0.0), "fixture", "gripper", "UP")
    assert read.points == {"pick": pick, "up": JointPoint((math.pi / 2.0, 0.25))}
    assert read.signals == {
        "part_there": Signal(SignalKind.INPUT, "part_present", 0.5),
        "clamp": Signal(SignalKind.OUTPUT, "gripper", 0.5),
        "door": Signal(SignalKind.KEY, "plant/door", 0.25),
    }


def test_a_file_that_is_not_there_yet_has_no_points(tmp_path: Path) -> None:
    assert load_points(tmp_path / "none.yaml", OWNER).points == {}


@pytest.mark.parametrize(
    ("point", "problem"),
    [
        ("{J1: 0}", "1:17: points.a: found nothing for lift, allowed all of J1, lift; or all of X, Y, Z, A, B, C"),
        ("{}", "1:17: points.a: found nothing for X, Y, Z, A, B, C, allowed all of X"),
        ("{X: 1, lift: 0, J1: 0}", "1:17: points.a: found X beside joints"),
        ("{J1: 0, lift: 0, tool: gripper}", "1:34: points.a.tool: found tool beside joints, allowed none"),
        ("{J1: no, lift: 0}", "1:22: points.a.J1: found 'no', allowed a number"),
        ("{J1: 99999, lift: 0}", "1:22: points.a.J1: found 99999, allowed -36000 to 36000"),
        ("{X: 1, Y: 2, Z: 3, A: 0, B: 0, C: 0, fram: x}", "found unknown key 'fram', allowed frame; there are also"),
        ("{X: 1, Y: 2, Z: 3, A: 0, B: 0, C: 0, frame: fixtur}", "found unknown frame 'fixtur', allowed fixture"),
        ("{X: 1, Y: 2, Z: 3, A: 0, B: 0, C: 0, tool: saw}", "found unknown tool 'saw', allowed only gripper"),
        ("{X: 1, Y: 2, Z: 3, A: 0, B: 0, C: 0, branch: DOWN}", "found unknown branch 'DOWN'"),
        ("{X: 1e6, Y: 2, Z: 3, A: 0, B: 0, C: 0}", "1:21: points.a.X: found 1e+06, allowed -100000 to 100000"),
    ],
)
def test_what_is_wrong_with_a_point_is_said_where_it_stands(tmp_path: Path, point: str, problem: str) -> None:
    assert problem in "\n".join(found(tmp_path, f"points: {{a:     {point}}}"))


def test_a_signal_stands_for_exactly_one_thing(tmp_path: Path) -> None:
    problems = found(tmp_path, "signals:\n  a: {}\n  b: {input: x, output: y}\n  c: {input: x, fresh: 1}\n")
    assert [each.split(": found ")[1].split(",")[0] for each in problems] == [
        "none of them", "input and output", "a freshness",
    ]  # fmt: skip


def test_how_cam_files_are_read_is_said_beside_the_points(tmp_path: Path) -> None:
    text = "cam:\n  rapid: 80\n  skip: true\n  codes: {M3: [SET DO spindle, WAIT 1], M5: [RESET DO spindle], S: []}\n"
    codes = {"M3": ("SET DO spindle", "WAIT 1"), "M5": ("RESET DO spindle",), "S": ()}
    assert load_points(file_of(tmp_path, text), OWNER).cam == CamSettings(80.0, 0.05, True, codes)
    assert load_points(file_of(tmp_path, "points: {}"), OWNER).cam == CamSettings()


def test_codes_of_cam_files_are_checked(tmp_path: Path) -> None:
    problems = found(tmp_path, "cam:\n  codes:\n    M3: []\n    M30: []\n    M8: []\n    M9: []\n")
    assert problems == [
        "left.points.yaml:3:5: cam.codes.M3: found M3 without M5, allowed both, or M5 alone",
        "left.points.yaml:4:5: cam.codes.M30: found M30, allowed other codes: M2 and M30 end a program, M6 does what "
        "the code T of its tool says",
    ]
    (problem,) = found(tmp_path, "cam: {codes: {G28: []}}")
    assert "cam.codes.G28: found the name 'G28', allowed text matching" in problem


def test_a_new_point_comes_last_and_all_else_stays(tmp_path: Path) -> None:
    file = file_of(tmp_path, TEXT)
    place = PosePoint((0.1234567, -0.0, 1.0), (0.0, math.radians(-45.0), 0.0), "fixture")
    after = write_point(file, "place", place, OWNER)
    line = "  place: {X: 123.4567, Y: 0, Z: 1000, A: 0, B: -45, C: 0, frame: fixture}\n"
    assert file.read_text() == TEXT.replace("    lift: 250\n", f"    lift: 250\n{line}")
    assert list(after.points) == ["pick", "up", "place"]


def test_a_point_that_is_taught_again_keeps_its_place_and_its_comments(tmp_path: Path) -> None:
    file = file_of(tmp_path, TEXT)
    write_point(file, "up", JointPoint((0.0, 0.3)), OWNER)
    assert file.read_text() == TEXT.replace("J1: 90 ", "J1: 0 ").replace("lift: 250", "lift: 300")
    write_point(file, "pick", JointPoint((0.0, 0.3)), OWNER)
    assert "  pick: {J1: 0, lift: 300} # over the part\n\n  # nobody is there\n" in file.read_text()


def test_a_point_of_another_kind_does_not_take_comments_away(tmp_path: Path) -> None:
    file = file_of(tmp_path, TEXT)
    with pytest.raises(NotWritten, match=r"points.up has comments inside, and other keys are to be written"):
        write_point(file, "up", PosePoint((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), OWNER)
    assert file.read_text() == TEXT


@pytest.mark.parametrize(
    "text",
    [
        "points: {}\n", "signals: {}\n", "points: {a: {J1: 1, lift: 2}}", "points:\r\n  a: {J1: 1, lift: 2}\r\n",
        "points:\n    a:\n        J1: 1\n        lift: 2\n# end", "\ufeffpoints: {a: {J1: 1, lift: 2},}\n",
        "points:\n  a: {J1: 1, lift: 2}",
    ],
)  # fmt: skip
def test_a_file_of_any_form_takes_a_point(tmp_path: Path, text: str) -> None:
    file = file_of(tmp_path, text)
    before = dict(load_points(file, OWNER).points)
    assert write_point(file, "null", JointPoint((1.0, 0.5)), OWNER).points == before | {
        "null": JointPoint((pytest.approx(1.0, abs=1e-8), 0.5))  # type: ignore[arg-type]
    }
    assert load_points(file, OWNER).points.keys() == {*before, "null"}


def test_a_file_that_somebody_has_spoilt_stays_as_it_is(tmp_path: Path) -> None:
    file = file_of(tmp_path, "points: {a: {J1: 1}}")
    with pytest.raises(NotWritten, match=r"refused as it is now: .*nothing for lift.*; correct it, then teach again"):
        write_point(file, "b", JointPoint((0.0, 0.0)), OWNER)
    assert (file.read_text(), list(tmp_path.iterdir())) == ("points: {a: {J1: 1}}", [file])


def test_what_somebody_has_added_counts_from_then_on(tmp_path: Path) -> None:
    file = tmp_path / "left.points.yaml"
    write_point(file, "a", JointPoint((0.0, 0.0)), OWNER)
    file.write_text(file.read_text() + "  mine: {J1: 2, lift: 0}\n")
    assert list(write_point(file, "b", JointPoint((0.0, 0.0)), OWNER).points) == ["a", "mine", "b"]
    assert file.read_text().startswith("# Points of this robot")


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=st.lists(st.floats(-90.0, 90.0), min_size=6, max_size=6), name=st.from_regex(NAME, fullmatch=True))
def test_what_is_written_is_read_again(tmp_path: Path, values: list[float], name: str) -> None:
    file = file_of(tmp_path, TEXT)
    x, y, z, a, b, c = values
    point = PosePoint((x, y, z), (math.radians(a), math.radians(b), math.radians(c)), "fixture")
    read = write_point(file, name, point, OWNER).points[name]
    assert isinstance(read, PosePoint)
    assert read.position_m == pytest.approx(point.position_m, abs=1e-7)
    assert read.orientation_abc == pytest.approx(point.orientation_abc, abs=1e-8)
    comments = [line.split("#")[1] for line in TEXT.splitlines() if "#" in line]
    assert all(comment in file.read_text() for comment in comments)


def test_points_lie_beside_the_program_or_where_the_cell_file_says(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    before = load_cell(copy.cell)
    folder = before.robots["left"].program.parent
    assert before.robots["left"].points == folder / "left.points.yaml"
    owner = PointsOwner(("J1", "J2", "J3", "J4", "J5", "J6"))
    write_point(before.robots["left"].points, "a", JointPoint((0.0,) * 6), owner)
    assert load_cell(copy.cell).digest == before.digest
    copy.change(
        "two_arms/cell.yaml",
        "    program: programs/left.prog",
        "    program: programs/left.prog\n    points: taught.yaml",
    )
    with pytest.raises(ConfigError, match=r"robots.left.points: found 'taught.yaml': no such file"):
        load_cell(copy.cell)
    (copy.cell.parent / "taught.yaml").write_text("points: {}\n")
    assert load_cell(copy.cell).robots["left"].points == copy.cell.parent / "taught.yaml"
