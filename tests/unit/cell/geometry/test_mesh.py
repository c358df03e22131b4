"""Meshes against boxes and balls of the same form, whose signed distance is known in closed form."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import Box, GeometryError, Mesh, Sphere, pose_from
from tests.unit.ball_mesh import ball_file
from tests.unit.block_mesh import block

SIZE = (0.5, 0.3, 0.8)
EXACT_M, APART_M = 1e-12, 0.01
TURN = np.array([0.1, 0.2, 0.3, 0.9])
TURNED = pose_from(np.array([0.3, -0.2, 0.5]), TURN / np.linalg.norm(TURN))
MESHES = [(Mesh(*block(SIZE), pose), Box(np.array(SIZE), pose)) for pose in (np.eye(4), TURNED)]
HALF = st.sampled_from([-0.8, -0.4, -0.25, -0.15, -0.1, 0.0, 0.05, 0.15, 0.2, 0.25, 0.4])
NUMBER = HALF | st.floats(-1.0, 1.0)
PLACE = st.tuples(*[NUMBER] * 3).map(np.array)


def joined(*parts: tuple[np.ndarray, np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Several meshes as one."""
    starts = np.cumsum([0, *(len(corners) for corners, _ in parts)])
    triangles = [triangles + start for (_, triangles), start in zip(parts, starts, strict=False)]
    return np.concatenate([corners for corners, _ in parts]), np.concatenate(triangles)


def depth(mesh: Mesh, *places: tuple[float, float, float]) -> list[float]:
    """How far points are from a mesh, below 0 inside."""
    points = np.repeat(np.array(places)[:, None], 2, axis=1)
    return list(mesh.capsule_distance(points, np.zeros(len(places))).tolist())


@given(local=st.tuples(PLACE, PLACE), radius=st.sampled_from([0.0, 0.05]) | st.floats(0.0, 0.2), turned=st.booleans())
@settings(max_examples=60, deadline=None)
def test_a_mesh_in_the_form_of_a_box_has_the_signed_distance_of_the_box(
    local: tuple[np.ndarray, np.ndarray], radius: float, turned: bool
) -> None:
    """To rounding where the axis is outside; inside the depth is that of places on the axis."""
    mesh, box = MESHES[turned]
    ends = np.array(local) @ box.pose_world_box[:3, :3].T + box.pose_world_box[:3, 3]
    found, true = (float(solid.capsule_distance(ends, np.array(radius))) for solid in (mesh, box))
    if true > EXACT_M - radius:
        assert found == pytest.approx(true, abs=EXACT_M)
    else:
        assert true - EXACT_M <= found <= min(true + APART_M / 2.0, -radius) + EXACT_M
    for within in (0.0, 0.02):
        told = float(mesh.capsule_distance(ends, np.array(radius), within))
        assert told == pytest.approx(found, abs=EXACT_M) if found < within - 1e-5 else told >= within - 1e-5


@given(place=PLACE, turned=st.booleans())
@settings(max_examples=100, deadline=None)
def test_a_point_has_the_signed_distance_of_the_box(place: np.ndarray, turned: bool) -> None:
    """Round ones are above edges, corners and diagonals of its faces."""
    mesh, box = MESHES[turned]
    ends = np.repeat((box.pose_world_box[:3, :3] @ place + box.pose_world_box[:3, 3])[None], 2, axis=0)
    found, true = (float(solid.capsule_distance(ends, np.array(0.0))) for solid in (mesh, box))
    assert abs(found) == pytest.approx(abs(true), abs=EXACT_M)
    assert abs(true) < 1e-9 or (found < 0.0) == (true < 0.0)


