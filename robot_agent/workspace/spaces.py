"""Where one robot may be, how fast and how it may point: safe, forbidden and slow spaces, a cone for its tool."""

from collections.abc import Callable, Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.config.settings import BoxShape, HullShape, OrientationSettings, SpaceKind, SpaceSettings
from cell.geometry import Box, Convex, Hull, Room, SpaceOf, transform_points
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics import Model
from robot_agent.workspace.cover import STRETCH, Cover
from robot_agent.workspace.itself import named, part_of
from robot_agent.workspace.swept_body import Sweep
from robot_agent.workspace.things import Barrier, Barriers, solid_of
from robot_agent.workspace.zones import Crossing, half_steps, intervals


@dataclass(frozen=True, slots=True)
class Breach:
    """Where a motion leaves its safe spaces, enters a forbidden one, or tilts its tool too far."""

    tau: float
    """Where on the motion [s]."""
    text: str
    """For people, without where and when."""

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True, eq=False)
class _Rule:
    """A barrier, and how it is told."""

    barrier: Barrier
    broken: str
    """With `{who}` breaks it and by how much, `{missing}`."""
    hindrance: str
    """Likewise, of what is in the way of whom."""
    lever_m: float | None = None
    """Of a rule about an angle."""

    def breach(self, who: str, missing_m: float) -> str:
        """For people."""
        missing = f"{1000.0 * missing_m:.1f} mm"
        if self.lever_m is not None:
            missing = f"{np.degrees(2.0 * np.arcsin(min(missing_m / (2.0 * self.lever_m), 1.0))):.2f} deg"
        return self.broken.format(who=who, missing=missing)


class _Rules:
    """Rules that hold together."""

    def __init__(self, rules: list[_Rule]) -> None:
        self.all = rules
        self.barriers = Barriers([rule.barrier for rule in rules])

    def of(self, barrier: Barrier) -> _Rule:
        """The rule of one of its barriers."""
        return next(rule for rule in self.all if rule.barrier is barrier)


