"""What it takes to look at things and spaces: along a planned motion, in a block at run time, at meshes beside fcl."""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import fcl
import numpy as np

from bench.timing import Row, median_s
from cell.config.settings import BoxShape, MeshShape, PoseSettings, SpaceKind, SpaceSettings, ThingSettings
from cell.geometry import Mesh, SpaceOf, transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics import Model
from robot_agent.trajectory import Motion
from robot_agent.workspace import Cover, Spaces, Sweep, Things, sweep

BOXES, MESHES = 20, 2
BLOCK = 90
"""Samples of a jog's block with its ramp."""
_ACROSS, _AROUND = 72, 72
_MARGIN_M = 0.005
_WORLD, _UPRIGHT = np.eye(4), (0.0, 0.0, 0.0, 1.0)


def workspace(model: Model, motion: Motion) -> Iterator[Row]:
    """All checks of one arm: 4 spaces, 20 boxes, 2 meshes of 10 000 triangles and the robot itself."""
    body, block = (sweep(model, _WORLD, motion.q(taus)) for taus in (motion.grid, motion.grid[:BLOCK]))
    with tempfile.TemporaryDirectory() as folder:
        file = _ball(Path(folder))
        things, spaces = Things(model, tuple(_free_things(model, motion, body, file))), Spaces(model, _spaces(body))
    taus = motion.grid
    flange = model.forward(motion.q(taus))  # who sweeps a block has worked it out already

    def points_at(taus: Array) -> Array:
        return transform_points(_WORLD, model.capsules(motion.q(taus)))

    def watched_at(taus: Array) -> Array:
        return spaces.points(_WORLD, motion.q(taus))

    def whole() -> None:
        touch = things.first_touch(body, taus, points_at)
        breach = spaces.first_breach(spaces.watched(body, _WORLD, flange), taus, watched_at, ())
        if touch or breach:
            raise AssertionError(f"{touch} {breach}")

    def at_run_time() -> None:
        watched = spaces.watched(block, _WORLD, flange[:BLOCK])
        cover = Cover.of_block(watched)
        way = things.in_the_way(block, cover) or spaces.in_the_way(watched, (), cover)
        if way:
            raise AssertionError(way)

    whole_s = median_s(whole, 7) * 10.0 / motion.duration_s
    block_s = median_s(at_run_time, 100)
    what = f"4 spaces, {BOXES} boxes, {MESHES} meshes and itself"
    yield Row(f"{what}, 10 s of motion", whole_s, whole_s / 0.03, "of 30 ms")
    yield Row(f"{what}, a block of {BLOCK} samples", block_s, block_s / 0.0003, "of 0.3 ms")
    yield from _ways_out(model, motion, block)
    yield _beside_fcl(_mesh(things), body)


def _ways_out(model: Model, motion: Motion, block: Sweep) -> Iterator[Row]:
    """A block of a robot whose hand stands in something at first, the way it goes at first and the way back."""
    back, (start, *_) = sweep(model, _WORLD, motion.q(motion.grid[BLOCK - 1 :: -1])), motion.q(motion.grid[:1])
    at = PoseSettings(tuple((model.forward(start)[:3, 3] - [0.0, 0.0, 0.15]).tolist()), _UPRIGHT)
    with tempfile.TemporaryDirectory() as folder:
        shapes = {"box": BoxShape((0.5, 0.5, 0.5)), "mesh": MeshShape(_ball(Path(folder)), 0.0025)}
        for name, shape in shapes.items():
            things = Things(model, (ThingSettings(name, shape, at, _MARGIN_M, {}),))
            taken = max(median_s(partial(things.in_the_way, each), 50) for each in (block, back))
            yield Row(f"the way out of a {name}, a block of {BLOCK} samples", taken, taken / 0.001, "of 1 ms")


