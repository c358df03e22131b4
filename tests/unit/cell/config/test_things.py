"""Things in the cell file: their shapes, their mistakes, and programs that lead into them."""

from pathlib import Path

import pytest

from cell.commands.checks import check_cell
from cell.commands.checks.motions import check_motions
from cell.config import load_cell
from cell.config.settings import BoxShape, CylinderShape, HalfSpaceShape, MeshShape, SphereShape
from tests.unit.config_world import CELL, Copy

POSE = "pose: {X: 0, Y: 0, Z: 500, A: 0, B: 0, C: 0}"
TETRAHEDRON = "v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"


def with_thing(folder: Path, thing: str) -> Copy:
    return Copy(folder).add(CELL, f"things:\n  table: {{{thing}}}")


def test_every_shape_is_read_in_the_units_of_the_file(tmp_path: Path) -> None:
    copy = Copy(tmp_path)
    (copy.folder / "two_arms" / "part.obj").write_text(TETRAHEDRON)
    shapes = ("box: [100, 200, 300]", "sphere: 50", "cylinder: {radius: 20, length: 900}", "half_space: true")
    shapes += ("mesh: {file: part.obj, unit: inch}, margin: 0",)
    things = [f"  t{number}: {{{shape}, {POSE}}}" for number, shape in enumerate(shapes)]
    cell = load_cell(copy.add(CELL, "\n".join(["things:", *things])).cell)
    found = cell.robots["left"].things
    assert [thing.shape for thing in found] == [
        BoxShape((0.1, 0.2, 0.3)),
        SphereShape(0.05),
        CylinderShape(0.02, 0.9),
        HalfSpaceShape(),
        MeshShape(copy.folder / "two_arms" / "part.obj", 0.0254),
    ]
    assert [thing.margin_m for thing in found] == [0.005, 0.005, 0.005, 0.005, 0.0]
    before = cell.digest
    (copy.folder / "two_arms" / "part.obj").write_text(TETRAHEDRON.replace("9", "8"))
    assert load_cell(copy.cell).digest != before


@pytest.mark.parametrize(
    ("thing", "says"),
    [
        (POSE, "no shape"),
        (f"{POSE}, box: [1, 1, 1], sphere: 4", "box and sphere"),
        (f"{POSE}, box: [1, 0, 1]", "things.table.box[1]"),
        (f"{POSE}, half_space: false", "things.table.half_space"),
        (f"{POSE}, sphere: 5, margin: -1", "things.table.margin"),
        (f"{POSE}, sphere: 5, may_touch: {{middle: [tool]}}", "unknown robot 'middle'"),
        (f"{POSE}, sphere: 5, may_touch: {{left: [elbow]}}", "'elbow', no link of left"),
        (f"{POSE}, mesh: {{file: none.stl, unit: mm}}", "none.stl"),
        (f"{POSE}, mesh: {{file: cell.yaml, unit: mm}}", "no mesh"),
    ],
)
def test_what_is_wrong_with_a_thing_is_told_at_its_place(thing: str, says: str, tmp_path: Path) -> None:
    bundle, problems = check_cell(with_thing(tmp_path, thing).cell)
    assert bundle is None
    assert [problem for problem in problems if says in str(problem) and "things.table" in str(problem)], problems


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "found no mesh in part.stl: File is empty, allowed an STL or OBJ file with triangles"),
        (None, "which cannot be read: No such file or directory, allowed an STL or OBJ file"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_told_once_in_one_line(text: str | None, says: str, tmp_path: Path) -> None:
    copy = with_thing(tmp_path, f"{POSE}, mesh: {{file: part.stl, unit: mm}}")
    if text is not None:
        (copy.folder / "two_arms" / "part.stl").write_text(text)
    (problem,) = check_cell(copy.cell)[1]
    assert str(problem).endswith(says)
    assert "\n" not in str(problem)


def test_a_mesh_that_does_not_close_is_told_and_allowed(tmp_path: Path) -> None:
    copy = with_thing(tmp_path, f"{POSE}, mesh: {{file: part.obj, unit: mm}}")
    for text, warned in ((TETRAHEDRON, False), (TETRAHEDRON.replace("f 1 2 4\n", ""), True)):
        (copy.folder / "two_arms" / "part.obj").write_text(text)
        bundle, problems = check_cell(copy.cell)
        assert bundle is not None
        told = [str(each) for each in problems if "triangles that do not close" in str(each)]
        assert len(told) == warned
        assert all("things.table.mesh.file" in each for each in told)


@pytest.mark.parametrize(("height_mm", "sides"), [(2217, ["left", "right"]), (4000, [])])
def test_robots_at_home_keep_away_from_things(height_mm: int, sides: list[str], tmp_path: Path) -> None:
    """Whatever their programs do, even nothing."""
    table = f"box: [4000, 400, 400], pose: {{X: 0, Y: 0, Z: {height_mm}, A: 0, B: 0, C: 0}}"
    told = [str(each) for each in check_cell(with_thing(tmp_path, table).cell)[1] if "at home" in str(each)]
    assert len(told) == len(sides)
    for each, side in zip(told, sides, strict=True):
        assert f"things.table: found at home {side}'s link " in each
        assert "too near to table (margin 5 mm)" in each


def test_a_program_that_leads_into_a_thing_is_told_with_its_line_and_the_way_that_is_free(tmp_path: Path) -> None:
    table = "box: [600, 800, 50], pose: {X: 0, Y: 0, Z: 1150, A: 0, B: 0, C: 0}"
    bundle, problems = check_cell(with_thing(tmp_path, table).cell)
    assert bundle is not None, problems
    _, problems = check_motions(bundle)
    (left,) = [str(problem) for problem in problems if "left.prog" in str(problem)]
    assert "left.prog:9:1" in left
    assert "too near to table (margin 5 mm)" in left
    assert "free up to J1=" in left


def test_links_that_may_touch_are_named_by_number_or_name(tmp_path: Path) -> None:
    table = "box: [600, 800, 50], pose: {X: 0, Y: 0, Z: 1150, A: 0, B: 0, C: 0}"
    copy = with_thing(tmp_path, f"{table}, may_touch: {{left: [3, 4, 5, flange, tool]}}")
    bundle, problems = check_cell(copy.cell)
    assert bundle is not None, problems
    assert not [problem for problem in check_motions(bundle)[1] if "left.prog" in str(problem)]
