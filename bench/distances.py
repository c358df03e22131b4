"""Distances between capsules, beside python-fcl and coal called from Python."""

from collections.abc import Callable, Iterator
from functools import partial

import coal
import fcl
import numpy as np

from bench.timing import Row, median_s
from cell.geometry import capsule_distance, nearest_capsules, transform_points
from cell.geometry.arrays import Array
from cell.view.bodies import NOTHING, Capsules, RobotBody, smallest_gap
from robot_agent.kinematics import Model
from robot_agent.trajectory import Motion
from robot_agent.workspace import Things, sweep

PAIRS = (49, 294, 1372)
"""Two, four and eight arms of seven capsules, each with each other."""
ARMS, CAPSULES, SAMPLES = 8, 8, 500
WITHIN_M = 0.03
BLOCK = 90
"""Samples of a jog's block with its ramp."""


def distances() -> Iterator[Row]:
    """Some pairs at once, and all of a cell of eight arms along whole trajectories."""
    rng = np.random.default_rng(1)
    for count in PAIRS:
        one, other, radii = *rng.uniform(-1, 1, (2, count, 2, 3)), rng.uniform(0.05, 0.2, (2, count))
        own = median_s(partial(capsule_distance, one, radii[0], other, radii[1]), 50)
        peer_s = median_s(_by_fcl(one, other, radii), 5)
        what = f"{count} distances between capsules"
        yield Row(what, own, own / peer_s, "of python-fcl, pair by pair")
        yield Row(what, own, own / median_s(_by_coal(one, other, radii), 5), "of coal, pair by pair")
    first, second = np.triu_indices(ARMS, 1)
    bodies, radii = rng.uniform(-1, 1, (SAMPLES, ARMS, CAPSULES, 2, 3)), rng.uniform(0.05, 0.2, (ARMS, CAPSULES))

    def whole() -> Array:
        return capsule_distance(
            bodies[:, first, :, None], radii[first, :, None], bodies[:, second, None], radii[second, None]
        )

    own, pairs = median_s(whole, 3), len(first) * CAPSULES**2 * SAMPLES
    what = f"{pairs} of them: {ARMS} arms, {CAPSULES} capsules, {SAMPLES} samples"
    yield Row(what, own, own / (peer_s * pairs / PAIRS[-1]), "of python-fcl, pair by pair")


def trajectories(model: Model) -> Iterator[Row]:
    """Whether arms in a ring that wave come nearer than 30 mm to each other, and where they are nearest.

    And the gap that the page shows: that of all capsules at one moment, of which balls leave out the far ones.
    """
    for what, radius_m, aim_s in (("clear", 4.0, 5e-4), ("near", 2.0, 5e-3), ("entangled", 1.0, 5e-3)):
        bodies = _ring(model, radius_m)
        own = median_s(partial(nearest_capsules, bodies, [model.capsule_radii] * ARMS, WITHIN_M), 50)
        yield Row(f"the nearest of {ARMS} arms, {SAMPLES} samples, {what}", own, own / aim_s, f"of {1e3 * aim_s:g} ms")
    now = [
        RobotBody(f"arm {number}", Capsules(np.ascontiguousarray(points[0]), model.capsule_radii), NOTHING, None, False)
        for number, points in enumerate(_ring(model, 2.0))
    ]
    pairs, own = ARMS * (ARMS - 1) // 2 * len(model.capsule_radii) ** 2, median_s(partial(smallest_gap, now), 200)
    yield Row(f"the smallest gap of {pairs} pairs, most left out by balls", own, own / 2.5e-5, "of 25 us")


def itself(model: Model, motion: Motion) -> list[Row]:
    """What it takes to keep a robot out of itself, in ten seconds of a planned motion and in a block of a jog."""
    things, world = Things(model), np.eye(4)
    body, block = (sweep(model, world, motion.q(taus)) for taus in (motion.grid, motion.grid[:BLOCK]))

    def points_at(taus: Array) -> Array:
        return transform_points(world, model.capsules(motion.q(taus)))

    whole_s = median_s(lambda: things.first_touch(body, motion.grid, points_at)) * 10.0 / motion.duration_s
    block_s = median_s(lambda: things.in_the_way(block), 100)
    return [
        Row("a robot against itself, 10 s of motion", whole_s, whole_s / 0.03, "of 30 ms"),
        Row(f"a robot against itself, a block of {BLOCK} samples", block_s, block_s / 0.0003, "of 0.3 ms"),
    ]


def _ring(model: Model, radius_m: float) -> list[Array]:
    """Capsules `(m, c, 2, 3)` [m] of arms around a place, which all of them face."""
    rng, times = np.random.default_rng(3), 0.004 * np.arange(SAMPLES)[:, None]
    bodies = []
    for around in 2.0 * np.pi * np.arange(ARMS) / ARMS:
        swing, rate, phase = rng.uniform([[0.3], [0.5], [0.0]], [[1.0], [2.0], [6.0]], (3, model.n))
        q = model.home + swing * np.radians([60, 25, 25, 60, 40, 90]) * np.sin(rate * times + phase)
        x, y, base = np.cos(around), np.sin(around), np.eye(4)
        base[:2] = [[-x, y, 0.0, radius_m * x], [-y, -x, 0.0, radius_m * y]]
        bodies.append(transform_points(base, model.capsules(q)))
    return bodies


def _by_fcl(one: Array, other: Array, radii: Array) -> Callable[[], list[float]]:
    """What asks for every distance; the objects are made before."""
    pairs = [(_capsule(a, r), _capsule(b, s)) for a, b, r, s in zip(one, other, *radii, strict=True)]

    def ask() -> list[float]:
        return [fcl.distance(a, b, fcl.DistanceRequest(), fcl.DistanceResult()) for a, b in pairs]

    return ask


def _by_coal(one: Array, other: Array, radii: Array) -> Callable[[], list[float]]:
    """Likewise."""

    def placed(ends: Array, radius: float) -> tuple[object, object]:
        length, turn, middle = _lying(ends)
        return coal.Capsule(float(radius), length), coal.Transform3s(turn, middle)

    pairs = [(*placed(a, r), *placed(b, s)) for a, b, r, s in zip(one, other, *radii, strict=True)]

    def ask() -> list[float]:
        return [coal.distance(*pair, coal.DistanceRequest(), coal.DistanceResult()) for pair in pairs]

    return ask


def _capsule(ends: Array, radius: float) -> object:
    length, turn, middle = _lying(ends)
    return fcl.CollisionObject(fcl.Capsule(float(radius), length), fcl.Transform(turn, middle))


def _lying(ends: Array) -> tuple[float, Array, Array]:
    """Length, rotation and middle of a capsule, whose own axis is Z."""
    way = ends[1] - ends[0]
    length = float(np.linalg.norm(way))
    z = way / length
    x = np.cross(np.eye(3)[int(np.argmin(abs(z)))], z)
    x /= np.linalg.norm(x)
    return length, np.stack([x, np.cross(z, x), z], axis=-1), ends.mean(axis=0)
