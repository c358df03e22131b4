"""Spaces, cones and joint ranges in the cell file: what they mean, their mistakes, and programs that break them."""

from pathlib import Path

import numpy as np
import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.motions import check_motions
from cell.config import load_cell
from cell.config.settings import BoxShape, HullShape, JointRange, SpaceKind
from cell.geometry import SpaceOf
from tests.unit.config_world import CELL, DRIVES, Copy

PROGRAM = "    program: programs/left.prog\n"
POSE = "pose: {X: -1800, Y: 0, Z: 1500, A: 0, B: 0, C: 0}"
WIDE = f"kind: safe, box: [6000, 6000, 6000], {POSE}"
TABLE = "kind: forbidden, box: [600, 800, 50], pose: {X: 0, Y: 0, Z: 1150, A: 0, B: 0, C: 0}"
CORNERS = "[[0, 0, 0], [100, 0, 0], [0, 100, 0], [0, 0, 100]]"


def with_keys(folder: Path, *lines: str) -> Copy:
    """The example with more keys of its robot `left`."""
    return Copy(folder).change(CELL, PROGRAM, PROGRAM + "".join(f"    {line}\n" for line in lines))


def spaces(folder: Path, *entries: str) -> Copy:
    return with_keys(folder, "spaces:", *[f"  s{number}: {{{entry}}}" for number, entry in enumerate(entries)])


def test_spaces_are_read_in_the_units_of_the_file(tmp_path: Path) -> None:
    copy = spaces(
        tmp_path, WIDE, f"kind: safe, hull: {CORNERS}, {POSE}, margin: 20, of: tcp",
        f"kind: forbidden, sphere: 50, {POSE}, by_program: true",
        f"kind: forbidden, sphere: 50, {POSE}, off_while: door",
    )  # fmt: skip
    wide, hull, program, door = load_cell(copy.cell).robots["left"].spaces
    assert wide.kind is SpaceKind.SAFE
    assert wide.shape == BoxShape((6.0, 6.0, 6.0))
    assert (wide.margin_m, wide.of, wide.by_program, wide.off_while) == (0.005, SpaceOf.BODY, False, None)
    assert hull.shape == HullShape(((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), (0.0, 0.1, 0.0), (0.0, 0.0, 0.1)))
    assert (hull.margin_m, hull.of) == (0.02, SpaceOf.TCP)
    assert program.by_program
    assert door.off_while == "door"
    assert load_cell(copy.cell).robots["left"].program_spaces == {"s2"}


def test_the_cone_and_joint_ranges_are_read_in_the_units_of_the_file(tmp_path: Path) -> None:
    copy = with_keys(tmp_path, "orientation: {axis: Z, towards: [0, 0, -2], within: 30}", "joints: {J1: [-90, 45]}")
    left = load_cell(copy.cell).robots["left"]
    assert left.orientation is not None
    assert (left.orientation.axis, left.orientation.towards) == (2, (0.0, 0.0, -1.0))
    assert left.orientation.within_rad == pytest.approx(np.radians(30.0))
    assert left.joints["J1"] == JointRange(tuple(np.radians([-90.0, 45.0]).tolist()), (-0.09, 0.045))
    bundle, problems = check_cell(copy.cell)
    assert [str(problem) for problem in problems if "at home Z of the tool points" in str(problem)]
    bundle, problems = check_cell(with_keys(tmp_path / "other", "joints: {J1: [-90, 45]}").cell)
    assert bundle is not None, problems
    np.testing.assert_allclose(np.degrees(bundle.robots["left"].model.limits.position[0]), [-90.0, 45.0])
    assert np.degrees(bundle.robots["right"].model.limits.position[0, 1]) > 90.0


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        (f"box: [1, 1, 1], {POSE}", "kind"),
        (f"kind: safe, {POSE}", "no shape"),
        (f"kind: safe, sphere: 100, {POSE}", "box or hull"),
        (f"kind: forbidden, hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], {POSE}", "hull"),
        (f"kind: forbidden, hull: [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], {POSE}", "lie in one plane"),
        (f"kind: safe, box: [9, 9, 9], {POSE}, off_while: door", "an input that switches a safe space"),
        (f"kind: forbidden, sphere: 9, {POSE}, off_while: door, by_program: true", "an input beside by_program"),
        (f"kind: forbidden, sphere: 9, {POSE}, off_while: door", "unknown input 'door'"),
        (f"kind: slow, sphere: 9, {POSE}", "a slow space without speed"),
        (f"kind: forbidden, sphere: 9, {POSE}, speed: 100", "a speed in a forbidden space"),
        (f"kind: safe, box: [900, 900, 900], {POSE}", "too far out of safe space s0"),
    ],
)
def test_what_is_wrong_with_a_space_is_told_at_its_place(entry: str, says: str, tmp_path: Path) -> None:
    bundle, problems = check_cell(spaces(tmp_path, entry).cell)
    assert bundle is None
    assert [problem for problem in problems if says in str(problem) and "robots.left.spaces" in str(problem)], problems


@pytest.mark.parametrize(
    ("key", "says"),
    [
        ("joints: {J9: [-10, 10]}", "unknown joint 'J9'"),
        ("joints: {J1: [-400, 10]}", "a range within that of the robot file"),
        ("joints: {J1: [10, -10]}", "the lower end first"),
        ("joints: {J1: [50, 60]}", "home is outside"),
        ("orientation: {towards: [0, 0, 0], within: 10}", "a direction [x, y, z] that is not zero"),
        ("orientation: {towards: [0, 0, 1], within: 180}", "less than 180 deg"),
    ],
)
def test_what_is_wrong_with_a_cone_or_a_range_is_told(key: str, says: str, tmp_path: Path) -> None:
    bundle, problems = check_cell(with_keys(tmp_path, key).cell)
    assert bundle is None
    assert [problem for problem in problems if says in str(problem) and "robots.left" in str(problem)], problems


def test_an_input_of_the_drives_file_may_switch_a_space(tmp_path: Path) -> None:
    copy = spaces(tmp_path, f"{TABLE}, off_while: door")
    copy.change(DRIVES, "robots:\n  left:\n", "robots:\n  left:\n    inputs: {door: {axis: J1, bit: 20}}\n")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    assert not [problem for problem in check_motions(bundle)[1] if "left.prog" in str(problem)]


def test_a_program_that_leaves_its_spaces_is_told_with_line_place_and_the_way_that_is_free(tmp_path: Path) -> None:
    bundle, problems = check_cell(spaces(tmp_path, WIDE, f"{TABLE}, by_program: true").cell)
    assert bundle is not None, problems
    (left,) = [str(problem) for problem in check_motions(bundle)[1] if "left.prog" in str(problem)]
    assert "left.prog:9:1" in left
    assert "too near to forbidden space s1 (margin 5 mm)" in left
    assert "s after the motion begins; free up to J1=" in left


def test_a_program_names_only_spaces_that_it_may_switch(tmp_path: Path) -> None:
    copy = spaces(tmp_path, WIDE, f"{TABLE}, by_program: true")
    program = copy.folder / "two_arms" / "programs" / "left.prog"
    text = program.read_text()
    program.write_text(f"SPACE s1 OFF\n{text}")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    assert not [problem for problem in check_motions(bundle)[1] if "left.prog" in str(problem)]
    for wrong in ("SPACE s0 OFF", "SPACE s1", "SPACE s1 0"):
        program.write_text(f"{wrong}\n{text}")
        bundle, problems = check_cell(copy.cell)
        assert bundle is None
        assert [problem for problem in problems if "SPACE" in str(problem) or "unknown space `s0`" in str(problem)]
