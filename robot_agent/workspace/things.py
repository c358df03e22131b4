"""What a robot must not touch: the things of its cell, and itself. Where a motion comes too near, and to what."""

import copy
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import (
    BoxShape,
    CylinderShape,
    HalfSpaceShape,
    HullShape,
    InFrame,
    MeshShape,
    PoseSettings,
    Shape,
    SphereShape,
    ThingSettings,
)
from cell.geometry import (
    Box,
    Cylinder,
    HalfSpace,
    Hull,
    Mesh,
    PlacedSolid,
    Solid,
    Sphere,
    compose,
    point_box_distance,
    pose_from,
    transform_points,
)
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics import Model
from robot_agent.model import TOOL
from robot_agent.workspace.cover import STRETCH, Boxes, Cover, runs
from robot_agent.workspace.itself import Itself, as_written, named, part_of
from robot_agent.workspace.swept_body import Sweep

FINE_M = 0.00025
"""Between samples that the body moves less than this apart nothing more is looked for."""
_APART_M = 0.001
"""So much farther than needed a bound on the distance does for it."""
_ROUNDING_M = 1e-9
_DEPTHS = 64
"""Samples of a motion are looked at for how far it comes too near, at most."""
_BULGE_SHRINKS = 1.0 / 3.0
"""Half the time between samples leaves a quarter of the bulge; somewhat more is taken."""


@dataclass(frozen=True, slots=True)
class Touch:
    """A link that comes too near to a thing, or to another link."""

    tau: float
    """Where on the motion [s]."""
    link: str
    thing: str
    missing_m: float
    """By how much the distance falls short of the margin until it is kept again, at most."""
    margin_m: float

    def __str__(self) -> str:
        """For people, without where and when."""
        missing, margin = f"{1000.0 * max(self.missing_m, 0.0):.1f} mm", f"{1000.0 * self.margin_m:g} mm"
        return f"{named(self.link)} comes up to {missing} too near to {self.thing} (margin {margin})"


class KeptAway(Protocol):
    """What a motion keeps away from: a solid, or the robot itself. Its columns are `k` capsules, or pairs of them."""

    @property
    def margin_m(self) -> float: ...

    @property
    def bodies(self) -> int:
        """How many bodies of a column move between two samples."""
        ...

    def clearance(self, points: Array, radii: Array, within: Array | float) -> Array:
        """Distance less the margin `(m, k)` [m] at poses of all capsules; beyond `within` a bound from below."""
        ...

    def nearer(self, points: Array, radii: Array, than: Array) -> Flags:
        """Which columns `(k,)` are nearer than that `(k,)` [m], less their margin, at some of the poses."""
        ...

    def way(self, ways: Array) -> Array:
        """How far the bodies of each column go together `(m, k)` [m], from how far each capsule goes `(m, c)`."""
        ...

    def among(self, columns: NDArray[np.intp]) -> Self:
        """The same with some of its columns only."""
        ...


