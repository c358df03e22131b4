"""What stands in the room, as plain shapes: made from messages and the cell file, for whatever draws it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import (
    BoxShape,
    CellSettings,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    MeshShape,
    PoseSettings,
    Shape,
    SpaceKind,
    SphereShape,
    ThingSettings,
)
from cell.geometry import capsule_distance, pose_from
from cell.geometry.arrays import Array
from cell.messages import (
    FramePose,
    ManagerState,
    PlannedWay,
    Presence,
    RobotState,
    ZoneGeometry,
    ZoneState,
)
from cell.messages.sections import Single
from cell.view.newest import Newest
from cell.view.words import ALARMED

MOST_RESERVED = 16
"""So many of the sections that a robot owns are drawn: those farthest apart along its way tell where it may be."""
_NO_ROOM = np.empty((0, 2, 3))

Indices = NDArray[np.intp]


@dataclass(frozen=True, slots=True, eq=False)
class Capsules:
    """Capsules in world: end points of their axes `(c, 2, 3)` [m] and radii `(c,)` [m]."""

    points: Array
    radii: Array

    def __len__(self) -> int:
        return len(self.radii)

    def without(self, numbers: Sequence[int]) -> "Capsules":
        """All but those with these numbers."""
        kept = ~np.isin(np.arange(len(self)), numbers)
        return Capsules(self.points[kept], self.radii[kept])


NOTHING = Capsules(_NO_ROOM, np.empty(0))


@dataclass(frozen=True, slots=True, eq=False)
class RobotBody:
    """Where a robot is and will be."""

    robot: str
    now: Capsules
    rest: Capsules
    """At the end of what was sent; empty where it stands."""
    reach: tuple[tuple[float, float, float], float] | None
    """Middle and radius [m] of the ball in which it is somewhere; None where it is known."""
    alarmed: bool


@dataclass(frozen=True, slots=True, eq=False)
class Ahead:
    """What a robot still has before it."""

    reserved: Capsules
    """What it owns of the room, as far as it is drawn; empty where it stands."""
    way: Array
    """`(p, 3)` [m]: of the TCP to rest, then of the last link along what is planned."""


@dataclass(frozen=True, slots=True, eq=False)
class Gap:
    """The shortest way from one robot to another."""

    robots: tuple[str, str]
    points: Array
    """`(2, 3)` [m]: on the surfaces of the nearest capsules."""
    distance_m: float


def robot_body(robot: str, seen: Newest) -> RobotBody | None:
    """The body of a robot by its last presence; None before the first one. A silent robot is where it was last."""
    last = seen.last(Presence, robot)
    if last is None:
        return None
    body = last[0].body
    state = seen.heard(RobotState, robot)
    alarmed = state is None or state.mode in ALARMED
    if not body.known or not len(body.poses):
        return RobotBody(robot, NOTHING, NOTHING, (body.base, body.reach_m), alarmed)
    radii = body.radii_m.astype(float)
    rest = Capsules(body.poses[-1].astype(float), radii) if _moves(last[0]) else NOTHING
    return RobotBody(robot, Capsules(body.poses[0].astype(float), radii), rest, None, alarmed)


def ahead(robot: str, seen: Newest) -> Ahead:
    """What a robot whose body is known still has before it, by its last presence."""
    last = seen.last(Presence, robot)
    if last is None or not last[0].body.known or not len(last[0].body.poses):
        return Ahead(NOTHING, np.empty((0, 3)))
    presence, _ = last
    moves, way = _moves(presence), presence.way
    plan = seen.heard(PlannedWay, robot)
    planned = _from_here_on(presence, plan) if plan is not None else np.empty((0, 3))
    return Ahead(
        _drawn(way.sections.points[: way.owned], way.sections.radii[: way.owned]) if moves else NOTHING,
        np.concatenate([presence.body.tcp_m if moves else np.empty((0, 3)), planned]),
    )


def _moves(presence: Presence) -> bool:
    return presence.stop_time_s > 0.0 and len(presence.body.poses) > 1


def measured_joints(body: RobotBody, seen: Newest) -> Array | None:
    """The joints `(n,)` [rad or m] that a robot was last measured at; None where nobody knows them."""
    last = seen.last(RobotState, body.robot)
    if last is None or body.reach is not None or last[0].joints is None:
        return None
    return np.array(last[0].joints)


def _from_here_on(presence: Presence, plan: PlannedWay) -> Array:
    """The end of the last link `(p, 3)` in each planned piece that the robot still has to pass."""
    way = presence.way
    pieces = way.pieces[way.pieces < len(plan.pieces)] if way.plan == plan.number else np.empty(0, np.uint32)
    first = int(pieces[0]) if len(pieces) else 0
    points = plan.pieces.points[first:]
    return np.asarray(points[:, -1, 1, :], dtype=float) if points.size else np.empty((0, 3))


def _drawn(points: Single, radii: Single) -> Capsules:
    """Of sections `(s, c, 2, 3)` so many as are drawn, the first and the last among them."""
    if not len(points):
        return NOTHING
    chosen = np.unique(np.linspace(0, len(points) - 1, min(len(points), MOST_RESERVED)).astype(int))
    return Capsules(points[chosen].reshape(-1, 2, 3).astype(float), radii[chosen].reshape(-1).astype(float))


def smallest_gap(bodies: list[RobotBody]) -> Gap | None:
    """Between the two robots that are nearest to each other; None with fewer than two whose bodies are known.

    No pair of capsules is farther apart than its middles are; those are left out whose balls, which hold them, are.
    """
    robot, i, k = _pairs(tuple(len(each.now) for each in bodies))
    if not len(i):
        return None
    points = np.concatenate([each.now.points for each in bodies])
    radii = np.concatenate([each.now.radii for each in bodies])
    starts, stops = points.transpose(1, 2, 0)
    middles, ways = (starts + stops) / 2.0, stops - starts
    balls = radii + np.sqrt(np.einsum("kc,kc->c", ways, ways)) / 2.0
    known = np.concatenate([middles, balls[None], radii[None]])
    one, other = known.take(i, axis=1), known.take(k, axis=1)
    apart, (thick, thin) = one[:3] - other[:3], one[3:] + other[3:]
    away = np.sqrt(np.einsum("kp,kp->p", apart, apart))
    near = np.flatnonzero(away - thick <= (away - thin).min())
    i, k = i[near], k[near]
    distances = capsule_distance(points[i], radii[i], points[k], radii[k])
    nearest = int(distances.argmin())
    first, second = int(i[nearest]), int(k[nearest])
    ends = nearest_points(points[first], points[second])
    way = ends[1] - ends[0]
    length = float(np.linalg.norm(way))
    along = way / length if length > 0.0 else np.zeros(3)
    surfaces = np.array([ends[0] + radii[first] * along, ends[1] - radii[second] * along])
    return Gap((bodies[robot[first]].robot, bodies[robot[second]].robot), surfaces, float(distances[nearest]))


@lru_cache(maxsize=8)
def _pairs(sizes: tuple[int, ...]) -> tuple[Indices, Indices, Indices]:
    """Of robots with so many capsules each: the robot of each capsule, and all pairs of capsules of two robots."""
    robot = np.repeat(np.arange(len(sizes)), sizes)
    one, other = np.nonzero(robot[:, None] < robot)
    return robot, one, other


def nearest_points(first: Array, second: Array) -> Array:
    """The points `(2, 3)` of two segments `(2, 3)` that are nearest to each other (Ericson, 5.1.9)."""
    u, v, w = first[1] - first[0], second[1] - second[0], first[0] - second[0]
    uu, vv, uv, uw, vw = u @ u, v @ v, u @ v, u @ w, v @ w
    apart = uu * vv - uv * uv
    s = min(max((uv * vw - uw * vv) / apart, 0.0), 1.0) if apart > 0.0 else 0.0
    t = min(max((uv * s + vw) / vv, 0.0), 1.0) if vv > 0.0 else 0.0
    s = min(max((uv * t - uw) / uu, 0.0), 1.0) if uu > 0.0 else 0.0
    return np.array([first[0] + s * u, second[0] + t * v])


@dataclass(frozen=True, slots=True, eq=False)
class Solid:
    """Something of a shape at a place `(4, 4)` in world."""

    name: str
    shape: Shape
    pose: Array


@dataclass(frozen=True, slots=True, eq=False)
class Zone:
    """An exclusive zone as it is now."""

    solid: Solid
    state: ZoneState
    label: str
    """Its name, its state, who has it, who waits."""


def zones(seen: Newest) -> list[Zone]:
    """The zones that the manager has told of; one whose state is silent counts as orphaned."""
    manager = seen.one(ManagerState)
    found = []
    for name, geometry in sorted(seen.of(ZoneGeometry).items()):
        status = manager.zones.get(name) if manager is not None else None
        state = status.state if status is not None else ZoneState.ORPHANED
        label = f"{name}: {state.value}"
        if status is not None and status.holder is not None:
            label += f", {status.holder}"
        if status is not None and status.queue:
            label += f"; next {', '.join(status.queue)}"
        found.append(Zone(_zone_solid(geometry), state, label))
    return found


def _zone_solid(zone: ZoneGeometry) -> Solid:
    lengths = zone.size_m
    shapes: dict[str, Shape] = {}
    if zone.shape == "box":
        shapes["box"] = BoxShape((lengths[0], lengths[1], lengths[2]))
    elif zone.shape == "sphere":
        shapes["sphere"] = SphereShape(lengths[0])
    elif zone.shape == "cylinder":
        shapes["cylinder"] = CylinderShape(lengths[0], lengths[1])
    bounds = zone.solid().bounds()
    fallback = BoxShape((1.0, 1.0, 1.0)) if bounds is None else BoxShape(tuple(bounds.size.tolist()))
    pose = pose_from(np.array(zone.position_m), np.array(zone.quaternion_xyzw))
    return Solid(zone.zone, shapes.get(zone.shape, fallback), pose)


def things(settings: CellSettings, seen: Newest) -> list[Solid]:
    """What stands in the cell, each once, where its frame is now."""
    every: Mapping[str, ThingSettings] = {
        thing.name: thing for robot in settings.robots.values() for thing in robot.things
    }
    frames = seen.of(FramePose)
    return [Solid(name, thing.shape, _placed(thing, frames)) for name, thing in every.items()]


def spaces(settings: CellSettings) -> list[tuple[Solid, SpaceKind]]:
    """The spaces that each robot keeps to, named for both."""
    return [
        (Solid(f"{robot}/{space.name}", space.shape, _pose(space.pose)), space.kind)
        for robot, its in settings.robots.items()
        for space in its.spaces
    ]


def _placed(thing: ThingSettings, frames: Mapping[str, FramePose]) -> Array:
    if thing.in_frame is None or thing.in_frame.frame not in frames:
        return _pose(thing.pose)
    frame = frames[thing.in_frame.frame]
    pose_world_frame = pose_from(np.array(frame.position_m), np.array(frame.quaternion_xyzw))
    return np.asarray(pose_world_frame @ _pose(thing.in_frame.pose))


def _pose(pose: PoseSettings) -> Array:
    return pose_from(np.array(pose.position_m), np.array(pose.quaternion_xyzw))


def triangles(shape: Shape) -> tuple[Array, Array] | None:
    """Corners `(v, 3)` [m] and faces `(f, 3)` of a shape; of a half space a plate. None where its file is not read."""
    import trimesh

    match shape:
        case BoxShape(size):
            mesh = trimesh.creation.box(extents=size)
        case SphereShape(radius):
            mesh = trimesh.creation.icosphere(subdivisions=3, radius=radius)
        case CylinderShape(radius, length):
            mesh = trimesh.creation.cylinder(radius=radius, height=length, sections=48)
        case HullShape(points):
            mesh = trimesh.Trimesh(vertices=np.array(points)).convex_hull
        case HalfSpaceShape():
            mesh = trimesh.creation.box(extents=(6.0, 6.0, 0.002))
        case MeshShape(file, unit_m):
            try:
                mesh = trimesh.load_mesh(file)
            except (OSError, ValueError):
                return None
            return np.asarray(mesh.vertices) * unit_m, np.asarray(mesh.faces)
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)
