"""Which sections of two robots come nearer to each other than their margin (`docs/architecture.md`, section 4.5).

Boxes leave out what is surely far away; what is left is measured exactly (`cell.geometry.capsule_distance`). A section
is the same space whenever its id comes again, so what was measured of two sections is remembered by their ids.
"""

from collections import OrderedDict
from collections.abc import Callable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cell.geometry import Box, capsule_box_distance, capsule_distance
from cell.geometry.arrays import Array, Flags
from cell.messages.sections import Refusal, Sections, Single

_ASKED, _RESERVED = 128, 384
"""So many sections of a robot that asks are remembered with so many of another one."""
_BOUNDED = 1024
"""Of so many messages the bounds are remembered."""
_AT_ONCE = 2**15
"""So many pairs of capsules are looked at in one go, or those of one section."""
_ROUNDING_M = 1e-6
"""By so much a robot that stands may seem nearer when its sections are cut anew."""

Index = NDArray[np.intp]
Fixed = tuple[frozenset[int], frozenset[int]]
"""Capsules of either robot that never move."""


class Nearness:
    """What is too near to what, and by which links."""

    def __init__(
        self,
        margin_m: float,
        margins_m: Mapping[frozenset[str], float],
        fixed: Callable[[str], AbstractSet[int]],
        names: Callable[[str, int], str],
    ) -> None:
        """What robots keep from each other, and what is known of their capsules.

        Args:
            margin_m: for pairs of robots that `margins_m` does not have.
            margins_m: by the names of two robots.
            fixed: which of a robot's capsules never move: those of two robots may be as near as they are.
            names: what people call the link that a robot's capsule covers.
        """
        self._margin_m = margin_m
        self._margins_m = dict(margins_m)
        self._fixed = fixed
        self._names = names
        self._bounds: OrderedDict[tuple[str, bytes], list[float]] = OrderedDict()
        self._spare: dict[tuple[str, str], _Spare] = {}

    def first_too_near(self, robot: str, asked: Sections, other: str, reserved: Sections) -> tuple[int, Refusal] | None:
        """The first section of `asked` that comes nearer than the margin to one of `reserved`, and why; None: none.

        The refusal names the nearest two links of that section.
        """
        margin = self._margin(robot, other)
        if self._far(robot, asked, other, reserved, margin):
            return None
        fixed = frozenset(self._fixed(robot)), frozenset(self._fixed(other))
        spare = self._spare.get((robot, other))
        if spare is None or spare.fixed != fixed:
            spare = self._spare[robot, other] = _Spare(fixed, _ASKED, _RESERVED)
        if len(asked) > _ASKED or len(reserved) > _RESERVED:
            spare = _Spare(fixed, len(asked), len(reserved))
        found = spare.first_below(asked, reserved, margin)
        if found is None:
            return None
        one, its = found
        near = _near(asked[one : one + 1], reserved[its : its + 1], np.inf, fixed)
        if not len(near.distance):
            # They were measured when one of these ids was that of another space.
            return one, Refusal(other, f"a section of {robot} or {other} came again as another space")
        return one, self._refusal(robot, other, near, int(near.distance.argmin()), f"{1e3 * margin:g} mm are kept")

    def first_nearer(
        self, robot: str, asked: Sections, other: str, reserved: Sections, present: Sections
    ) -> tuple[int, Refusal] | None:
        """As `first_too_near`, for robots that are nearer than the margin already: they may part, never approach.

        Two links that are nearer where the robot is at `present` keep that distance instead of the margin. The refusal
        names the nearest two of those that do not.
        """
        margin = self._margin(robot, other)
        if self._far(robot, asked, other, reserved, margin):
            return None
        fixed = frozenset(self._fixed(robot)), frozenset(self._fixed(other))
        links, other_links = asked.radii.shape[1], reserved.radii.shape[1]
        kept = np.full((max(links, present.radii.shape[1]), other_links), margin)
        most = max(1, _AT_ONCE // reserved.radii.size // links)
        for start in range(0, len(present), 8 * most):  # all of them count, so more in one go
            near = _near(present[start : start + 8 * most], reserved, margin, fixed)
            np.minimum.at(kept, (near.link, near.other_link), near.distance - _ROUNDING_M)
        for start in range(0, len(asked), most):
            near = _near(asked[start : start + most], reserved, margin, fixed)
            wrong = np.flatnonzero(near.distance < kept[near.link, near.other_link])
            if len(wrong):
                first = near.section[wrong].min()
                wrong = wrong[near.section[wrong] == first]
                nearest = int(wrong[near.distance[wrong].argmin()])
                parts = kept[near.link[nearest], near.other_link[nearest]] < margin
                rule = (
                    f"nearer than {1e3 * margin:g} mm they may only part" if parts else f"{1e3 * margin:g} mm are kept"
                )
                return start + int(first), self._refusal(robot, other, near, nearest, rule)
        return None

    def too_near(self, robot: str, sections: Sections, other: str, others: Sections) -> Flags:
        """Which sections `(s,)` come nearer than the margin to which of the others `(t,)`: `(s, t)`."""
        table = np.zeros((len(sections), len(others)), dtype=bool)
        margin = self._margin(robot, other)
        if not table.size or self._far(robot, sections, other, others, margin):
            return table
        fixed = frozenset(self._fixed(robot)), frozenset(self._fixed(other))
        most = max(1, _AT_ONCE // others.radii.size // sections.radii.shape[1])
        for start in range(0, len(sections), most):
            near = _near(sections[start : start + most], others, margin, fixed)
            table[start + near.section, near.other_section] = True
        return table

    def first_in_reach(
        self, robot: str, asked: Sections, other: str, base: tuple[float, float, float], reach_m: float, why: str
    ) -> tuple[int, Refusal] | None:
        """The first section of `asked` within the margin of all that a robot can reach that may be anywhere there.

        `base`: of that robot in world [m]; `reach_m`: of its farthest point from there; `why` it may be anywhere.
        """
        sphere = np.array([base, base]), np.array(reach_m)
        distance = capsule_distance(asked.points.astype(float), asked.radii.astype(float), *sphere)
        return self._first_at(robot, distance, other, f"what {other} can reach, and {why}")

    def first_at_box(self, robot: str, asked: Sections, other: str, box: Box) -> tuple[int, Refusal] | None:
        """The first section of `asked` within the margin of the box to which an operator has confined a robot.

        Capsules that never move are left out: no motion brings them nearer to it.
        """
        distance = capsule_box_distance(asked.points.astype(float), asked.radii.astype(float), box)
        distance[:, [each for each in self._fixed(robot) if each < distance.shape[1]]] = np.inf
        kept = f"{1e3 * self._margin(robot, other):g} mm are kept"
        return self._first_at(robot, distance, other, f"the box to which {other} is confined; {kept}")

    def meets(self, robot: str, body: Sections, other: str, sections: Sections, within_m: float = 0.0) -> bool:
        """Whether a robot's body comes nearer than that to sections of another one; by default, whether they overlap.

        Two capsules that never move may be as near as they are.
        """
        fixed = frozenset(self._fixed(robot)), frozenset(self._fixed(other))
        return len(_near(body, sections, within_m, fixed).distance) > 0

    def _first_at(self, robot: str, distance: Array, other: str, where: str) -> tuple[int, Refusal] | None:
        """By the distance `(s, c)` of each capsule."""
        near = np.flatnonzero((distance <= self._margin(robot, other)).any(axis=1))
        if not len(near):
            return None
        first = int(near[0])
        link = int(distance[first].argmin())
        return first, self._told(robot, link, other, "", float(distance[first, link]), where)

    def _margin(self, robot: str, other: str) -> float:
        return self._margins_m.get(frozenset((robot, other)), self._margin_m)

    def _far(self, robot: str, asked: Sections, other: str, reserved: Sections, within: float) -> bool:
        """Whether boxes around all of either are enough to tell."""
        a, b = self._bounds_of(robot, asked), self._bounds_of(other, reserved)
        return (
            a[0] - within > b[3] or a[1] - within > b[4] or a[2] - within > b[5]
            or b[0] - within > a[3] or b[1] - within > a[4] or b[2] - within > a[5]
        )  # fmt: skip

    def _bounds_of(self, robot: str, sections: Sections) -> list[float]:
        """Least x, y and z of all capsules, then largest."""
        key = robot, sections.ids.tobytes()
        bounds = self._bounds.get(key)
        if bounds is None:
            if len(self._bounds) == _BOUNDED:
                self._bounds.popitem(last=False)
            bounds = self._bounds[key] = _around(_boxes(sections)).ravel().tolist()
        return bounds

    def _refusal(self, robot: str, other: str, near: "_Near", nearest: int, rule: str) -> Refusal:
        name = self._names(other, int(near.other_link[nearest]))
        where = f"where {other}'s {name} may be; {rule}"
        return self._told(robot, int(near.link[nearest]), other, name, float(near.distance[nearest]), where)

    def _told(self, robot: str, link: int, other: str, other_link: str, distance_m: float, where: str) -> Refusal:
        name = self._names(robot, link)
        comes = f"within {1e3 * distance_m:.1f} mm of" if distance_m > 0.0 else "into"
        return Refusal(other, f"{robot}'s {name} would come {comes} {where}", name, other_link, distance_m)


class _Spare:
    """How much farther than their margin sections of two robots are apart [m], where that was measured.

    Not exact where it is not below zero. Not a number: not measured.
    """

    def __init__(self, fixed: Fixed, rows: int, columns: int) -> None:
        """Of so many sections that were asked for, and so many that were reserved."""
        self.fixed = fixed
        self._table = np.full((rows, columns), np.nan, np.float32)
        self._rows: OrderedDict[int, int] = OrderedDict()
        self._columns: OrderedDict[int, int] = OrderedDict()

    def first_below(self, asked: Sections, reserved: Sections, margin: float) -> tuple[int, int] | None:
        """The first section with less than nothing to spare, and the one that is nearest to it."""
        at, other_at = _places(self._rows, asked.ids, self._table), _places(self._columns, reserved.ids, self._table.T)
        spare = self._table[at][:, other_at]
        most = _AT_ONCE // (asked.radii.shape[1] * reserved.radii.shape[1])
        while True:
            below = np.flatnonzero((spare < 0.0).any(axis=1))
            unknown = np.isnan(spare[: below[0] + 1] if len(below) else spare)
            some = np.flatnonzero(unknown.any(axis=1))
            if not len(some):
                return (int(below[0]), int(spare[below[0]].argmin())) if len(below) else None
            # In one go, from the front: sections of which what is unknown is the same.
            others = np.flatnonzero(unknown[some[0]])
            some = some[(unknown[some] == unknown[some[0]]).all(axis=1)][: max(1, most // len(others))]
            near = _near(asked[some], reserved[others], margin, self.fixed)
            measured = np.full((len(some), len(others)), np.inf, np.float32)
            np.minimum.at(measured, (near.section, near.other_section), (near.distance - margin).astype(np.float32))
            spare[np.ix_(some, others)] = measured
            self._table[np.ix_(at[some], other_at[others])] = measured


def _places(places: OrderedDict[int, int], ids: NDArray[np.uint64], table: Single) -> Index:
    """The rows of a table that sections have; new ones take those of the ones that were not there for longest."""
    found, new = [], []
    for each in ids.tolist():
        if each in places:
            places.move_to_end(each)
        else:
            places[each] = len(places) if len(places) < len(table) else places.popitem(last=False)[1]
            new.append(places[each])
        found.append(places[each])
    if new:
        table[new] = np.nan
    return np.array(found)


@dataclass(frozen=True, slots=True)
class _Near:
    """Pairs of capsules that are nearer than was asked for, `(k,)` each, and their distance [m]."""

    section: Index
    link: Index
    other_section: Index
    other_link: Index
    distance: Array


def _near(first: Sections, second: Sections, within: float, fixed: Fixed) -> _Near:
    """Of all capsules of two robots that are not both fixed."""
    a, b = _boxes(first), _boxes(second)
    ours = np.flatnonzero(_meet(a, _around(b)[:, :, None], within))
    theirs = np.flatnonzero(_meet(b, _around(a[:, :, ours])[:, :, None], within))
    meet = _meet(a[:, :, ours, None], b[:, :, None, theirs], within)
    links, other_links = first.radii.shape[1], second.radii.shape[1]
    meet &= _moves(ours % links, fixed[0])[:, None] | _moves(theirs % other_links, fixed[1])
    i, j = np.nonzero(meet)
    i, j = ours[i], theirs[j]
    if not len(i):
        return _Near(i, i, j, j, np.empty(0))
    distance = capsule_distance(*_capsules(first, i), *_capsules(second, j))
    near = np.flatnonzero(distance < within)
    i, j = i[near], j[near]
    return _Near(i // links, i % links, j // other_links, j % other_links, distance[near])


def _moves(links: Index, fixed: frozenset[int]) -> Flags:
    moves = np.ones(links.max(initial=-1) + 1, dtype=bool)
    moves[[each for each in fixed if each < len(moves)]] = False
    return moves[links]


def _capsules(sections: Sections, some: Index) -> tuple[Array, Array]:
    return sections.points.reshape(-1, 2, 3)[some].astype(float), sections.radii.ravel()[some].astype(float)


def _boxes(sections: Sections) -> Array:
    """Around each capsule: `(2, 3, s * c)`, lowest and highest corner."""
    ends, radii = sections.points.reshape(-1, 6).T.astype(float, order="C").reshape(2, 3, -1), sections.radii.ravel()
    return np.stack([np.minimum(*ends) - radii, np.maximum(*ends) + radii])


def _around(boxes: Array) -> Array:
    """The box around all of them: `(2, 3)`."""
    return np.stack([boxes[0].min(axis=1, initial=np.inf), boxes[1].max(axis=1, initial=-np.inf)])


def _meet(a: Array, b: Array, within: float) -> Flags:
    """Whether boxes are nearer than that along every axis."""
    return np.asarray(((a[0] - within <= b[1]) & (b[0] - within <= a[1])).all(axis=0))
