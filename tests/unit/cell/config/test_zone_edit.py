"""A change of a zone written into a cell file: what is named changes, comments, order and all else stay."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config import load_cell
from cell.config.cell_edit import NotWritten
from cell.config.settings import PoseSettings, ZoneSettings
from cell.config.zone_edit import changed_zone, write_zone
from cell.geometry import SpaceOf, from_xyz_abc
from cell.messages import Place, SetZone
from tests.unit.config_world import CELL, Copy

OLD = "size: [900, 2600, 2600]"
ROUND = """\
cylinder:   # the turntable
      radius: 450  # with the clamps
      length: 2600"""


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    return Copy(tmp_path)


def zones(copy: Copy) -> dict[str, ZoneSettings]:
    return load_cell(copy.cell).zones


def place(x: float, y: float, z: float, c_deg: float = 0.0) -> Place:
    pose = PoseSettings.of(from_xyz_abc(np.array([x, y, z, 0.0, 0.0, np.radians(c_deg)])))
    return Place(pose.position_m, pose.quaternion_xyzw)


def order(**change: object) -> SetZone:
    return SetZone("handover", "me", **change)  # type: ignore[arg-type]


def test_only_the_numbers_of_the_pose_and_the_lengths_change(copy: Copy) -> None:
    before = copy.cell.read_text()
    found = write_zone(copy.cell, order(place=place(0.1, 0, 1.5, 30), shape="box", size_m=(1.0, 2.5, 2.0)), zones(copy))
    wanted = before.replace("{X: 0, Y: 0, Z: 1400, A: 0, B: 0, C: 0}", "{X: 100, Y: 0, Z: 1500, A: 0, B: 0, C: 30}")
    assert copy.cell.read_text() == wanted.replace(OLD, "size: [1000, 2500, 2000]")
    assert found == zones(copy)
    assert found["handover"].size_m == (1.0, 2.5, 2.0)


def test_another_shape_takes_the_place_of_the_old_one(copy: Copy) -> None:
    before = copy.cell.read_text()
    write_zone(copy.cell, order(shape="cylinder", size_m=(0.5, 1.25)), zones(copy))
    assert copy.cell.read_text() == before.replace(OLD, "cylinder: {radius: 500, length: 1250}")
    write_zone(copy.cell, order(shape="sphere", size_m=(0.4,)), zones(copy))
    assert copy.cell.read_text() == before.replace(OLD, "sphere: 400")
    write_zone(copy.cell, order(shape="sphere", size_m=(0.5,)), zones(copy))
    write_zone(copy.cell, order(shape="box", size_m=(0.1, 0.2, 0.3)), zones(copy))
    assert copy.cell.read_text() == before.replace(OLD, "box: [100, 200, 300]")


def test_a_shape_over_lines_keeps_its_comments_and_is_not_replaced_with_them(copy: Copy) -> None:
    copy.change(CELL, OLD, ROUND)
    before = copy.cell.read_text()
    write_zone(copy.cell, order(shape="cylinder", size_m=(0.5, 2.0)), zones(copy))
    changed = before.replace("radius: 450", "radius: 500").replace("length: 2600", "length: 2000")
    assert copy.cell.read_text() == changed
    with pytest.raises(NotWritten, match="has comments inside"):
        write_zone(copy.cell, order(shape="sphere", size_m=(0.5,)), zones(copy))
    assert copy.cell.read_text() == changed


def test_what_the_zone_does_not_say_yet_comes_first_in_it(copy: Copy) -> None:
    before = copy.cell.read_text()
    found = write_zone(copy.cell, order(of=SpaceOf.TCP, priority={"left": 2}), zones(copy))
    assert (found["handover"].of, found["handover"].priority) == (SpaceOf.TCP, {"left": 2})
    after = copy.cell.read_text()
    assert sorted(set(after.splitlines()) - set(before.splitlines())) == ["    of: tcp", "    priority: {left: 2}"]
    assert [line for line in after.splitlines() if line in before.splitlines()] == before.splitlines()
    write_zone(copy.cell, order(of=SpaceOf.BODY, priority={"left": 0, "right": 3}), zones(copy))
    assert zones(copy)["handover"].priority == {"left": 0, "right": 3}
    assert zones(copy)["handover"].of is SpaceOf.BODY
    assert "priority: {right: 3, left: 0}" in copy.cell.read_text()


def test_several_priorities_come_where_there_is_none_yet(copy: Copy) -> None:
    copy.change(CELL, OLD, f"{OLD}\n    priority: {{}}")
    write_zone(copy.cell, order(priority={"left": 1, "right": 3}), zones(copy))
    assert zones(copy)["handover"].priority == {"left": 1, "right": 3}
    assert "    priority: {left: 1, right: 3}\n" in copy.cell.read_text()


def test_a_zone_in_a_frame_is_placed_in_it(copy: Copy) -> None:
    copy.change(CELL, OLD, f"{OLD}\n    frame: table")
    copy.add(CELL, "frames: {table: {pose: {X: 500, Y: 0, Z: 0, A: 0, B: 0, C: 90}}}")
    cell, change = load_cell(copy.cell), order(place=place(0.2, 0.0, 1.0))
    planned = changed_zone(cell.zones["handover"], change, cell.frames)
    np.testing.assert_allclose(planned.pose.position_m, (0.5, 0.2, 1.0), atol=1e-12)
    found = write_zone(copy.cell, change, cell.zones)["handover"]
    np.testing.assert_allclose(found.pose.matrix(), planned.pose.matrix(), atol=1e-9)
    assert "{X: 200, Y: 0, Z: 1000, A: 0, B: 0, C: 0}" in copy.cell.read_text()


@given(
    at=st.tuples(*[st.floats(-3.0, 3.0)] * 3, st.floats(-180.0, 180.0)),
    shape=st.sampled_from(["box", "sphere", "cylinder"]),
    lengths=st.tuples(*[st.floats(1e-3, 5.0)] * 3),
)
@settings(max_examples=15, deadline=None)
def test_what_is_planned_is_what_the_file_says_then(
    tmp_path_factory: pytest.TempPathFactory,
    at: tuple[float, float, float, float],
    shape: str,
    lengths: tuple[float, ...],
) -> None:
    copy = Copy(tmp_path_factory.mktemp("cell"))
    size_m = lengths[: {"box": 3, "sphere": 1, "cylinder": 2}[shape]]
    change, before = order(place=place(*at), shape=shape, size_m=size_m), load_cell(copy.cell)
    planned = changed_zone(before.zones["handover"], change, before.frames)
    found = write_zone(copy.cell, change, before.zones)["handover"]
    assert found.shape == planned.shape
    np.testing.assert_allclose(found.size_m, planned.size_m, atol=1e-7)
    np.testing.assert_allclose(found.pose.matrix(), planned.pose.matrix(), atol=1e-6)
    assert load_cell(copy.cell).digest == before.digest


def test_a_file_that_somebody_has_changed_since_is_left_to_him(copy: Copy) -> None:
    running = zones(copy)
    copy.change(CELL, OLD, "size: [900, 2600, 2601]")
    before = copy.cell.read_text()
    with pytest.raises(NotWritten, match="gives handover otherwise than the cell runs with"):
        write_zone(copy.cell, order(of=SpaceOf.TCP), running)
    assert copy.cell.read_text() == before


def test_what_the_file_would_be_refused_for_is_not_written(copy: Copy) -> None:
    before = copy.cell.read_text()
    with pytest.raises(NotWritten, match="a priority of middle, which may not ask for the zone"):
        write_zone(copy.cell, order(priority={"middle": 2}), zones(copy))
    assert copy.cell.read_text() == before


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({}, "nothing to change"),
        ({"size_m": (1.0,)}, "lengths without a shape"),
        ({"shape": "cone", "size_m": (1.0,)}, "shape: found 'cone'"),
        ({"shape": "sphere", "size_m": (1.0, 2.0)}, "found 2 lengths"),
    ],
)
def test_an_order_that_says_nothing_or_no_shape_is_none(change: dict[str, object], says: str) -> None:
    with pytest.raises(ValueError, match=says):
        order(**change)
