"""What a robot must not touch: the things of its cell, and itself. Where a motion comes too near, and to what."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    MeshShape,
    PoseSettings,
    Shape,
    SphereShape,
    ThingSettings,
)
from cell.geometry import Box, Convex, Cylinder, HalfSpace, Hull, Mesh, Solid, Sphere, pose_from, transform_points
from cell.geometry.arrays import Array
from robot_agent.kinematics import Model
from robot_agent.workspace.swept_body import Sweep

TOOL = "tool"
"""In `may_touch`: the body of the mounted tool, which is not the flange's."""
FINE_M = 0.00025
"""Between samples that the body moves less than this apart nothing more is looked for."""
_APART_M = 0.001
"""So much farther than needed a bound on the distance does for it."""
_ROUNDING_M = 1e-9
_BULGE_SHRINKS = 1.0 / 3.0
"""Half the time between samples leaves a quarter of the bulge; somewhat more is taken."""


@dataclass(frozen=True, slots=True)
class Touch:
    """A link that comes too near to a thing."""

    tau: float
    """Where on the motion [s]."""
    link: str
    thing: str
    missing_m: float
    """By how much the distance falls short of the margin."""
    margin_m: float

    def __str__(self) -> str:
        """For people, without where and when."""
        missing, margin = f"{1000.0 * max(self.missing_m, 0.0):.1f} mm", f"{1000.0 * self.margin_m:g} mm"
        return f"link {self.link} comes {missing} too near to {self.thing} (margin {margin})"


@dataclass(frozen=True, slots=True)
class Near:
    """A capsule that comes too near to something, and by how much, at path time `tau` [s]."""

    tau: float
    capsule: int
    missing_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Barrier:
    """A solid, and the capsules `(k,)` of the robot that keep its margin away from it."""

    name: str
    solid: Solid
    margin_m: float
    capsules: Array

    def clearance(self, points: Array, radii: Array, within: float) -> Array:
        """Distance less the margin, `(m, k)` [m], of the capsules that count; beyond `within` a bound from below."""
        points = points[:, self.capsules]
        radii = np.broadcast_to(radii[self.capsules], points.shape[:2])
        centre, radius = self.solid.bounds()
        middle, way = points.mean(axis=-2), points[..., 1, :] - points[..., 0, :]
        distance = np.linalg.norm(middle - centre, axis=-1) - radius - np.linalg.norm(way, axis=-1) / 2.0 - radii
        near = distance < within + self.margin_m
        if near.any():
            distance[near] = self.solid.capsule_distance(points[near], radii[near], within + self.margin_m)
        return np.asarray(distance - self.margin_m)


class Things:
    """All that one robot must not touch."""

    def __init__(self, model: Model, things: tuple[ThingSettings, ...] = (), robot: str = "") -> None:
        """Raises `cell.geometry.GeometryError` for a mesh that is none."""
        self._model = model
        self._things = [
            Barrier(t.name, solid_of(t.shape, t.pose), t.margin_m, _kept_away(model, t, robot)) for t in things
        ]

    def __bool__(self) -> bool:
        return bool(self._things)

    def first_touch(self, path: Sweep, taus: Array, points_at: Callable[[Array], Array]) -> Touch | None:
        """Where a motion first comes too near to something.

        Between two samples the body leaves both by no more than their distance and the bulge; where that could be
        enough it is looked at more closely, until it moves less than `FINE_M`. So nothing thinner than the margin is
        jumped over, and nothing is refused that stays `FINE_M` beyond the margin.

        Args:
            path: the swept body, at `taus` `(m,)` [s].
            points_at: capsules in world `(k, c, 2, 3)` at path times `(k,)`.
        """
        found = [(thing, first_near(thing, path, taus, points_at)) for thing in self._things]
        touches = [
            Touch(near.tau, self._link(near.capsule), thing.name, near.missing_m, thing.margin_m)
            for thing, near in found
            if near is not None
        ]
        return min(touches, key=lambda touch: touch.tau, default=None)

    def in_the_way(self, path: Sweep) -> str:
        """What samples close to one another come too near to, for people; empty when nothing.

        A robot that begins too near may go where it comes no nearer: that is the way out.
        """
        for thing in self._things:
            if (capsule := blocked(thing, path)) is not None:
                return f"{thing.name} is in the way of link {self._link(capsule)}"
        return ""

    def _link(self, capsule: int) -> str:
        return TOOL if capsule >= len(self._model.description.capsules) else link_of(self._model, capsule)