def _beside_fcl(mesh: Mesh, body: Sweep) -> Row:
    """How near every capsule of some samples is to a mesh, where it is nearer than 20 mm."""
    points, within = body.points[:: max(1, len(body.points) // 40)], 0.02
    own = median_s(partial(mesh.capsule_distance, points, body.radii, within), 5)
    points = (points - mesh.pose_world_mesh[:3, 3]) @ mesh.pose_world_mesh[:3, :3]
    shapes = [
        fcl.CollisionObject(fcl.Capsule(float(radius), float(np.linalg.norm(b - a))), _pose(a, b))
        for sample in points
        for (a, b), radius in zip(sample, body.radii, strict=True)
    ]

    def by_fcl() -> list[float]:
        return [fcl.distance(mesh._tree, each, fcl.DistanceRequest(), fcl.DistanceResult()) for each in shapes]

    return Row(f"{len(shapes)} capsules against a mesh", own, own / median_s(by_fcl, 3), "of python-fcl's distances")


def _pose(start: Array, end: Array) -> fcl.Transform:
    way = end - start
    length = float(np.linalg.norm(way))
    z = way / length if length > 0.0 else np.array([0.0, 0.0, 1.0])
    x = np.cross(np.eye(3)[int(np.argmin(abs(z)))], z)
    x /= np.linalg.norm(x)
    return fcl.Transform(np.stack([x, np.cross(z, x), z], axis=-1), (start + end) / 2.0)


def _mesh(things: Things) -> Mesh:
    return next(each.solid for each in things._things if isinstance(each.solid, Mesh))


def _free_things(model: Model, motion: Motion, body: Sweep, file: Path) -> Iterator[ThingSettings]:
    """Things all around the way that touch nothing, drawn by lot."""
    rng = np.random.default_rng(2)
    low, high = body.points.min(axis=(0, 1, 2)) - 0.3, body.points.max(axis=(0, 1, 2)) + 0.3

    def points_at(taus: Array) -> Array:
        return transform_points(_WORLD, model.capsules(motion.q(taus)))

    def free(thing: ThingSettings) -> bool:
        touch = Things(model, (thing,)).first_touch(body, motion.grid, points_at)
        return touch is None

    for number in range(BOXES + MESHES):
        while True:
            shape = BoxShape(tuple(rng.uniform(0.05, 0.4, 3).tolist())) if number < BOXES else MeshShape(file, 0.001)
            place = PoseSettings(tuple(rng.uniform(low, high).tolist()), _UPRIGHT)
            thing = ThingSettings(f"thing {number}", shape, place, _MARGIN_M, {})
            if free(thing):
                yield thing
                break


def _spaces(body: Sweep) -> tuple[SpaceSettings, ...]:
    """Two safe ones that only together hold the body, and a forbidden one for the body and one for the TCP."""
    low, high = body.points.min(axis=(0, 1, 2)) - 0.3, body.points.max(axis=(0, 1, 2)) + 0.3
    middle = (low + high) / 2.0
    halves = [(low, np.array([middle[0] + 0.1, high[1], high[2]])), (np.array([middle[0], low[1], low[2]]), high)]
    safe = [
        SpaceSettings(f"safe {k}", SpaceKind.SAFE, BoxShape(tuple((b - a).tolist())), _at((a + b) / 2.0), _MARGIN_M)
        for k, (a, b) in enumerate(halves)
    ]
    below = np.array([middle[0], middle[1], low[2] - 0.2])
    plate = BoxShape((2.0, 2.0, 0.1))
    return (
        *safe,
        SpaceSettings("below", SpaceKind.FORBIDDEN, plate, _at(below), _MARGIN_M),
        SpaceSettings("for the TCP", SpaceKind.FORBIDDEN, plate, _at(below), _MARGIN_M, SpaceOf.TCP),
    )


def _at(place: Array) -> PoseSettings:
    return PoseSettings(tuple(place.tolist()), _UPRIGHT)


def _ball(folder: Path) -> Path:
    """A closed ball of 100 mm of more than 10 000 triangles."""
    lon = np.linspace(0.0, 2.0 * np.pi, _ACROSS, endpoint=False)
    lon, lat = np.meshgrid(lon, np.linspace(0.0, np.pi, _AROUND))
    ball = 100.0 * np.stack([np.sin(lat) * np.cos(lon), np.sin(lat) * np.sin(lon), np.cos(lat)], -1).reshape(-1, 3)
    row, column = (each.ravel() for each in np.indices((_AROUND - 1, _ACROSS)))
    a, b = row * _ACROSS + column, row * _ACROSS + (column + 1) % _ACROSS
    c, d = b + _ACROSS, a + _ACROSS
    triangles = np.concatenate([np.stack([a, b, c], -1), np.stack([a, c, d], -1)]) + 1
    lines = [f"v {x} {y} {z}" for x, y, z in ball.round(9)] + [f"f {i} {j} {k}" for i, j, k in triangles]
    file = folder / "ball.obj"
    file.write_text("\n".join(lines) + "\n")
    return file