@dataclass(frozen=True, slots=True)
class Near:
    """A column that comes too near at path time `tau` [s], and by how much; from there on at most."""

    tau: float
    column: int
    missing_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Barrier:
    """A solid, and the capsules `(k,)` of the robot that keep its margin away from it."""

    solid: Solid
    margin_m: float
    capsules: NDArray[np.intp]
    bodies: int = 1

    def clearance(self, points: Array, radii: Array, within: Array | float) -> Array:
        """Distance less the margin, `(m, k)` [m], of the capsules that count; beyond `within` a bound from below."""
        points = points[:, self.capsules]
        radii = np.broadcast_to(radii[self.capsules], points.shape[:2])
        box, within = self.solid.bounds(), np.broadcast_to(within + self.margin_m, points.shape[:2])
        if box is None:
            return self.solid.capsule_distance(points, radii, within) - self.margin_m
        start, way = points[..., 0, :], points[..., 1, :] - points[..., 0, :]
        half = np.sqrt(np.einsum("...k,...k", way, way)) / 2.0
        distance = point_box_distance(start + way / 2.0, box) - half - radii
        near = distance < np.maximum(within, 0.0)
        if near.any():
            distance[near] = self.solid.capsule_distance(points[near], radii[near], within[near])
        return np.asarray(distance - self.margin_m)

    def nearer(self, points: Array, radii: Array, than: Array) -> Flags:
        """As `KeptAway`. How near a mesh is at each pose takes much longer than whether it is nearer at one of them."""
        if isinstance(self.solid, Mesh):
            return self.solid.comes_nearer(points[:, self.capsules], radii[self.capsules], than + self.margin_m)
        return np.asarray((self.clearance(points, radii, than) < than).any(axis=0))

    def near(self, cover: Cover, roughly: Flags) -> Flags:
        """Which of the columns that are `roughly` near `(b, c)` may come too near, and when: `(b, k)`, by stretches."""
        near = roughly[:, self.capsules]
        if near.any():
            points, radii = cover.points[:, self.capsules][near], cover.radii[:, self.capsules][near]
            if isinstance(self.solid, Mesh):
                near[near] = self.solid.comes_nearer(points[None], radii, self.margin_m)
            else:
                near[near] = self.solid.capsule_distance(points, radii, self.margin_m) <= self.margin_m
        return near

    def way(self, ways: Array) -> Array:
        """As `KeptAway`."""
        return np.asarray(ways[:, self.capsules])

    def among(self, columns: NDArray[np.intp]) -> "Barrier":
        """As `KeptAway`."""
        return replace(self, capsules=self.capsules[columns])


class Barriers:
    """Solids that are looked at together: boxes and stretches tell first which could be near, and when."""

    def __init__(self, barriers: Sequence[Barrier]) -> None:
        self.barriers = tuple(barriers)
        boxes = {k: box for k, each in enumerate(self.barriers) if (box := each.solid.bounds()) is not None}
        self._boxes, self._boxed = Boxes(list(boxes.values())), np.array(list(boxes), dtype=np.intp)
        self._endless = [k for k in range(len(self.barriers)) if k not in boxes]
        """Those that no box holds."""
        self._margins = np.array([self.barriers[index].margin_m for index in boxes])[:, None, None]

    def near(self, cover: Cover) -> Iterator[tuple[Barrier, Flags]]:
        """The barriers some of whose columns may come too near, with which and when: `(b, k)`, by stretches."""
        roughly = np.asarray(self._boxes.distance(cover.points) - cover.radii < self._margins)
        some = np.flatnonzero(roughly.any(axis=(1, 2)))
        flags = dict(zip(self._boxed[some].tolist(), roughly[some], strict=True))
        flags |= dict.fromkeys(self._endless, np.ones(cover.radii.shape, dtype=bool))
        for index in sorted(flags):
            near = self.barriers[index].near(cover, flags[index])
            if near.any():
                yield self.barriers[index], near

    def first_near(
        self, cover: Cover, path: Sweep, taus: Array, points_at: Callable[[Array], Array]
    ) -> tuple[Barrier, Near] | None:
        """Where a motion first comes too near to one of them; see `first_near`."""
        found = [(each, first_near_of(each, cover, near, path, taus, points_at)) for each, near in self.near(cover)]
        return min(((each, near) for each, near in found if near), key=lambda each: each[1].tau, default=None)

    def blocked(self, cover: Cover, path: Sweep) -> tuple[Barrier, int] | None:
        """Which of them is in the way of samples close to one another, and of which column; see `blocked`."""
        for barrier, near in self.near(cover):
            if (found := blocked_of(barrier, near, path)) is not None:
                return barrier, found
        return None