def blocked(thing: Barrier, path: Sweep) -> int | None:
    """The capsule that comes too near to a thing in samples close to one another; see `Things.in_the_way`."""
    around = np.zeros(path.points.shape[:2])
    around[1:] = path.chords / 2.0 + path.bulge[:, None]
    clear = thing.clearance(path.points, path.radii, float(around.max()) + _APART_M)
    short = np.where(clear[0] < 0.0, clear < clear[0] - _ROUNDING_M, clear < around[:, thing.capsules])
    short[0] = False
    if not short.any():
        return None
    _, which = np.unravel_index(int(np.argmax(short)), short.shape)
    return int(thing.capsules[which])


def first_near(thing: Barrier, path: Sweep, taus: Array, points_at: Callable[[Array], Array]) -> Near | None:
    """Where a motion first comes too near to one thing; see `Things.first_touch`.

    Halve intervals in which it could come too near, the body's way in each being less and less.
    """
    within = float((path.chords.max(axis=-1) / 2.0 + path.bulge).max(initial=0.0)) + _APART_M
    clear = thing.clearance(path.points, path.radii, within)
    ends = np.stack([taus[:-1], taus[1:]])
    sides = np.stack([clear[:-1], clear[1:]])
    ways, bulge = path.chords[:, thing.capsules], path.bulge
    touches = _too_near(taus, clear)
    while True:
        if touches:  # nothing later counts any more
            kept = ends[0] < touches[0][0]
            ends, sides, ways, bulge = ends[:, kept], sides[:, kept], ways[kept], bulge[kept]
        least = sides.mean(axis=0) - ways / 2.0 - bulge[:, None]
        open_ = (least < 0.0).any(axis=-1)
        if not open_.any():
            break
        ends, sides, ways, bulge, least = ends[:, open_], sides[:, open_], ways[open_], bulge[open_], least[open_]
        fine = ways.max(axis=-1) / 2.0 + bulge <= FINE_M
        for k in np.flatnonzero(fine):
            which = int(least[k].argmin())
            touches.append((float(ends[0, k]), which, -float(sides[:, k, which].min())))
        rough = ~fine
        middle = ends[:, rough].mean(axis=0)
        points = points_at(middle)
        here = thing.clearance(points, path.radii, within)
        touches = sorted(touches + _too_near(middle, here))[:1]
        ends = np.concatenate([np.stack([ends[0, rough], middle]), np.stack([middle, ends[1, rough]])], axis=1)
        sides = np.concatenate([np.stack([sides[0, rough], here]), np.stack([here, sides[1, rough]])], axis=1)
        before, after = points_at(ends[0]), points_at(ends[1])
        ways = np.linalg.norm(after - before, axis=-1).max(axis=-1)[:, thing.capsules]
        bulge = np.tile(bulge[rough] * _BULGE_SHRINKS, 2)
    if not touches:
        return None
    tau, which, missing = touches[0]
    return Near(tau, int(thing.capsules[which]), missing)


def _too_near(taus: Array, clear: Array) -> list[tuple[float, int, float]]:
    """The first of these path times at which something is too near: that, which column, and by how much."""
    short = np.flatnonzero((clear < 0.0).any(axis=-1))
    if len(short) == 0:
        return []
    first = short[taus[short].argmin()]
    return [(float(taus[first]), int(clear[first].argmin()), -float(clear[first].min()))]


def link_of(model: Model, capsule: int) -> str:
    """The name of the link that a capsule belongs to."""
    return model.link_names[model.body[capsule].link]


def unknown_links(model: Model, names: tuple[str, ...]) -> list[str]:
    """Names in a thing's `may_touch` that the robot has no link for."""
    return [name for name in names if name not in (*model.link_names, TOOL)]


def solid_of(shape: Shape, place: PoseSettings) -> Solid:
    """The solid in world. Raises `cell.geometry.GeometryError`."""
    position = np.array(place.position_m)
    pose = pose_from(position, np.array(place.quaternion_xyzw))
    match shape:
        case BoxShape(size_m=size):
            return Box(np.array(size), pose)
        case HullShape(points_m=points):
            return Hull(Convex.of_points(transform_points(pose, np.array(points))))
        case SphereShape(radius_m=radius):
            return Sphere(position, radius)
        case CylinderShape(radius_m=radius, length_m=length):
            return Cylinder(radius, length, pose)
        case MeshShape(file=file, unit_m=unit):
            return Mesh.of_file(file, unit, pose)
        case HalfSpaceShape():
            return HalfSpace(pose)


def _kept_away(model: Model, thing: ThingSettings, robot: str) -> Array:
    """The capsules of links that move and are not among those that may touch it."""
    free = thing.may_touch.get(robot, ())
    own = len(model.description.capsules)
    return np.array(
        [
            number
            for number, capsule in enumerate(model.body)
            if capsule.link > 0 and (TOOL if number >= own else model.link_names[capsule.link]) not in free
        ],
        dtype=int,
    )