def test_a_ball_of_ten_thousand_triangles_has_the_signed_distance_of_the_ball(tmp_path: Path) -> None:
    mesh, ball = Mesh.of_file(ball_file(tmp_path), 0.001, np.eye(4)), Sphere(np.zeros(3), 0.1)
    assert mesh.is_closed
    rng = np.random.default_rng(3)
    middles, ways = rng.uniform(-0.12, 0.12, (60, 1, 3)), rng.uniform(-0.05, 0.05, (60, 1, 3))
    ends = np.concatenate([middles - ways, middles + ways], axis=1)
    found, true = (solid.capsule_distance(ends, np.full(60, 0.01)) for solid in (mesh, ball))
    sagitta = 0.1 * (1.0 - np.cos(np.pi / 71))
    assert (found < true + sagitta + APART_M / 2.0).all()
    assert (found > true - 1e-9).all()
    assert (true < -0.02).sum() > 20


def test_a_thin_wall_is_not_between_two_places_on_an_axis() -> None:
    wall = Mesh(*block((1.0, 1.0, 0.001)), TURNED)
    out, middle = TURNED[:3, 2], TURNED[:3, 3]
    for shift in np.linspace(0.0, 0.01, 7):
        across = np.array([middle + (0.505 + shift) * out, middle - (0.495 - shift) * out])
        assert -0.0006 - 0.02 <= float(wall.capsule_distance(across, np.array(0.02))) <= -0.02
    beside = np.array([middle + 0.0305 * out, middle + 0.5 * out])
    assert float(wall.capsule_distance(beside, np.array(0.02))) == pytest.approx(0.01, abs=EXACT_M)


def test_solids_that_overlap_are_inside_and_a_cavity_is_not() -> None:
    both = Mesh(*joined(block((1.0, 1.0, 1.0)), block((1.0, 1.0, 1.0), (0.5, 0.0, 0.0))), np.eye(4))
    assert depth(both, (0.25, 0.0, 0.0), (-0.25, 0.0, 0.0), (1.2, 0.0, 0.0)) == pytest.approx([-0.25, -0.25, 0.2])
    corners, triangles = block((0.4, 0.4, 0.4))
    hollow = Mesh(*joined(block((1.0, 1.0, 1.0)), (corners, triangles[:, ::-1])), np.eye(4))
    assert depth(hollow, (0.0, 0.0, 0.0), (0.3, 0.0, 0.0)) == pytest.approx([0.2, -0.1])


def test_a_mesh_that_is_inside_out_is_the_same_solid() -> None:
    corners, triangles = block(SIZE)
    assert depth(Mesh(corners, triangles[:, ::-1], np.eye(4)), (0.2, 0.0, 0.0)) == pytest.approx([-0.05])


def test_corners_of_each_triangle_and_triangles_that_are_lines_keep_a_mesh_closed() -> None:
    """As STL files have them."""
    corners, triangles = block(SIZE)
    lines = np.array([[0, 1, 1], [2, 2, 2]])
    mesh = Mesh(corners[triangles].reshape(-1, 3), np.arange(36).reshape(-1, 3), np.eye(4))
    flat = Mesh(corners, np.concatenate([triangles, lines]), np.eye(4))
    for each in (mesh, flat):
        assert each.is_closed
        assert depth(each, (0.2, 0.0, 0.0), (0.3, 0.0, 0.0)) == pytest.approx([-0.05, 0.05])


@pytest.mark.parametrize("change", ["a triangle less", "a triangle turned over"])
def test_a_mesh_that_does_not_close_is_a_surface(change: str) -> None:
    corners, triangles = block(SIZE)
    triangles = triangles[1:] if change == "a triangle less" else np.concatenate([triangles[:1, ::-1], triangles[1:]])
    mesh = Mesh(corners, triangles, np.eye(4))
    assert not mesh.is_closed
    assert depth(mesh, (0.2, 0.0, 0.0)) == pytest.approx([0.05])
    ends = np.array([[[0.2, 0.0, 0.0]] * 2, [[0.2, 0.0, 0.0], [0.5, 0.0, 0.0]]])
    np.testing.assert_allclose(mesh.capsule_distance(ends, np.array(0.08)), [-0.03, -0.08], atol=EXACT_M)


def test_a_mesh_without_a_triangle_that_is_wider_than_a_line_is_refused() -> None:
    with pytest.raises(GeometryError, match="wider than a line"):
        Mesh(np.eye(3), np.array([[0, 1, 1]]), np.eye(4))
