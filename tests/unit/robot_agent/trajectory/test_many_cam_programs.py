"""Programs as CAM systems write them, by the hundred: within the tolerance at every cycle, by the lines alone."""

import numpy as np
import pytest

from robot_agent.paths.caps import Tolerance
from robot_agent.trajectory import Motion, PlanError
from tests.unit.random_moves import LIMITS, MODEL
from tests.unit.robot_agent.paths.cam_lines import KINDS, CamLines, cam_lines
from tests.unit.robot_agent.trajectory.cam_motions import at_the_robot, motion_of

CYCLE_S = 0.004
IN_TEST, IN_ALL, AT_ONCE = 2, 500, 31
CORNER_RAD = np.radians(32.0)
"""A turn of more is surely a corner: the documented limit is 30 degrees."""


def beside_lines(lines: CamLines, motion: Motion, tolerance: Tolerance) -> float:
    """How far the TCP is from the lines at a cycle at most, as a share of the tolerance.

    The place is compared with each line, the orientation with that of an even turn from vertex to vertex; one line has
    to be within both.
    """
    t = np.append(np.arange(0.0, motion.duration_s, CYCLE_S), motion.duration_s)
    poses = motion.pose(t)
    begin, way = lines.places[:-1], np.diff(lines.places, axis=0)
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    turns = (lines.rotations[:-1].inv() * lines.rotations[1:]).as_rotvec()
    first = lines.rotations[:-1].as_matrix()
    worst = 0.0
    for pose in poses:
        share = np.clip(((pose[:3, 3] - begin) * way).sum(axis=1) / square, 0.0, 1.0)
        away = np.linalg.norm(pose[:3, 3] - begin - share[:, None] * way, axis=1) / tolerance.distance_m
        near = np.flatnonzero(away < max(1.01, float(away.min()) + 1e-9))
        best = np.inf
        for k in near:
            # where the tool turns it may be turned as anywhere within the tolerance of the way
            reach = tolerance.distance_m / max(np.sqrt(square[k]), 1e-12)
            shares = np.clip(share[k] + reach * np.linspace(-1.0, 1.0, 21), 0.0, 1.0)
            places = begin[k] + shares[:, None] * way[k]
            far = np.linalg.norm(pose[:3, 3] - places, axis=1) / tolerance.distance_m
            meant = first[k] @ _rotations(shares[:, None] * turns[k])
            turned = _angles(meant, pose[:3, :3]) / tolerance.angle_rad
            best = min(best, float(np.maximum(far, turned).min()))
        worst = max(worst, best)
    return worst


def _rotations(vectors: np.ndarray) -> np.ndarray:
    """Rodrigues, `(k, 3)` [rad] to `(k, 3, 3)`."""
    angle = np.linalg.norm(vectors, axis=1)[:, None, None]
    x, y, z = (vectors / np.maximum(angle[:, :, 0], 1e-30)).T
    zero = 0.0 * x
    k = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1.0 - np.cos(angle)) * (k @ k))


def _angles(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    return np.asarray(2.0 * np.arcsin(np.minimum(np.linalg.norm(first - second, axis=(1, 2)) / np.sqrt(8.0), 1.0)))


def sharp_vertices(lines: CamLines, tolerance: Tolerance) -> list[np.ndarray]:
    """Places of vertices between two lines much longer than the tolerance that turn far."""
    way = np.diff(lines.places, axis=0)
    long = np.linalg.norm(way, axis=1) > 4.5 * tolerance.distance_m
    found = []
    for k in np.flatnonzero(long[:-1] & long[1:]):
        cosine = way[k] @ way[k + 1] / np.linalg.norm(way[k]) / np.linalg.norm(way[k + 1])
        if np.arccos(np.clip(cosine, -1.0, 1.0)) > CORNER_RAD:
            found.append(lines.places[k + 1])
    return found


def judge(number: int) -> bool:
    """Plan a program and judge the motion; False where the planner refuses it."""
    rng = np.random.default_rng([number, 18])
    lines = at_the_robot(cam_lines(KINDS[number % len(KINDS)], rng))
    tolerance = Tolerance(float(rng.choice([2e-5, 5e-5, 2e-4, 1e-3])), np.radians(0.5))
    feed = float(rng.choice([0.02, 0.1, 0.3]))
    try:
        motion = motion_of(lines.lines(tolerance, feed))
    except PlanError:
        return False
    assert beside_lines(lines, motion, tolerance) <= 1.002, number
    inside = np.abs(motion.pieces.inside(9)).max(axis=(1, 2))
    used = inside / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert used.max() < 1.001, (number, used.max(axis=1))
    t = np.arange(0.0, motion.duration_s, 1e-3)
    places = MODEL.forward(motion.q(t))[:, :3, 3]
    assert (np.linalg.norm(np.diff(places, axis=0), axis=1) / 1e-3).max(initial=0.0) < 1.01 * feed, number
    rests = motion.pose(motion.rests)[:, :3, 3]
    for corner in sharp_vertices(lines, tolerance):
        assert np.linalg.norm(rests - corner, axis=1).min() < 2e-6, f"{number}: no rest in the corner {corner}"
    return True


def test_cam_programs_are_within_their_tolerance_at_every_cycle() -> None:
    assert sum(judge(number) for number in range(0, IN_TEST * 7, 7)) == IN_TEST


@pytest.mark.soak
@pytest.mark.parametrize("first", range(0, IN_ALL, AT_ONCE))
def test_soak_cam_programs_are_within_their_tolerance_at_every_cycle(first: int) -> None:
    numbers = range(first, min(first + AT_ONCE, IN_ALL))
    assert sum(judge(number) for number in numbers) == len(numbers)
