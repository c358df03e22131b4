"""The coordination diagram of two robots: how far the one is on its way against how far the other one is.

Each axis counts pieces of a robot's planned way (`PlannedWay`), on through all its plans. Where a piece of the one is
nearer than the margin to a piece of the other, the diagram is closed: both are never there together.
"""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from html import escape
from itertools import combinations

import numpy as np

from cell.config.settings import SeparationSettings
from cell.geometry import capsule_distance
from cell.geometry.arrays import Array, Flags
from cell.messages import PlannedWay, Presence
from cell.messages.common import Name
from cell.messages.sections import NO_PIECE, Sections
from cell.view.newest import Newest

BEHIND = 25
"""So many pieces of the way taken are shown."""
_MOST_TAKEN = 400
_JUMP = 20
"""No robot passes so many pieces from one look to the next: one was not heard meanwhile, or a recording was wound."""
_SOON = 5
"""Pieces by which a robot may be ahead of, or behind, what it told last."""
_WIDTH, _HEIGHT, _LEFT, _TOP = 380.0, 260.0, 22.0, 6.0
_NOTE = "padding:0 10px;margin:0 8px 8px;font-size:12px;line-height:1.45"
_CLOSED, _OWNED, _TAKEN = "#fca5a5", "#2563eb", "#111827"

Pair = tuple[Name, Name]


@dataclass(slots=True)
class _Along:
    """Where one robot is on its way; pieces are counted on from plan to plan."""

    plan: PlannedWay | None = None
    began: int = 0
    """The count of the plan's first piece."""
    at: int = 0
    """The piece in which it is measured."""
    may: int = 0
    """The last piece that it may use."""
    fixed: frozenset[int] = frozenset()
    """Capsules that never move."""
    ways: int = 0
    """Grows where a plan does not go on from the one before."""

    def hear(self, plan: PlannedWay | None, presence: Presence | None) -> None:
        if plan is None or presence is None:
            self.plan = None
            return
        if self.plan is None or _number(plan) != _number(self.plan):
            self._go_on(plan)
        way = presence.way
        pieces = [each for each in way.pieces.tolist() if each != NO_PIECE] if way.plan == plan.number else []
        if pieces and pieces[0] < len(plan.pieces):
            owned = {each for each in way.pieces[: way.owned].tolist() if each != NO_PIECE}
            self.at = self.began + self._here(plan, pieces[0])
            self.may = self.at + max(len(owned) - 1, 0)
        self.fixed = frozenset(way.fixed)

    def _here(self, plan: PlannedWay, told: int) -> int:
        """The piece that is told, or the nearest that is the same space: a program may come by again."""
        same = np.flatnonzero(plan.pieces.ids == plan.pieces.ids[told])
        here = self.at - self.began
        ahead = same[same >= here - _SOON]
        return int(ahead[np.abs(ahead - here).argmin()]) if len(ahead) else told

    def _go_on(self, plan: PlannedWay) -> None:
        """A plan begins with the motion that runs now, which the one before had too, or is a new way."""
        before, after = self.plan.pieces.ids if self.plan is not None else plan.pieces.ids[:0], plan.pieces.ids
        here = self.at - self.began
        common = [i for i in range(len(before)) if np.array_equal(before[i:][: len(after)], after[: len(before) - i])]
        if common:
            # A program that repeats itself has the same pieces again: the motion that runs began not far ahead.
            self.began += max((i for i in common if i <= here + _SOON), default=common[0])
        else:
            self.began = self.at = self.may = 0
            self.ways += 1
        self.plan = plan


def _number(plan: PlannedWay) -> tuple[Name, int, int]:
    return plan.boot, plan.owner, plan.number


@dataclass(slots=True)
class _Two:
    """What is kept of a pair."""

    ways: tuple[int, int] = (0, 0)
    taken: deque[tuple[int, int]] = field(default_factory=lambda: deque(maxlen=_MOST_TAKEN))
    of: object = None
    closed: Flags = field(default_factory=lambda: np.zeros((0, 0), bool))


