"""What the cell file says about belts and sensors, and what it may not say."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.config import load_cell
from cell.config.settings import SensorFrame
from tests.unit.config_world import CONFIGS, Copy

BELT = "belt/cell.yaml"
PROGRAM = "belt/programs/left.prog"
POSE = "pose: {X: 1350, Y: 0, Z: 900, A: 0, B: 0, C: 90}"
SEAM = "seam: {sensor: base, largest: 20}"


def test_lengths_and_times_become_si_and_a_conveyor_is_what_its_name_says() -> None:
    cell = load_cell(CONFIGS / BELT)
    belt, seam = (cell.robots["left"].corrections[name] for name in ("belt", "seam"))
    assert belt.conveyor == cell.conveyors["belt"]
    assert belt.conveyor.counts_per_metre == 10_000
    assert (belt.conveyor.largest_speed_m_s, belt.largest_m, belt.settle_s) == (0.3, 0.6, 0.1)
    assert (seam.sensor, seam.conveyor, seam.largest_m) == (SensorFrame.BASE, None, 0.02)
    assert (seam.largest_turn_rad, seam.fresh_s, seam.speed_m_s) == (0.0, 0.2, 0.2)


def test_a_belt_measured_by_three_points_is_the_one_with_their_pose(tmp_path: Path) -> None:
    points = "points: [[1350, -400, 900], [1350, 400, 900], [1000, 0, 900]]"
    measured = load_cell(Copy(tmp_path).change(BELT, POSE, points).folder / BELT).conveyors["belt"].pose
    given = load_cell(CONFIGS / BELT).conveyors["belt"].pose
    assert measured.quaternion_xyzw == pytest.approx(given.quaternion_xyzw)
    assert measured.position_m == (1.35, -0.4, 0.9)


@pytest.mark.parametrize(
    ("name", "old", "new", "at", "problem"),
    [
        (BELT, SEAM, "seam: {largest: 20}", (BELT, "seam: §{largest"),
         "robots.left.corrections.seam: found neither sensor nor conveyor, allowed exactly one of them"),
        (BELT, SEAM, "seam: {sensor: tool, conveyor: belt, largest: 20}", (BELT, "seam: §{sensor"),
         "robots.left.corrections.seam: found sensor and conveyor, allowed exactly one of them"),
        (BELT, "{conveyor: belt,", "{conveyor: line,", (BELT, "{conveyor: §line,"),
         "robots.left.corrections.belt.conveyor: found unknown conveyor 'line', allowed one of belt"),
        (BELT, "largest: 600,", "largest: 600, largest_turn: 5,", (BELT, "largest_turn: §5"),
         "robots.left.corrections.belt.largest_turn: found a turn, allowed no largest_turn: belts do not turn"),
        (BELT, "counts_per_metre: 10000", "counts_per_metre: 0", (BELT, "counts_per_metre: §0"),
         "conveyors.belt.counts_per_metre: found 0, allowed any number but 0"),
        (BELT, f"{POSE}, ", "", (BELT, "belt: §{counts"),
         "conveyors.belt: found neither pose nor points, allowed exactly one of them"),
        (BELT, POSE, "points: [[0, 0, 0], [100, 0, 0], [200, 0, 0]]", (BELT, "points: §["),
         "conveyors.belt.points: found the points lie in one line, allowed three points apart from "
         "each other"),
        (PROGRAM, "TRACK seam", "TRACK seem", (PROGRAM, "TRACK §seem"),
         "program: found unknown correction `seem`, allowed seam; there are also OFF, belt"),
    ],
)  # fmt: skip
def test_a_contradiction_is_named_where_it_stands(
    tmp_path: Path, name: str, old: str, new: str, at: tuple[str, str], problem: str
) -> None:
    copy = Copy(tmp_path).change(name, old, new)
    bundle, problems = check_cell(copy.folder / BELT)
    assert bundle is None
    assert [copy.shown(each) for each in problems] == [f"{copy.place(*at)}: {problem}"]


def test_off_is_no_name_for_a_correction(tmp_path: Path) -> None:
    copy = Copy(tmp_path).change(BELT, SEAM, f"off: {SEAM.partition(': ')[2]}")
    _, problems = check_cell(copy.folder / BELT)
    assert any("found the name 'off', allowed another name: TRACK OFF ends all" in str(each) for each in problems)