def first_near_of(
    kept: KeptAway, cover: Cover, near: Flags, path: Sweep, taus: Array, points_at: Callable[[Array], Array]
) -> Near | None:
    """As `first_near`, looking only where and at which columns `near` `(b, k)` says, by stretches of the cover."""
    for start, end in runs(np.asarray(near.any(axis=1))):
        columns, first, last = np.flatnonzero(near[start:end].any(axis=0)), cover.edges[start], cover.edges[end]
        found = first_near(kept.among(columns), path.part(first, last), taus[first : last + 1], points_at)
        if found is not None:
            column = int(columns[found.column])
            missing_m = max(found.missing_m, _deepest(kept, column, path, taus > found.tau))
            return Near(found.tau, column, missing_m)
    return None


def _deepest(kept: KeptAway, column: int, path: Sweep, after: Flags) -> float:
    """By how much a column comes too near at samples of a motion `(m,)`, until it is clear again, at most [m]."""
    samples = np.flatnonzero(after)
    samples = samples[:: len(samples) // _DEPTHS + 1]
    clear = kept.among(np.array([column])).clearance(path.points[samples], path.radii, 0.0)[:, 0]
    passed = np.flatnonzero(clear >= 0.0)
    return -float(clear[: passed[0] if len(passed) else None].min(initial=0.0))


def blocked_of(kept: KeptAway, near: Flags, path: Sweep) -> int | None:
    """As `blocked`, looking only at the columns that `near` `(b, k)` says of some stretch."""
    columns = np.flatnonzero(near.any(axis=0))
    found = blocked(kept.among(columns), path, near[0, columns]) if len(columns) else None
    return None if found is None else int(columns[found])


@dataclass(frozen=True, slots=True, eq=False)
class _Thing:
    """One thing of the cell."""

    name: str
    solid: PlacedSolid
    barrier: Barrier
    in_frame: InFrame | None
    may_touch: tuple[str, ...]
    """Links of the robot that are not kept away."""

    def placed(self, frames: Mapping[str, Array]) -> "_Thing":
        """Where it is with frames there; the thing itself where it stands in none of them."""
        if self.in_frame is None or self.in_frame.frame not in frames:
            return self
        solid = self.solid.moved_to(compose(frames[self.in_frame.frame], self.in_frame.pose.matrix()))
        return replace(self, solid=solid, barrier=replace(self.barrier, solid=solid))


class Things:
    """All that one robot must not touch, itself included."""

    def __init__(self, model: Model, things: tuple[ThingSettings, ...] = (), robot: str = "") -> None:
        """Raises `cell.geometry.GeometryError` for a mesh that is none, and for points that span nothing."""
        self._model = model
        self._stand([_thing(model, thing, robot) for thing in things])
        self._itself = Itself(model)

    def of(self, model: Model) -> "Things":
        """The same for this robot with another tool or part."""
        other, things = Things(model), []
        for thing in self._things:
            kept_away = _kept_away(model, thing.may_touch)
            things.append(replace(thing, barrier=replace(thing.barrier, capsules=kept_away)))
        other._stand(things)
        return other

    def _stand(self, things: list[_Thing]) -> None:
        self._things = things
        self._barriers = Barriers([thing.barrier for thing in things])

    def placed(self, frames: Mapping[str, Array]) -> "Things":
        """The same with what stands in these frames moved along: by name their poses `(4, 4)` in world."""
        if not frames:
            return self
        moved = copy.copy(self)
        moved._stand([thing.placed(frames) for thing in self._things])
        return moved

    def __bool__(self) -> bool:
        return bool(self._things) or self._itself.pairs.size > 0

    def first_touch(self, path: Sweep, taus: Array, points_at: Callable[[Array], Array]) -> Touch | None:
        """Where a motion first comes too near to something, to the exactness of `first_near`."""
        touches, cover = list[Touch](), Cover.of(path, STRETCH)
        if found := self._barriers.first_near(cover, path, taus, points_at):
            barrier, first = found
            part, name = self._part(barrier, first.column), self._name(barrier)
            touches.append(Touch(first.tau, part, name, first.missing_m, barrier.margin_m))
        if near := first_near_of(self._itself, cover, self._itself.near(cover), path, taus, points_at):
            part, other = self._itself.names(near.column)
            touches.append(Touch(near.tau, part, other, near.missing_m, self._itself.margin_m))
        return min(touches, key=lambda touch: touch.tau, default=None)

    def touches_at(self, pose_world_base: Array, q: Array) -> list[Touch]:
        """The things that a robot comes too near to that stands at `q` `(n,)`, with the link that does so most."""
        points, found = transform_points(pose_world_base, self._model.capsules(q)[None]), list[Touch]()
        for thing in self._things:
            clear = thing.barrier.clearance(points, self._model.capsule_radii, np.inf)[0]
            if len(clear) and clear.min() < 0.0:
                part, margin_m = self._part(thing.barrier, int(clear.argmin())), thing.barrier.margin_m
                found.append(Touch(0.0, part, thing.name, -float(clear.min()), margin_m))
        return found

    def in_the_way(self, path: Sweep, cover: Cover | None = None) -> str:
        """What samples close to one another come too near to, for people; empty when nothing; see `blocked`.

        `cover`: `Cover.of_block` of this path, or of what is `Spaces.watched` of it, for who has it already.
        """
        cover = Cover.of_block(path) if cover is None else cover.first(len(path.radii))
        if found := self._barriers.blocked(cover, path):
            return f"{self._name(found[0])} is in the way of {named(self._part(*found))}"
        if (pair := blocked_of(self._itself, self._itself.near(cover), path)) is not None:
            part, other = self._itself.names(pair)
            return f"{other} is in the way of {named(part)}"
        return ""

    def _part(self, barrier: Barrier, column: int) -> str:
        return part_of(self._model, int(barrier.capsules[column]))

    def _name(self, barrier: Barrier) -> str:
        return next(thing.name for thing in self._things if thing.barrier is barrier)


def blocked(kept: KeptAway, path: Sweep, begins: Flags) -> int | None:
    """The column that comes too near in samples close to one another.

    A robot that begins too near may go where it comes no nearer: that is the way out. Which columns may begin so says
    `begins` `(k,)`.
    """
    around = kept.way(path.chords) / 2.0 + kept.bodies * path.bulge[:, None]
    within = float(around.max(initial=0.0)) + _APART_M
    first, begin = np.zeros(len(begins)), np.flatnonzero(begins)
    if len(begin):
        first[begin] = kept.among(begin).clearance(path.points[:1], path.radii, within)[0]
    inside, free = np.flatnonzero(first < 0.0), np.flatnonzero(first >= 0.0)
    if len(inside):
        nearer = kept.among(inside).nearer(path.points[1:], path.radii, first[inside] - _ROUNDING_M)
        if nearer.any():
            return int(inside[nearer.argmax()])
    if len(free):
        short = kept.among(free).clearance(path.points[1:], path.radii, within) < around[:, free]
        if short.any():
            return int(free[np.unravel_index(int(short.argmax()), short.shape)[1]])
    return None


def first_near(kept: KeptAway, path: Sweep, taus: Array, points_at: Callable[[Array], Array]) -> Near | None:
    """Where a motion first comes too near to something.

    Between two samples the body leaves both by no more than their distance and the bulge; where that could be enough
    intervals are halved, until the body moves less than `FINE_M` in them. So nothing thinner than the margin is jumped
    over, and nothing is refused that stays `FINE_M` beyond the margin.

    Args:
        kept: what to keep away from.
        path: the swept body, at `taus` `(m,)` [s].
        points_at: capsules in world `(k, c, 2, 3)` at path times `(k,)`.
    """
    ways, bulge = kept.way(path.chords), kept.bodies * path.bulge
    within = float((ways / 2.0 + bulge[:, None]).max(initial=0.0)) + _APART_M
    clear = kept.clearance(path.points, path.radii, within)
    ends = np.stack([taus[:-1], taus[1:]])
    sides = np.stack([clear[:-1], clear[1:]])
    touches = _too_near(taus, clear)
    while True:
        if touches:  # nothing later counts any more
            sooner = ends[0] < touches[0].tau
            ends, sides, ways, bulge = ends[:, sooner], sides[:, sooner], ways[sooner], bulge[sooner]
        least = sides.mean(axis=0) - ways / 2.0 - bulge[:, None]
        open_ = (least < 0.0).any(axis=-1)
        if not open_.any():
            break
        ends, sides, ways, bulge, least = ends[:, open_], sides[:, open_], ways[open_], bulge[open_], least[open_]
        fine = np.where(least < 0.0, ways, 0.0).max(axis=-1) / 2.0 + bulge <= FINE_M
        for k in np.flatnonzero(fine):
            which = int(least[k].argmin())
            touches.append(Near(float(ends[0, k]), which, -float(sides[:, k, which].min())))
        rough = ~fine
        middle = ends[:, rough].mean(axis=0)
        points = points_at(middle)
        here = kept.clearance(points, path.radii, within)
        touches = sorted(touches + _too_near(middle, here), key=lambda near: near.tau)[:1]
        ends = np.concatenate([np.stack([ends[0, rough], middle]), np.stack([middle, ends[1, rough]])], axis=1)
        sides = np.concatenate([np.stack([sides[0, rough], here]), np.stack([here, sides[1, rough]])], axis=1)
        before, after = points_at(ends[0]), points_at(ends[1])
        ways = kept.way(np.linalg.norm(after - before, axis=-1).max(axis=-1))
        bulge = np.tile(bulge[rough] * _BULGE_SHRINKS, 2)
    return touches[0] if touches else None


def _too_near(taus: Array, clear: Array) -> list[Near]:
    """The first of these path times at which something is too near."""
    short = np.flatnonzero((clear < 0.0).any(axis=-1))
    if len(short) == 0:
        return []
    first = short[taus[short].argmin()]
    return [Near(float(taus[first]), int(clear[first].argmin()), -float(clear[first].min()))]


def unknown_links(model: Model, names: tuple[str, ...]) -> list[str]:
    """Names in a thing's `may_touch` that the robot has no link for."""
    return [name for name in names if name not in (*model.link_names, TOOL, *model.description.parts)]


def _thing(model: Model, thing: ThingSettings, robot: str) -> _Thing:
    solid, free = solid_of(thing.shape, thing.pose), thing.may_touch.get(robot, ())
    return _Thing(thing.name, solid, Barrier(solid, thing.margin_m, _kept_away(model, free)), thing.in_frame, free)


def solid_of(shape: Shape, place: PoseSettings) -> PlacedSolid:
    """The solid in world. Raises `cell.geometry.GeometryError`."""
    position = np.array(place.position_m)
    pose = pose_from(position, np.array(place.quaternion_xyzw))
    match shape:
        case BoxShape(size_m=size):
            return Box(np.array(size), pose)
        case HullShape(points_m=points):
            return Hull(np.array(points), pose)
        case SphereShape(radius_m=radius):
            return Sphere(position, radius)
        case CylinderShape(radius_m=radius, length_m=length):
            return Cylinder(radius, length, pose)
        case MeshShape(file=file, unit_m=unit):
            return Mesh.of_file(file, unit, pose)
        case HalfSpaceShape():
            return HalfSpace(pose)


def _kept_away(model: Model, free: tuple[str, ...]) -> NDArray[np.intp]:
    """The capsules of links that move and are not among those that may touch it."""
    moving = [number for number, capsule in enumerate(model.body) if capsule.link > 0]
    return np.array([number for number in moving if as_written(part_of(model, number)) not in free], dtype=np.intp)