@dataclass(frozen=True, slots=True, eq=False)
class Diagram:
    """Of a pair, as it is now. Places are counts of pieces, of the first robot and of the second."""

    pair: Pair
    began: tuple[int, int]
    """The first planned pieces: those of `closed[0, 0]`."""
    closed: Flags
    """`(n, m)`: which piece of the first is too near to which of the second."""
    at: tuple[int, int]
    may: tuple[int, int]
    """How far they are let in."""
    taken: tuple[tuple[int, int], ...]
    """The way that both have taken together, the oldest first."""


class Diagrams:
    """Follows all robots of a cell that keeps them apart; says the diagram of a pair."""

    def __init__(self, robots: tuple[Name, ...], separation: SeparationSettings | None) -> None:
        self._separation = separation
        self._robots = {name: _Along() for name in robots}
        self._pairs = {pair: _Two() for pair in combinations(robots, 2)} if separation is not None else {}

    @property
    def pairs(self) -> tuple[Pair, ...]:
        """Those that have a diagram."""
        return tuple(self._pairs)

    def look(self, seen: Newest) -> None:
        """Take where the robots are now."""
        if not self._pairs:
            return
        plans, presences = seen.of(PlannedWay), seen.of(Presence)
        for name, along in self._robots.items():
            along.hear(plans.get(name), presences.get(name))
        for (one, other), two in self._pairs.items():
            first, second = self._robots[one], self._robots[other]
            ways, here = (first.ways, second.ways), (first.at, second.at)
            if ways != two.ways:
                two.ways = ways
                two.taken.clear()
            if two.taken and max(abs(a - b) for a, b in zip(two.taken[-1], here, strict=True)) > _JUMP:
                two.taken.clear()
            if not two.taken or two.taken[-1] != here:
                two.taken.append(here)

    def without_plan(self, pair: Pair) -> tuple[Name, ...]:
        """The robots of a pair that have no way planned: there is no diagram."""
        return tuple(name for name in pair if (plan := self._robots[name].plan) is None or not len(plan.pieces))

    def of(self, pair: Pair) -> Diagram | None:
        """The diagram of a pair; None where one of them has no way planned."""
        first, second = (self._robots[name] for name in pair)
        if first.plan is None or second.plan is None or self._separation is None or self.without_plan(pair):
            return None
        two = self._pairs[pair]
        made_of = _number(first.plan), _number(second.plan)
        if two.of != made_of:
            margin = self._separation.margin_of(*pair)
            fixed = first.fixed, second.fixed
            two.of, two.closed = made_of, too_near(first.plan.pieces, second.plan.pieces, margin, fixed)
        at, may = (first.at, second.at), (first.may, second.may)
        return Diagram(pair, (first.began, second.began), two.closed, at, may, tuple(two.taken))


def too_near(first: Sections, second: Sections, margin_m: float, fixed: tuple[frozenset[int], frozenset[int]]) -> Flags:
    """Which pieces `(n,)` come nearer than the margin to which of the others `(m,)`: `(n, m)`.

    `fixed`: the capsules of either robot that never move; two of them may be as near as they are.
    """
    a, b = _boxes(first, margin_m), _boxes(second, 0.0)
    i, k = np.nonzero(
        _meet((a[0].min(axis=1)[:, None], a[1].max(axis=1)[:, None]), (b[0].min(axis=1), b[1].max(axis=1)))
    )
    meet = _meet((a[0][i][:, :, None], a[1][i][:, :, None]), (b[0][k][:, None], b[1][k][:, None]))
    still = [
        [each in own for each in range(each_of.radii.shape[1])]
        for own, each_of in zip(fixed, (first, second), strict=True)
    ]
    meet &= ~(np.array(still[0])[:, None] & np.array(still[1]))
    which, link, other = np.nonzero(meet)
    i, k = i[which], k[which]
    ends = first.points[i, link].astype(float), second.points[k, other].astype(float)
    distance = capsule_distance(
        ends[0], first.radii[i, link].astype(float), ends[1], second.radii[k, other].astype(float)
    )
    closed = np.zeros((len(first), len(second)), dtype=bool)
    near = distance < margin_m
    closed[i[near], k[near]] = True
    return closed