class Spaces:
    """All spaces of one robot, and the cone in which its tool points.

    They look at capsules of the body, and at more of radius 0: the TCP and, where there is a cone, a point on the
    pointing axis of the tool at a fixed distance from the origin, which moves on a sphere. So one way to look between
    samples serves all.
    """

    def __init__(
        self, model: Model, spaces: tuple[SpaceSettings, ...] = (), orientation: OrientationSettings | None = None
    ) -> None:
        """Raises `cell.geometry.GeometryError` for a mesh that is none, and for points that span nothing."""
        self._model = model
        self._spaces = spaces
        self._orientation = orientation
        self._lever_m = min(1.0, model.reach_m)
        """Of the point on the pointing axis: such that the bulge of the body bounds its own."""
        moving = np.array([number for number, capsule in enumerate(model.body) if capsule.link > 0], dtype=np.intp)
        self._watched = {SpaceOf.BODY: moving, SpaceOf.TCP: np.array([len(model.body)])}
        self._solids = {
            each.name: solid_of(each.shape, each.pose) for each in spaces if each.kind is not SpaceKind.SAFE
        }
        self._rules_by_off: dict[frozenset[str], _Rules] = {}
        self.inputs = {each.name: each.off_while for each in spaces if each.off_while is not None}
        """By space, the input that switches it off."""

    def of(self, model: Model) -> "Spaces":
        """The same for this robot with another tool or part."""
        return Spaces(model, self._spaces, self._orientation)

    def __bool__(self) -> bool:
        return bool(self._spaces) or self._orientation is not None

    def watched(self, body: Sweep, pose_world_base: Array, tcp: Array) -> Sweep:
        """A swept body with all that spaces look at, from the poses of the TCP in base at its samples `(m, 4, 4)`."""
        tool = self._tool(body.tcp, pose_world_base, tcp)
        points, steps = np.concatenate([body.points, tool], axis=1), tool[1:, :, 0] - tool[:-1, :, 0]
        chords = np.sqrt(np.einsum("mtk,mtk->mt", steps, steps))
        return Sweep(
            points,
            np.concatenate([body.radii, np.zeros(tool.shape[1])]),
            np.concatenate([body.chords, chords], axis=1),
            body.bulge,
            body.tcp,
        )

    def points(self, pose_world_base: Array, q: Array) -> Array:
        """What `watched` looks at, at joints `q` `(k, n)`: `(k, c', 2, 3)` in world."""
        links = self._model.links(q)
        body, tcp = transform_points(pose_world_base, self._model.capsules_of(links)), self._model.tcp_at(links[:, -1])
        place = transform_points(pose_world_base, tcp[:, :3, 3])
        return np.concatenate([body, self._tool(place, pose_world_base, tcp)], axis=1)

    def first_breach(
        self, path: Sweep, taus: Array, points_at: Callable[[Array], Array], off: Collection[str]
    ) -> Breach | None:
        """Where a motion first breaks a rule, to the exactness of `first_near`.

        Args:
            path: what is `watched`, at `taus` `(m,)` [s].
            points_at: `points` at path times `(k,)`.
            off: the spaces that are switched off.
        """
        rules = self._rules(off)
        found = rules.barriers.first_near(Cover.of(path, STRETCH), path, taus, points_at)
        if found is None:
            return None
        barrier, near = found
        return Breach(near.tau, rules.of(barrier).breach(self._who(barrier, near.column), max(near.missing_m, 0.0)))

    def breach_at(self, pose_world_base: Array, q: Array) -> str:
        """What a robot breaks that stands at `q` `(n,)`, with every space on but those with an input; else empty."""
        points, radii = self.points(pose_world_base, q[None]), self._model.capsule_radii
        radii = np.append(radii, np.zeros(points.shape[1] - len(radii)))
        for rule in self._rules(frozenset(self.inputs)).all:
            clear = rule.barrier.clearance(points, radii, np.inf)[0]
            if len(clear) and clear.min() < 0.0:
                return rule.breach(self._who(rule.barrier, int(clear.argmin())), -float(clear.min()))
        return ""

    def in_the_way(self, path: Sweep, off: Collection[str], cover: Cover | None = None) -> str:
        """Which rule `watched` samples close to one another break, for people; empty for none.

        As `Things.in_the_way`: who breaks one already may go where he does so no more than that.
        `cover`: `Cover.of_block` of this path, for who has it already.
        """
        rules = self._rules(off)
        found = rules.barriers.blocked(Cover.of_block(path) if cover is None else cover, path)
        if found is None:
            return ""
        barrier, column = found
        return rules.of(barrier).hindrance.format(who=self._who(barrier, column))

    @property
    def slow(self) -> bool:
        """Whether there are spaces in which the TCP is slow."""
        return any(each.kind is SpaceKind.SLOW for each in self._spaces)

    def haste(self, pose_world_base: Array, q: Array, qd: Array, off: Collection[str]) -> Array:
        """By how much the TCP is too fast in slow spaces: its speed by what is allowed there, `(m,)`, elsewhere 0.

        `q`, `qd` `(m, n)` are consecutive samples. What lies within half a step of a sample counts for it.
        """
        place = (pose_world_base @ self._model.forward(q))[:, :3, 3]
        steps = np.linalg.norm(np.diff(place, axis=0), axis=-1)
        around = np.maximum(np.append(steps, 0.0), np.append(0.0, steps)) / 2.0
        velocity = (self._model.jacobian(q)[..., :3, :] @ qd[..., None])[..., 0]
        speed, points = np.linalg.norm(velocity, axis=-1), np.repeat(place[:, None], 2, axis=1)
        haste = np.zeros(len(q))
        for each in self._spaces:
            if each.speed_m_s is not None and each.name not in off:
                inside = self._solids[each.name].capsule_distance(points, np.zeros(len(q))) < around + each.margin_m
                haste = np.where(inside, np.maximum(haste, speed / each.speed_m_s), haste)
        return haste

    def switched_by_input(self, path: Sweep, taus: Array) -> tuple[Crossing, ...]:
        """Where on a motion spaces are entered and left that an input switches; both ends are outside."""
        return tuple(
            Crossing(name, enter, leave)
            for name in self.inputs
            for enter, leave in intervals(_touched(self._forbidden(name), path), taus)
        )

    def _rules(self, off: Collection[str]) -> _Rules:
        key = frozenset(off)
        if key not in self._rules_by_off:
            self._rules_by_off[key] = _Rules(self._made(key))
        return self._rules_by_off[key]

    def _made(self, off: frozenset[str]) -> list[_Rule]:
        forbidden = (each.name for each in self._spaces if each.kind is SpaceKind.FORBIDDEN)
        rules = [_forbids(self._forbidden(name), name) for name in forbidden if name not in off]
        for of in SpaceOf:
            safe = [each for each in self._spaces if each.kind is SpaceKind.SAFE and each.of is of]
            if safe:
                rules.append(_keeps_in([each for each in safe if each.name not in off], self._watched[of]))
        if self._orientation is not None:
            pointing = np.array([len(self._model.body) + 1])
            rules.append(_keeps_pointing(self._orientation, self._lever_m, pointing))
        return rules

    def _forbidden(self, name: str) -> Barrier:
        space = next(each for each in self._spaces if each.name == name)
        return Barrier(self._solids[name], space.margin_m, self._watched[space.of])

    def _tool(self, place: Array, pose_world_base: Array, pose_base_tcp: Array) -> Array:
        """TCP, from its place in world `(k, 3)`, and pointing axis where there is a cone: `(k, 1 or 2, 2, 3)`."""
        if self._orientation is None:
            return np.repeat(place[:, None, None], 2, axis=2)
        axis = self._lever_m * pose_base_tcp[:, :3, self._orientation.axis] @ pose_world_base[:3, :3].T
        return np.repeat(np.stack([place, axis], axis=1)[:, :, None], 2, axis=2)

    def _who(self, barrier: Barrier, column: int) -> str:
        capsule, body = int(barrier.capsules[column]), len(self._model.body)
        if capsule >= body:
            return "the TCP" if capsule == body else "the tool"
        return named(part_of(self._model, capsule))


