"""What the cell file says about frames, and what it may not say."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.commands.checks import check_cell
from cell.config import load_cell
from cell.config.fields import Pose
from cell.config.frame_entry import FrameEntry, FrameTree
from cell.config.settings import PoseSettings
from cell.geometry import compose, from_xyz_abc
from tests.unit.config_world import CELL, Copy

TABLE = "table: {pose: {X: 900, Y: 0, Z: 700, A: 0, B: 0, C: 90}}"
NEST = "nest: {parent: table, pose: {X: 100, Y: 0, Z: 20, A: 0, B: 0, C: 0}}"
ZONE = "pose: {X: 0, Y: 0, Z: 1400, A: 0, B: 0, C: 0}"
BASE = "base: {X: -1800, Y: 0, Z: 0, A: 0, B: 0, C: 0}"
BELT = "belt: {points: [[0, 0, 0], [9, 0, 0], [0, 9, 0]], frame: nest, counts_per_metre: 1, largest_speed: 9}"
BALL = "things: {ball: {sphere: 5, pose: {X: 10, Y: 0, Z: 0, A: 0, B: 0, C: 0}, frame: nest}}"


def with_frames(tmp_path: Path, *frames: str) -> Copy:
    return Copy(tmp_path).add(CELL, f"frames: {{{', '.join(frames)}}}")


def angles() -> st.SearchStrategy[float]:
    return st.floats(-7.0, 7.0) | st.sampled_from([0.0, np.pi / 2, -np.pi / 2, np.pi])


POSES = st.tuples(*[st.floats(-5.0, 5.0)] * 3, *[angles()] * 3)


@given(st.lists(st.tuples(POSES, st.integers(0, 1000)), min_size=1, max_size=6))
def test_a_frame_is_where_its_parents_lead_in_whatever_order_they_stand(
    drawn: list[tuple[tuple[float, ...], int]],
) -> None:
    """Each frame has world or one drawn before it as its parent."""
    names = [f"f{number}" for number in range(len(drawn))]
    parents = [([None, *names[:k]])[pick % (k + 1)] for k, (_, pick) in enumerate(drawn)]
    entries = {
        name: FrameEntry(pose=Pose(**dict(zip("XYZABC", pose, strict=True))), parent=parent)
        for name, (pose, _), parent in zip(names, drawn, parents, strict=True)
    }
    found = FrameTree(dict(reversed(entries.items()))).settings({})
    for name, (pose, _), parent in zip(names, drawn, parents, strict=True):
        above = np.eye(4) if parent is None else found[parent].pose.matrix()
        np.testing.assert_allclose(found[name].pose.matrix(), compose(above, from_xyz_abc(np.array(pose))), atol=1e-9)


@given(st.lists(st.integers(0, 6), min_size=7, max_size=7))
def test_a_frame_is_placed_unless_the_way_up_from_it_goes_in_a_circle(above: list[int]) -> None:
    zero = Pose(X=0.0, Y=0.0, Z=0.0, A=0.0, B=0.0, C=0.0)
    entries = {
        f"f{k}": FrameEntry(pose=zero, parent=f"f{up}" if up < 6 else None) for k, up in enumerate(above) if k < 6
    }

    def ends(frame: int) -> bool:
        for _ in range(7):
            if above[frame] == 6:
                return True
            frame = above[frame]
        return False

    assert set(FrameTree(entries).settings({})) == {f"f{k}" for k in range(6) if ends(k)}


def test_robots_zones_things_and_conveyors_may_be_given_in_a_frame(tmp_path: Path) -> None:
    copy = with_frames(tmp_path, TABLE, NEST).add(CELL, BALL)
    belt = f"conveyors: {{{BELT}}}"
    copy.change(CELL, ZONE, f"{ZONE}\n    frame: table").add(CELL, belt)
    cell = load_cell(copy.cell)
    turned = pytest.approx((0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)))
    (handover,), ball = cell.zones.values(), cell.robots["left"].things[0]
    assert (handover.pose.position_m, handover.pose.quaternion_xyzw) == (pytest.approx((0.9, 0.0, 2.1)), turned)
    assert (ball.pose.position_m, ball.pose.quaternion_xyzw) == (pytest.approx((0.9, 0.11, 0.72)), turned)
    assert cell.conveyors["belt"].pose.position_m == pytest.approx((0.9, 0.1, 0.72))
    assert cell.frames["nest"].parent == "table"


def test_a_robot_stands_where_its_base_is_in_its_frame(tmp_path: Path) -> None:
    copy = with_frames(tmp_path, "line: {pose: {X: 0, Y: 0, Z: 100, A: 0, B: 0, C: 0}}")
    before = load_cell(copy.cell).robots["left"].base.position_m
    copy.change(CELL, "gateway: left_bus\n", "gateway: left_bus\n    frame: line\n")
    assert load_cell(copy.cell).robots["left"].base.position_m == pytest.approx(np.add(before, (0, 0, 0.1)))
    assert check_cell(copy.cell)[0] is not None


def test_a_space_in_a_frame_is_placed_with_it_and_holds_it_where_it_is(tmp_path: Path) -> None:
    post = "post: {kind: forbidden, sphere: 5, pose: {X: 10, Y: 0, Z: 0, A: 0, B: 0, C: 0}, frame: nest}"
    copy = with_frames(tmp_path, TABLE, NEST)
    copy.change(CELL, "gateway: left_bus\n", f"gateway: left_bus\n    spaces: {{{post}}}\n")
    cell = load_cell(copy.cell)
    assert cell.robots["left"].spaces[0].pose.position_m == pytest.approx((0.9, 0.11, 0.72))
    assert [cell.frames[name].fixed for name in ("table", "nest")] == [("space post of robot left",)] * 2
    copy.change(CELL, "frame: nest}", "frame: next}")
    assert "robots.left.spaces.post.frame: found unknown frame 'next'" in str(check_cell(copy.cell)[1][0])


def test_where_a_frame_is_counts_in_the_digest_where_only_the_file_says_it(tmp_path: Path) -> None:
    copy = with_frames(tmp_path, TABLE, NEST).add(CELL, BALL)
    digest = load_cell(copy.cell).digest
    copy.change(CELL, "{X: 900, Y: 0", "{X: 950, Y: 0")
    assert load_cell(copy.cell).digest == digest
    copy.change(CELL, BASE, f"{BASE}\n    frame: table")
    in_table = load_cell(copy.cell).digest
    copy.change(CELL, "{X: 950, Y: 0", "{X: 900, Y: 0")
    assert len({digest, in_table, load_cell(copy.cell).digest}) == 3
    copy.change(CELL, "X: 10, Y", "X: 11, Y")
    assert load_cell(copy.cell).digest not in (digest, in_table)


def test_points_place_a_frame_as_they_place_a_belt(tmp_path: Path) -> None:
    points = "[[900, 0, 700], [900, 400, 700], [500, 0, 700]"
    three = load_cell(with_frames(tmp_path / "3", f"table: {{points: {points}]}}").cell).frames["table"].pose
    four = load_cell(with_frames(tmp_path / "4", f"table: {{points: {points}, [0, 0, 9]]}}").cell).frames["table"].pose
    assert three == PoseSettings((0.9, 0.0, 0.7), four.quaternion_xyzw)
    assert four.position_m == (0.0, 0.0, 0.009)
    assert four.quaternion_xyzw == pytest.approx((0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)))


@pytest.mark.parametrize(
    ("frame", "at", "problem"),
    [
        ("table: {}", "table: §{}", "frames.table: found neither pose nor points, allowed exactly one of them"),
        (NEST, "parent: §table", "frames.nest.parent: found unknown frame 'table', allowed a frame of this file; there "
         "is no other"),
        (f"nest: {{parent: nest, {NEST[21:]}", "parent: §nest",
         "frames.nest.parent: found a cycle: nest in nest, allowed a frame that does not lie in this one, or none: "
         "world"),
        (f"{NEST}, table: {{parent: nest, {TABLE[8:]}", "{parent: §table",
         "frames.nest.parent: found a cycle: nest in table in nest, allowed a frame that does not lie in this one, or "
         "none: world"),
        ("table: {points: [[0, 0, 0], [100, 0, 0], [200, 0, 0]]}", "points: §[[",
         "frames.table.points: found the points lie in one line, allowed points apart from each other, one aside"),
        ("table: {points: [[0, 0, 0], [0.5, 0, 0], [0, 9, 0]]}", "points: §[[",
         "frames.table.points: found two points are less than 1 mm apart, allowed points apart from each other, one "
         "aside"),
        ("table: {points: [[0, 0, 0], [100, 0, 0]]}", "points: §[[",
         "frames.table.points: found 2 entries, allowed 3 or more"),
        (f"{TABLE}, nest: {{parent: table, points: [[0, 0, 0], [100, 0, 0], [0, 100, 0]]}}", "parent: §table",
         "frames.nest.parent: found a parent, allowed none: points are measured in world"),
        (TABLE.replace("table", "world"), "{§world:",
         "frames.world: found the name 'world', allowed another name: that frame is always there"),
        (NEST.replace("parent: table", "parent: world"), "parent: §world",
         "frames.nest.parent: found the frame 'world', allowed nothing at all: what names no frame is in world"),
        (TABLE.replace("900", ".nan"), "X: §.nan", "frames.table.pose.X: found nan, allowed a finite number"),
        (TABLE.replace(", C: 90", ""), "{§pose",
         "frames.table.pose.C: found nothing, allowed angle about Z, in units.angle"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_frame_is_told_at_its_place(frame: str, at: str, problem: str, tmp_path: Path) -> None:
    copy = with_frames(tmp_path, frame)
    bundle, problems = check_cell(copy.cell)
    assert bundle is None
    assert f"{copy.place(CELL, f'frames: {{{frame}'.replace(at.replace('§', ''), at, 1))}: {problem}" in map(
        copy.shown, problems
    )


@pytest.mark.parametrize(("key", "entry"), [
    ("things", "ball: {sphere: 5, pose: {X: 0, Y: 0, Z: 0, A: 0, B: 0, C: 0}, frame: nest}"),
    ("conveyors", BELT),
])  # fmt: skip
def test_a_frame_that_is_not_there_is_told_where_it_is_named(key: str, entry: str, tmp_path: Path) -> None:
    copy = with_frames(tmp_path, TABLE).add(CELL, f"{key}: {{{entry}}}")
    (problem,) = check_cell(copy.cell)[1]
    name = entry.partition(":")[0]
    assert f"{key}.{name}.frame: found unknown frame 'nest', allowed one of table, or none: world" in str(problem)
