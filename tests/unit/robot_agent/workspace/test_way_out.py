"""Who stands in something may leave it and go no deeper: blocks against the depth at every one of their samples."""

from pathlib import Path

import numpy as np
import pytest

from cell.geometry import Box, Convex, Cylinder, HalfSpace, Hull, Mesh, Room, Solid, Sphere, pose_from
from robot_agent.workspace.swept_body import Sweep
from robot_agent.workspace.things import Barrier, blocked
from tests.unit.ball_mesh import ball_file
from tests.unit.block_mesh import block

TURN = np.array([0.1, 0.2, 0.3, 0.9])
POSE = pose_from(np.array([0.3, -0.2, 0.5]), TURN / np.linalg.norm(TURN))
RADIUS_M, MARGIN_M, EXACT_M = 0.04, 0.005, 1e-9
SAMPLES = 12
ROOMS = ((0.5, 0.3, 0.4), (0.3, 0.5, 0.4))
SOLIDS = ["box", "ball", "column", "hull", "floor", "block of triangles", "ball of triangles", "outside of rooms"]


@pytest.fixture(scope="module")
def solids(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Solid]:
    file: Path = ball_file(tmp_path_factory.mktemp("ball"))
    return {
        "box": Box(np.array([0.6, 0.5, 0.8]), POSE),
        "ball": Sphere(POSE[:3, 3], 0.4),
        "column": Cylinder(0.3, 0.8, POSE),
        "hull": Hull(np.random.default_rng(2).uniform(-0.4, 0.4, (12, 3)), POSE),
        "floor": HalfSpace(POSE),
        "block of triangles": Mesh(*block((0.6, 0.5, 0.8)), POSE),
        "ball of triangles": Mesh.of_file(file, 0.004, POSE),
        "outside of rooms": Room(tuple(Convex.of_box(Box(np.array(size), POSE)) for size in ROOMS), (0.0, 0.01)),
    }


def swept(start: np.ndarray, way: np.ndarray, turn: np.ndarray) -> Sweep:
    """A capsule that goes a way, its second end another one, faster and faster from rest."""
    shares = (np.arange(SAMPLES) / (SAMPLES - 1.0))[:, None] ** 3
    points = np.stack([start[0] + shares * way, start[1] + shares * (way + turn)], axis=1)[:, None]
    chords = np.linalg.norm(np.diff(points, axis=0), axis=-1).max(axis=-1)
    return Sweep(points, np.array([RADIUS_M]), chords, np.zeros(SAMPLES - 1), points[:, 0, 1])


def found(solid: Solid, path: Sweep) -> tuple[np.ndarray, bool]:
    """How near the capsule is at each sample, and whether it is let go there."""
    barrier = Barrier(solid, MARGIN_M, np.array([0]))
    return solid.capsule_distance(path.points[:, 0], path.radii) - MARGIN_M, blocked(
        barrier, path, np.array([True])
    ) is None


@pytest.mark.parametrize("name", SOLIDS)
def test_a_way_is_free_exactly_where_no_sample_is_deeper_than_the_first(name: str, solids: dict[str, Solid]) -> None:
    rng, outcomes = np.random.default_rng(len(name)), []
    while len(outcomes) < 60:
        middle, along = POSE[:3, 3] + rng.uniform(-0.45, 0.45, 3), rng.normal(size=3)
        along *= rng.choice([0.0, 0.02, 0.1, 0.3]) / np.linalg.norm(along)
        way, turn = rng.normal(size=(2, 3)) * rng.choice([[0.01], [0.03]]) * np.array([[1.0], [rng.integers(2)]])
        heights, free = found(solids[name], swept(np.array([middle - along, middle + along]), way, turn))
        if heights[0] < -EXACT_M:
            assert free == (heights.min() >= heights[0] - EXACT_M)
            outcomes.append(free)
    assert 10 <= sum(outcomes) <= 50


@pytest.mark.parametrize("name", SOLIDS)
def test_from_every_place_inside_a_way_leads_out(name: str, solids: dict[str, Solid]) -> None:
    rng, directions, places = np.random.default_rng(5), np.random.default_rng(6).normal(size=(40, 3)), 0
    directions /= np.linalg.norm(directions, axis=-1)[:, None]
    while places < 5:
        middle = POSE[:3, 3] + rng.uniform(-0.3, 0.3, 3)
        start = np.array([middle, middle + rng.uniform(-0.02, 0.02, 3)])
        ways = [found(solids[name], swept(start, 0.02 * way, np.zeros(3))) for way in directions]
        if ways[0][0][0] < -EXACT_M:
            assert any(free and heights[-1] > heights[0] for heights, free in ways)
            places += 1
