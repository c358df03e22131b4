"""Shapes of the room, made from messages alone."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    MeshShape,
    PoseSettings,
    Shape,
    SpaceKind,
    SpaceSettings,
    SphereShape,
)
from cell.geometry import segment_distance
from cell.messages import Mode, PlannedWay, Sections, ZoneGeometry, ZoneState
from cell.view.bodies import (
    NOTHING,
    Capsules,
    RobotBody,
    ahead,
    nearest_points,
    robot_body,
    smallest_gap,
    spaces,
    things,
    triangles,
    zones,
)
from tests.unit.cell.view.room import CELL, held_by, manager, presence, robot, seen

coordinate = st.one_of(st.sampled_from([0.0, 1.0, -1.0]), st.floats(-2.0, 2.0, width=32))
segments = st.lists(coordinate, min_size=6, max_size=6).map(lambda each: np.array(each).reshape(2, 3))


def test_a_robot_that_stands_is_its_capsules() -> None:
    newest = seen(presence("left", 1.0), robot())
    body, before = robot_body("left", newest), ahead("left", newest)
    assert body is not None
    assert body.now.points.tolist() == [[[1.0, 0.0, 0.0], [1.0, 0.0, 1.0]]]
    assert len(body.rest) == len(before.reserved) == len(before.way) == 0
    assert not body.alarmed


def test_a_robot_that_moves_is_where_it_comes_to_rest_too() -> None:
    newest = seen(presence("left", 1.0, poses=3), robot())
    body = robot_body("left", newest)
    assert body is not None
    assert body.rest.points[0, 0].tolist() == pytest.approx([1.2, 0.0, 0.0])
    assert ahead("left", newest).way[:, 0].tolist() == pytest.approx([1.0, 1.1, 1.2])


def test_a_robot_that_does_not_know_where_it_is_is_somewhere_in_its_reach() -> None:
    body = robot_body("left", seen(presence("left", 1.0, known=False), robot()))
    assert body is not None
    assert body.reach == ((1.0, 0.0, 0.0), 2.0)
    assert len(body.now) == 0


def test_a_robot_that_fell_silent_is_where_it_was_last_and_alarmed() -> None:
    newest = seen(presence("left", 1.0), robot())
    newest.look([], 100.0)
    body = robot_body("left", newest)
    assert body is not None
    assert len(body.now) == 1
    assert body.alarmed


@pytest.mark.parametrize("mode", [Mode.FAULT, Mode.ESTOP])
def test_a_robot_in_trouble_looks_like_it(mode: Mode) -> None:
    body = robot_body("left", seen(presence("left", 1.0), robot(mode=mode)))
    assert body is not None
    assert body.alarmed


def test_what_is_planned_goes_on_from_where_the_robot_comes_to_rest() -> None:
    points = np.zeros((4, 1, 2, 3), np.float32)
    points[:, 0, 1, 0] = [5.0, 6.0, 7.0, 8.0]
    pieces = Sections(np.arange(4, dtype=np.uint64), points, np.full((4, 1), 0.1, np.float32))
    newest = seen(presence("left", 1.0), robot(), PlannedWay("left", "b", 1, 1, False, pieces))
    assert ahead("left", newest).way[:, 0].tolist() == [5.0, 6.0, 7.0, 8.0]


def test_the_smallest_gap_is_between_surfaces() -> None:
    newest = seen(presence("left", 0.0), presence("right", 1.0), robot("left"), robot("right"))
    gap = smallest_gap([body for each in ("left", "right") if (body := robot_body(each, newest)) is not None])
    assert gap is not None
    assert gap.robots == ("left", "right")
    assert gap.distance_m == pytest.approx(0.8)
    assert np.linalg.norm(gap.points[1] - gap.points[0]) == pytest.approx(0.8)


@given(st.lists(st.lists(segments, min_size=0, max_size=3), min_size=2, max_size=5), st.floats(0.0, 0.5))
@settings(max_examples=60, deadline=None)
def test_the_smallest_gap_is_the_least_of_all_pairs(robots: list[list[np.ndarray]], radius: float) -> None:
    bodies = [
        RobotBody(str(i), Capsules(np.array(each).reshape(-1, 2, 3), np.full(len(each), radius)), NOTHING, None, False)
        for i, each in enumerate(robots)
    ]
    pairs = [smallest_gap([one, other]) for one, other in combinations(bodies, 2)]
    least = min((gap.distance_m for gap in pairs if gap is not None), default=None)
    gap = smallest_gap(bodies)
    assert (None if gap is None else gap.distance_m) == least


def test_one_robot_alone_has_no_gap() -> None:
    body = robot_body("left", seen(presence("left", 0.0), robot()))
    assert body is not None
    assert smallest_gap([body]) is None


@given(segments, segments)
def test_nearest_points_are_as_far_apart_as_their_segments(first: np.ndarray, second: np.ndarray) -> None:
    one, other = nearest_points(first, second)
    assert np.linalg.norm(other - one) == pytest.approx(float(segment_distance(first, second)), abs=1e-6)


def test_a_zone_shows_its_state_holder_and_queue() -> None:
    geometry = ZoneGeometry("handover", 1, (0.9, 2.6, 2.6), (0.0, 0.0, 1.4), (0.0, 0.0, 0.0, 1.0), ("left", "right"))
    (zone,) = zones(seen(geometry, manager(handover=held_by("right"))))
    assert zone.state is ZoneState.OCCUPIED
    assert zone.label == "handover: occupied, right"
    assert zone.solid.shape == BoxShape((0.9, 2.6, 2.6))


def test_without_a_manager_nobody_knows_that_a_zone_is_free() -> None:
    geometry = ZoneGeometry("ball", 1, (0.5,), (0.0, 0.0, 1.4), (0.0, 0.0, 0.0, 1.0), ("left",), shape="sphere")
    (zone,) = zones(seen(geometry))
    assert zone.state is ZoneState.ORPHANED
    assert zone.solid.shape == SphereShape(0.5)


TETRAHEDRON = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("shape", "reach"),
    [
        (BoxShape((2.0, 4.0, 6.0)), (1.0, 2.0, 3.0)),
        (SphereShape(2.0), (2.0, 2.0, 2.0)),
        (CylinderShape(1.0, 4.0), (1.0, 1.0, 2.0)),
        (HullShape(TETRAHEDRON), (1.0, 1.0, 1.0)),
    ],
)
def test_each_shape_becomes_triangles_of_its_size(shape: Shape, reach: tuple[float, float, float]) -> None:
    pytest.importorskip("trimesh")
    found = triangles(shape)
    assert found is not None
    corners, faces = found
    assert corners.max(axis=0).tolist() == pytest.approx(reach, rel=0.01)
    assert faces.max() < len(corners)


def test_a_half_space_is_a_plate_and_a_file_that_is_not_there_is_left_out(tmp_path: Path) -> None:
    pytest.importorskip("trimesh")
    assert triangles(HalfSpaceShape()) is not None
    assert triangles(MeshShape(tmp_path / "none.stl", 0.001)) is None


def test_a_cell_without_things_has_none() -> None:
    assert things(CELL, seen()) == []


def test_the_spaces_of_each_robot_are_named_for_both() -> None:
    pose = PoseSettings((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
    space = SpaceSettings("fence", SpaceKind.SAFE, SphereShape(1.0), pose, 0.0)
    cell = replace(CELL, robots=CELL.robots | {"left": replace(CELL.robots["left"], spaces=(space,))})
    ((solid, kind),) = spaces(cell)
    assert (solid.name, kind) == ("left/fence", SpaceKind.SAFE)
    assert solid.pose[:3, 3].tolist() == [1.0, 2.0, 3.0]
