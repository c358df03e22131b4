"""Round, endless and meshed solids against fine sampling, another library, and a box of the same form."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import (
    Box,
    Cylinder,
    GeometryError,
    HalfSpace,
    Hull,
    Mesh,
    Solid,
    Sphere,
    point_box_distance,
    pose_from,
)
from tests.unit.block_mesh import block, obj_file
from tests.unit.cell.geometry.convex_height import height

RNG = np.random.default_rng(11)
TURNED = pose_from(np.array([0.3, -0.2, 0.5]), np.array([0.1, 0.2, 0.3, 0.9]) / np.linalg.norm([0.1, 0.2, 0.3, 0.9]))
SHARES = np.linspace(0.0, 1.0, 2001)
SIZE = np.array([1.2, 0.8, 2.0])
HULLS = [Hull(RNG.uniform(-0.8, 0.8, (12, 3)), pose) for pose in (TURNED, np.eye(4))]
ROUND = st.sampled_from([-1.0, -0.6, -0.4, 0.0, 0.4, 0.6, 1.0])
NUMBER = ROUND | st.floats(-2.0, 2.0)
CAPSULE = st.tuples(*[NUMBER] * 6).map(lambda numbers: np.array(numbers).reshape(2, 3))


def along(ends: np.ndarray) -> np.ndarray:
    return ends[0] + SHARES[:, None] * (ends[1] - ends[0])


@given(ends=CAPSULE, upright=st.booleans())
@settings(max_examples=300, deadline=None)
def test_the_distance_from_a_cylinder_is_the_least_along_the_axis(ends: np.ndarray, upright: bool) -> None:
    pose = np.eye(4) if upright else TURNED
    cylinder = Cylinder(0.4, 1.2, pose)
    local = (along(ends) - pose[:3, 3]) @ pose[:3, :3]
    beside = np.maximum(np.hypot(local[:, 0], local[:, 1]) - 0.4, 0.0)
    sampled = np.hypot(beside, np.maximum(np.abs(local[:, 2]) - 0.6, 0.0)).min()
    exact = max(float(cylinder.capsule_distance(ends, np.array(0.0))), 0.0)
    step = np.linalg.norm(ends[1] - ends[0]) / (len(SHARES) - 1)
    assert sampled - step <= exact <= sampled + 1e-12


@given(ends=CAPSULE, upright=st.booleans(), which=st.sampled_from(["box", "column", "disc", "hull"]))
@settings(max_examples=500, deadline=None)
def test_the_depth_in_a_convex_solid_is_the_greatest_along_the_axis(
    ends: np.ndarray, upright: bool, which: str
) -> None:
    pose, places = np.eye(4) if upright else TURNED, along(ends)
    local = (places - pose[:3, 3]) @ pose[:3, :3]
    solid: Box | Cylinder | Hull
    if which == "box":
        solid, heights = Box(SIZE, pose), (np.abs(local) - SIZE / 2.0).max(axis=-1)
    elif which == "hull":
        solid = HULLS[upright]
        heights = height(solid.convex, places)
    else:
        length = 1.2 if which == "column" else 0.4
        solid = Cylinder(0.4, length, pose)
        heights = np.maximum(np.hypot(local[:, 0], local[:, 1]) - 0.4, np.abs(local[:, 2]) - length / 2.0)
    exact, sampled = float(solid.capsule_distance(ends, np.array(0.0))), float(heights.min())
    step = np.linalg.norm(ends[1] - ends[0]) / (len(SHARES) - 1)
    if sampled < 0.0:
        assert sampled - step <= exact <= sampled + 1e-12
    else:
        assert exact >= -step
    assert float(solid.capsule_distance(ends, np.array(0.05), sampled)) == pytest.approx(exact - 0.05, abs=1e-15)


@given(ends=CAPSULE)
@settings(max_examples=200, deadline=None)
def test_the_distance_from_a_ball_is_the_least_along_the_axis(ends: np.ndarray) -> None:
    ball = Sphere(np.array([0.4, -0.6, 0.0]), 0.4)
    sampled = np.linalg.norm(along(ends) - ball.centre, axis=-1).min() - 0.4
    exact = float(ball.capsule_distance(ends, np.array(0.0)))
    assert sampled - np.linalg.norm(ends[1] - ends[0]) / (len(SHARES) - 1) <= exact <= sampled + 1e-12


def test_a_half_space_is_all_below_its_plane() -> None:
    floor = HalfSpace(np.eye(4))
    ends = np.array([[[0, 0, 1.0], [5, 0, 0.3]], [[0, 0, 1.0], [0, 0, -0.2]], [[9, 9, 0.1], [9, 9, 0.1]]])
    np.testing.assert_allclose(floor.capsule_distance(ends, np.array(0.1)), [0.2, -0.3, 0.0], atol=1e-15)


@given(ends=CAPSULE)
@settings(max_examples=50, deadline=None)
def test_a_solid_that_is_moved_is_the_one_that_was_made_there(ends: np.ndarray) -> None:
    away = pose_from(np.array([5.0, 0.0, 1.0]), np.array([0.0, 0.6, 0.0, 0.8]))
    for made in (
        lambda pose: Box(np.array([0.5, 0.3, 0.8]), pose),
        lambda pose: Sphere(pose[:3, 3], 0.4),
        lambda pose: Cylinder(0.4, 1.2, pose),
        lambda pose: Mesh(*block((0.5, 0.3, 0.8)), pose),
        HalfSpace,
    ):
        moved, there = made(away).moved_to(TURNED), made(TURNED)
        assert moved.capsule_distance(ends, np.array(0.1)) == there.capsule_distance(ends, np.array(0.1))
        again = pickle.loads(pickle.dumps(made(TURNED)))
        if (box := there.bounds()) is not None:
            for other in (moved.bounds(), again.bounds()):
                np.testing.assert_array_equal(other.pose_world_box, box.pose_world_box)
                np.testing.assert_array_equal(other.size, box.size)


@pytest.mark.parametrize(
    "solid",
    [
        Cylinder(0.4, 1.2, TURNED),
        Sphere(TURNED[:3, 3], 0.5),
        Box(np.ones(3), TURNED),
        Hull(np.random.default_rng(12).uniform(-0.6, 0.6, (12, 3)), TURNED),
    ],
)
def test_the_box_about_a_solid_holds_it(solid: Cylinder | Sphere | Box | Hull) -> None:
    box = solid.bounds()
    points = np.repeat(RNG.uniform(-2.0, 2.0, (2000, 1, 3)), 2, axis=1)
    inside = solid.capsule_distance(points, np.array(1e-9)) <= 0.0
    assert inside.any()
    assert (point_box_distance(points[inside, 0], box) <= 1e-6).all()


def test_files_of_triangles_are_read_in_their_unit(tmp_path: Path) -> None:
    mesh = Mesh.of_file(obj_file(tmp_path / "block.obj", *block((500, 300, 800))), 0.001, np.eye(4))
    above = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 2.0]])
    for each in (mesh, pickle.loads(pickle.dumps(mesh))):  # as it goes to the process that plans
        assert float(each.capsule_distance(above, np.array(0.1))) == pytest.approx(0.5, abs=1e-6)


@pytest.mark.parametrize("text", ["", "no mesh", "v 0 0 0\n"])
def test_a_file_without_triangles_is_refused_by_name(tmp_path: Path, text: str) -> None:
    file = tmp_path / "empty.obj"
    file.write_text(text)
    with pytest.raises(GeometryError, match="mesh"):
        Mesh.of_file(file, 1.0, np.eye(4))


@pytest.mark.parametrize(
    "solid",
    [
        Cylinder(0.4, 1.2, TURNED),
        Sphere(TURNED[:3, 3], 0.5),
        Box(np.ones(3), TURNED),
        HalfSpace(TURNED),
        Mesh(*block((1.0, 1.0, 1.0)), TURNED),
    ],
)
def test_an_axis_that_is_deeper_in_a_solid_is_told_so(solid: Solid) -> None:
    out = TURNED[:3, 2] if isinstance(solid, HalfSpace) else TURNED[:3, 0]
    places = [np.stack([TURNED[:3, 3] + share * out] * 2) for share in (0.1, 0.2, 0.3)]
    depths = [float(solid.capsule_distance(place, np.array(0.1))) for place in places]
    assert depths == sorted(depths)
    assert len({round(depth, 6) for depth in depths}) == len(depths)
