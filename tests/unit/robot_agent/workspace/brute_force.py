"""Where a body first comes too near to something, by tenths of a millimetre of its way, or by time where asked for.

Distances are by coal (hpp-fcl).

It shares the poses of the links with the checks, and nothing else: which capsules there are, which pairs of them count
and how far things are apart is found here by other means. From where a watch is clear it goes on by as much way as is
clear, and where that is little it takes every tenth of a millimetre, and all moments that are asked for.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import combinations, product

import coal
import numpy as np

from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    MeshShape,
    OrientationSettings,
    PoseSettings,
    Shape,
    SpaceKind,
    SpaceSettings,
    SphereShape,
    ThingSettings,
)
from cell.geometry import SpaceOf
from robot_agent.kinematics import Model, OpenMechanism
from robot_agent.trajectory import Motion

NEAR_M = 0.001
"""Nothing is refused that stays so far beyond its margin."""
_FINE_M, _COARSE_M, _SPARE_M = 1e-4, 1e-3, 2e-3
_FAR_M = 20.0
POSES, MANY_POSES = 400, 4000
"""In which it is looked whether a pair of links always touches."""
Solid = tuple[object, object]
"""A shape of coal and its transform."""


@dataclass(frozen=True)
class Body:
    """Capsules of links and tool, the TCP, and a point on each axis of its frame, as they move in world."""

    model: Model
    base: np.ndarray

    @property
    def capsules(self) -> list[tuple[int, str, np.ndarray, float]]:
        """Number and name of the link, end points in its frame, radius."""
        description, names = self.model.description, self.model.link_names
        own = [(c.link, names[c.link], np.array([c.start_m, c.end_m]), c.radius_m) for c in description.capsules]
        tool, last = description.tool, len(names) - 1
        mounted = () if tool is None else tool.capsules
        return own + [(last, "tool", np.array([c.start_m, c.end_m]), c.radius_m) for c in mounted]

    @property
    def radii(self) -> np.ndarray:
        return np.array([*(radius for *_, radius in self.capsules), 0.0, 0.0, 0.0, 0.0])

    def at(self, q: np.ndarray) -> np.ndarray:
        """`(m, c + 4, 2, 3)`, the last four being points."""
        links = self.base @ self.model.links(q)
        tool = self.model.description.tool
        tcp = links[:, -1] if tool is None else links[:, -1] @ tool.pose_flange_tcp
        ends = [
            np.einsum("mij,ej->mei", links[:, link, :3, :3], local) + links[:, link, None, :3, 3]
            for link, _, local, _ in self.capsules
        ]
        points = [tcp[:, :3, 3], *(tcp[:, :3, k] for k in range(3))]
        return np.stack([*ends, *(np.repeat(point[:, None], 2, axis=1) for point in points)], axis=1)


@dataclass(frozen=True)
class Watch:
    """How clear one capsule, or a pair of them, is of something at one pose of the body."""

    what: str
    parts: tuple[int, ...]
    clear: Callable[[np.ndarray], float]
    """Distance less the margin [m]."""


@dataclass
class Seen:
    """When a motion first is less than `NEAR_M` beyond a margin, and when it first is within one [s]."""

    near_s: float = np.inf
    short_s: float = np.inf
    by: str = ""


def watched(
    body: Body,
    things: tuple[ThingSettings, ...],
    spaces: tuple[SpaceSettings, ...] = (),
    cone: OrientationSettings | None = None,
    poses: int = POSES,
) -> list[Watch]:
    """All that the robot keeps away from."""
    moving = [k for k, (link, *_) in enumerate(body.capsules) if link > 0]
    found = list(_of_itself(body, poses))
    for each in things:
        solid = solid_of(each.shape, each.pose)
        found += [_away(body, k, solid, each.margin_m, each.name) for k in moving]
    tcp = len(body.capsules)
    for of, parts in ((SpaceOf.BODY, moving), (SpaceOf.TCP, [tcp])):
        mine = [each for each in spaces if each.of is of]
        for each in mine:
            if each.kind is SpaceKind.FORBIDDEN:
                found += [_away(body, k, solid_of(each.shape, each.pose), each.margin_m, each.name) for k in parts]
        safe = [each for each in mine if each.kind is SpaceKind.SAFE]
        for solid in outside_of(safe) if safe else []:
            found += [_away(body, k, solid, safe[0].margin_m, safe[0].name) for k in parts]
    if cone is not None:
        towards, point = np.array(cone.towards), tcp + 1 + cone.axis

        def within(ends: np.ndarray) -> float:
            return cone.within_rad - float(np.arccos(np.clip(ends[point, 0] @ towards, -1.0, 1.0)))

        found.append(Watch("cone", (point,), within))
    return found


def seen(body: Body, motion: Motion, watches: list[Watch], every_s: float = np.inf) -> Seen:
    """Look at the whole motion, where a watch is near no more than `every_s` apart."""
    rough = np.linspace(0.0, motion.duration_s, 200)
    way_m = np.linalg.norm(np.diff(body.at(motion.q(rough)), axis=0), axis=-1).max(axis=-1).sum(axis=0).max()
    taus = np.linspace(0.0, motion.duration_s, 10 + int(2.0 * way_m / _COARSE_M))
    ends = body.at(motion.q(taus))
    steps = 1.001 * np.linalg.norm(np.diff(ends, axis=0), axis=-1).max(axis=-1)
    ways = np.concatenate([np.zeros((1, steps.shape[1])), steps.cumsum(axis=0)])
    told = Seen()
    for watch in watches:
        _look(watch, body, motion, taus, ends, ways[:, list(watch.parts)].sum(axis=1), told, every_s)
    return told


def _look(
    watch: Watch,
    body: Body,
    motion: Motion,
    taus: np.ndarray,
    ends: np.ndarray,
    way: np.ndarray,
    told: Seen,
    every_s: float,
) -> None:
    at = 0
    while taus[at] < told.short_s:
        clear = watch.clear(ends[at])
        _note(watch, float(taus[at]), clear, told)
        if clear < 0.0 or at == len(taus) - 1:
            return
        ahead = int(np.searchsorted(way, way[at] + clear - _SPARE_M, side="right")) - 1
        if ahead <= at:
            ahead = at + 1
            parts = int(max((way[ahead] - way[at]) / _FINE_M, (taus[ahead] - taus[at]) / every_s))
            between = np.linspace(taus[at], taus[ahead], parts + 2)[1:-1]
            if len(between):
                for tau, here in zip(between.tolist(), body.at(motion.q(between)), strict=True):
                    if _note(watch, tau, watch.clear(here), told):
                        return
        at = ahead


def _note(watch: Watch, tau: float, clear: float, told: Seen) -> bool:
    if clear < NEAR_M:
        told.near_s = min(told.near_s, tau)
    if clear < 0.0 and tau < told.short_s:
        told.short_s, told.by = tau, watch.what
    return clear < 0.0


def solid_of(shape: Shape, place: PoseSettings) -> Solid:
    """As coal has it."""
    turn, at = rotation(place.quaternion_xyzw), np.array(place.position_m)
    pose = coal.Transform3s(turn, at)
    match shape:
        case BoxShape(size_m=size):
            return coal.Box(*size), pose
        case SphereShape(radius_m=radius):
            return coal.Sphere(radius), pose
        case CylinderShape(radius_m=radius, length_m=length):
            return coal.Cylinder(radius, length), pose
        case HalfSpaceShape():
            return coal.Halfspace(turn[:, 2], float(turn[:, 2] @ at)), coal.Transform3s.Identity()
        case HullShape(points_m=points):
            return _hull(points), pose
        case MeshShape(file=file, unit_m=unit):
            return _mesh(str(file), unit), pose


@cache
def _mesh(file: str, unit_m: float) -> object:
    return coal.MeshLoader().load(file, np.full(3, unit_m))


@cache
def _hull(points: tuple[tuple[float, float, float], ...]) -> object:
    """Of the eight corners of a sheared box, x the slowest: its twelve triangles are known."""
    corners, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for point in points:
        corners.append(np.array(point))
    for a, b, c, d in ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)):
        triangles.append(coal.Triangle(a, b, c))
        triangles.append(coal.Triangle(a, c, d))
    return coal.Convex(corners, triangles)


def outside_of(boxes: list[SpaceSettings]) -> Iterator[Solid]:
    """Boxes that together fill all that is outside of some boxes, which are turned alike."""
    turn = rotation(boxes[0].pose.quaternion_xyzw)
    middles = np.array([box.pose.position_m for box in boxes]) @ turn
    halves = np.array([box.shape.size_m for box in boxes if isinstance(box.shape, BoxShape)]) / 2.0
    cuts = [
        np.unique(np.round([-_FAR_M, *(middles - halves)[:, k], *(middles + halves)[:, k], _FAR_M], 12))
        for k in range(3)
    ]
    for corner in product(*(range(len(cut) - 1) for cut in cuts)):
        low, high = (np.array([cut[i + step] for cut, i in zip(cuts, corner, strict=True)]) for step in (0, 1))
        middle = (low + high) / 2.0
        if not (np.abs(middle - middles) < halves).all(axis=-1).any():
            yield coal.Box(*(high - low)), coal.Transform3s(turn, turn @ middle)


def distance(one: Solid, other: Solid) -> float:
    """Below or at zero where they touch [m]."""
    return float(coal.distance(*one, *other, coal.DistanceRequest(), coal.DistanceResult()))


def capsule(ends: np.ndarray, radius: float) -> Solid:
    """In world; a ball where both ends are one."""
    way = ends[1] - ends[0]
    length = float(np.sqrt(way @ way))
    if length < 1e-9:
        return coal.Sphere(max(radius, 1e-9)), coal.Transform3s(np.eye(3), ends[0])
    z = way / length
    aside = np.zeros(3)
    aside[int(np.abs(z).argmin())] = 1.0
    x = _cross(aside, z)
    x /= np.sqrt(x @ x)
    return coal.Capsule(radius, length), coal.Transform3s(
        np.stack([x, _cross(z, x), z], axis=-1), (ends[0] + ends[1]) / 2.0
    )


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def _away(body: Body, part: int, solid: Solid, margin_m: float, what: str) -> Watch:
    radius = float(body.radii[part])
    return Watch(what, (part,), lambda ends: distance(capsule(ends[part], radius), solid) - margin_m)


def _of_itself(body: Body, count: int) -> Iterator[Watch]:
    """Every pair of capsules that no joint holds together, that may not touch, and that does not always touch."""
    apart = body.model.description.apart
    free, held = {frozenset(pair) for pair in apart.may_touch}, body.model.joined_links()
    parts, radii, poses = body.capsules, body.radii, _poses(body, count)
    for one, other in combinations(range(len(parts)), 2):
        (link, name, *_), (further, called, *_) = parts[one], parts[other]
        joined = (min(link, further), max(link, further)) in held and "tool" not in (name, called)
        if link == further or joined or frozenset((name, called)) in free:
            continue

        def clear(ends: np.ndarray, one: int = one, other: int = other) -> float:
            between = distance(capsule(ends[one], float(radii[one])), capsule(ends[other], float(radii[other])))
            return between - apart.margin_m

        if any(clear(ends) >= 0.0 for ends in poses):
            yield Watch(f"{name} and {called}", (one, other), clear)


def _poses(body: Body, count: int) -> np.ndarray:
    """Of the body, all over its joints' ranges."""
    lower, upper = body.model.limits.position.T
    found = []
    for q in np.random.default_rng(5).uniform(lower, upper, (count, body.model.n)):
        try:
            found.append(body.at(q[None])[0])
        except OpenMechanism:
            continue
    return np.array(found)


def rotation(quaternion_xyzw: tuple[float, float, float, float]) -> np.ndarray:
    """`(3, 3)`."""
    x, y, z, w = np.array(quaternion_xyzw) / np.linalg.norm(quaternion_xyzw)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