@dataclass(frozen=True, slots=True, eq=False)
class _Cone:
    """Directions too far from `towards`, as a solid for points on a sphere of radius `lever_m`.

    Distances are straight, not along the sphere, so nothing on it comes nearer faster than it moves.
    """

    towards: Array
    within_rad: float
    lever_m: float

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:  # noqa: ARG002
        """As `Solid`."""
        axis = points[..., 0, :] / self.lever_m
        apart, along = (np.linalg.norm(axis + sign * self.towards, axis=-1) for sign in (-1.0, 1.0))
        angle = 2.0 * np.arctan2(apart, along)
        return np.asarray(2.0 * self.lever_m * np.sin((self.within_rad - angle) / 2.0) - radii)

    def bounds(self) -> None:
        """As `Solid`."""


class _Everywhere:
    """Nothing is far from it: the outside of no space at all."""

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:  # noqa: ARG002
        """As `Solid`."""
        return np.broadcast_to(-1.0, np.shape(points)[:-2]) - radii

    def bounds(self) -> None:
        """As `Solid`."""


def _forbids(barrier: Barrier, name: str) -> _Rule:
    margin = _millimetres(barrier.margin_m)
    broken = f"{{who}} comes up to {{missing}} too near to forbidden space {name} (margin {margin})"
    return _Rule(barrier, broken, f"forbidden space {name} is in the way of {{who}}")


def _keeps_in(on: list[SpaceSettings], watched: NDArray[np.intp]) -> _Rule:
    """The rule of the safe spaces that are on, which one robot has for its body or for its TCP."""
    if not on:
        none = "none of the robot's safe spaces is on: SPACE, the name of one, ON"
        return _Rule(Barrier(_Everywhere(), 0.0, watched), none, none)
    least = min(each.margin_m for each in on)
    room = Room(tuple(_convex(each) for each in on), tuple(each.margin_m - least for each in on))
    names = f"safe space{'' if len(on) == 1 else 's'} {', '.join(each.name for each in on)}"
    broken = f"{{who}} comes up to {{missing}} too far out of {names} (margin {_millimetres(least)})"
    return _Rule(Barrier(room, least, watched), broken, f"the border of {names} is in the way of {{who}}")


def _keeps_pointing(orientation: OrientationSettings, lever_m: float, pointing: NDArray[np.intp]) -> _Rule:
    cone = _Cone(np.array(orientation.towards), orientation.within_rad, lever_m)
    allowed, axis = f"{np.degrees(orientation.within_rad):g} deg", "XYZ"[orientation.axis]
    broken = f"{axis} of {{who}} points up to {{missing}} too far away from its direction (allowed {allowed})"
    hindrance = f"{axis} of {{who}} at its limit of {allowed} from its direction"
    return _Rule(Barrier(cone, 0.0, pointing), broken, hindrance, lever_m)


def _convex(space: SpaceSettings) -> Convex:
    match solid_of(space.shape, space.pose):
        case Box() as box:
            return Convex.of_box(box)
        case Hull(convex=convex):
            return convex
    shapes = f"{BoxShape.__name__} and {HullShape.__name__}"
    raise ValueError(f"safe space {space.name}: {type(space.shape).__name__} found, allowed are {shapes}")


def _touched(barrier: Barrier, path: Sweep) -> Flags:
    """Samples `(m,)` around which, up to half a step to either side, a barrier may be too near."""
    around = half_steps(path)[:, barrier.capsules]
    clear = barrier.clearance(path.points, path.radii, float(around.max(initial=0.0)) + 1e-3)
    return np.asarray((clear < around).any(axis=-1))


def _millimetres(length_m: float) -> str:
    return f"{1000.0 * length_m:g} mm"