def _boxes(sections: Sections, grown_m: float) -> tuple[Array, Array]:
    """Lowest and highest corners `(n, c, 3)` around capsules."""
    points, grown = sections.points.astype(float), (sections.radii.astype(float) + grown_m)[..., None]
    return points.min(axis=2) - grown, points.max(axis=2) + grown


def _meet(a: tuple[Array, Array], b: tuple[Array, Array]) -> Flags:
    return np.asarray(((a[0] <= b[1]) & (b[0] <= a[1])).all(axis=-1))


def shown(diagrams: Diagrams, pair: Pair) -> str:
    """The diagram of a pair with what its colours mean, as HTML; who has no way planned, where there is none."""
    diagram = diagrams.of(pair)
    if diagram is None:
        return f"<div style='{_NOTE}'>{escape(' and '.join(diagrams.without_plan(pair)))}: no way planned</div>"
    one, other = map(escape, pair)
    legend = f"Red: {one} and {other} would be too near to each other. Blue: how far both are let in. Black: their way."
    return f"<div style='{_NOTE}'>{svg(diagram)}{legend}</div>"


def svg(diagram: Diagram) -> str:
    """The diagram as a picture for a page: the first robot goes on to the right, the second one upwards."""
    low = tuple(min(began, max(at - BEHIND, 0)) for began, at in zip(diagram.began, diagram.at, strict=True))
    high = tuple(began + count for began, count in zip(diagram.began, diagram.closed.shape, strict=True))
    sx, sy = _WIDTH / max(high[0] - low[0], 1), _HEIGHT / max(high[1] - low[1], 1)

    def x(piece: float) -> str:
        return f"{_LEFT + (piece - low[0]) * sx:.1f}"

    def y(piece: float) -> str:
        return f"{_TOP + _HEIGHT - (piece - low[1]) * sy:.1f}"

    def box(left: float, bottom: float, wide: float, high: float) -> str:
        return f"M{x(left)} {y(bottom)}h{wide * sx:.1f}v{-high * sy:.1f}h{-wide * sx:.1f}z"

    began_a, began_b = diagram.began
    closed = "".join(box(began_a + begin, began_b + row, end - begin, 1) for row, begin, end in _runs(diagram.closed))
    taken = " ".join(f"{x(a + 0.5)},{y(b + 0.5)}" for a, b in diagram.taken if a >= low[0] and b >= low[1])
    (a, b), (to_a, to_b) = diagram.at, diagram.may
    let_in = box(a, b, max(to_a + 1 - a, 1), max(to_b + 1 - b, 1))
    one, other = (f"{escape(name)} goes on &rarr;" for name in diagram.pair)
    right, bottom = _LEFT + _WIDTH, _TOP + _HEIGHT
    return (
        f"<svg viewBox='0 0 {right + 4:.0f} {bottom + 22:.0f}' style='width:100%' font-size='12'>"
        f"<rect x='{_LEFT}' y='{_TOP}' width='{_WIDTH}' height='{_HEIGHT}' fill='none' stroke='#94a3b8'/>"
        f"<path d='{closed}' fill='{_CLOSED}'/>"
        f"<path d='{let_in}' fill='{_OWNED}' fill-opacity='.15' stroke='{_OWNED}'/>"
        f"<polyline points='{taken}' fill='none' stroke='{_TAKEN}' stroke-width='1.5'/>"
        f"<circle cx='{x(a + 0.5)}' cy='{y(b + 0.5)}' r='3.5' fill='{_TAKEN}'/>"
        f"<text x='{right}' y='{bottom + 16}' text-anchor='end' fill='currentColor'>{one}</text>"
        f"<text transform='translate({_LEFT - 8} {_TOP}) rotate(-90)' text-anchor='end' "
        f"fill='currentColor'>{other}</text>"
        "</svg>"
    )


def _runs(closed: Flags) -> Iterator[tuple[int, int, int]]:
    """Of each piece of the second robot the stretches of the first one's that are closed: piece, begin, end."""
    for row in range(closed.shape[1]):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], closed[:, row], [False]]).astype(np.int8)))
        for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
            yield row, begin, end
