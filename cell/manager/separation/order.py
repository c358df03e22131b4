"""Who goes first: robots that share room are let in only as far as all of them can still get through.

Clearing alone is no order: two robots that are both let in as far as nothing is in their way may end up nose to nose,
each in the other's way out. So what is cleared is cut further until the cell is *safe*. A *bay* is a piece of a robot's
way where nobody still has to pass. The cell is safe when some robot can go to a bay, or to the end of all that it has
planned, while the others stand at the ends of what they own; then another one, while that one stands there; and so on
until all are at their ends (the safe states of Dijkstra's banker, on ways instead of money). To go to a bay is never
wrong: who stands there is in nobody's way. Where some cannot get to their ends already, what is cleared makes them no
more; two that want to end at one place are let on as far as geometry lets them.

An exclusive zone is room that robots share, too. Pieces that lead through one are too near to each other, and so is any
place of a robot that was granted it and has still to pass through. So a zone is granted as room is cleared: only as far
as the cell stays safe.

Whose turn it is (`turn.py`) goes before all who need not get through before it: what is cleared for them keeps them out
of its way, and out of the way of those before it.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Flags
from cell.messages import PlannedWay, Presence, Refusal, Sections
from cell.messages.sections import NO_PIECE, Stay
from cell.net.freshness import NewestOf

_FREE = -1
_MOST_TRIES = 200
"""Of orders in which robots may go, where it matters."""
_MOST_KNOWN = 16
"""Of what two plans have in common, by where their robots are in zones."""


class Conflicts(Protocol):
    """What is too near to what."""

    def too_near(self, robot: str, sections: Sections, other: str, others: Sections) -> Flags:
        """Which sections `(s,)` come too near to which of the others `(t,)`: `(s, t)`."""


class _Keeps:
    """From which pieces of its plan a robot keeps others out of zones.

    In its first piece of several it may still stand in front of the zone. Where its plan ends in there it may go on and
    out: who is granted the zone next must wait for that, and nobody before.
    """

    def __init__(self, plan: PlannedWay | None, places: Mapping[Stay, int | None]) -> None:
        """`places`: its stays; for one in a zone that it does not hold, the piece up to which it is not in there."""
        self.plan = plan
        self.pieces: dict[str, Flags] = {}
        """By zone."""
        end = -1 if plan is None else len(plan.pieces) - 1
        for stay, outside in places.items():
            pieces = self.pieces.setdefault(stay.zone, np.zeros(end + 1, dtype=bool))
            first = max(stay.first + (0 < stay.first < stay.last), outside + 1) if outside is not None else 0
            pieces[first : stay.last + (stay.last < end)] = True


@dataclass(frozen=True, slots=True, eq=False)
class _Beside:
    """Where a robot is, by its newest presence, and where it wants to be."""

    has: Sections
    wants: Sections


@dataclass(slots=True)
class _Robot:
    newest: NewestOf = field(default_factory=NewestOf)
    coming: PlannedWay | None = None
    """The newest plan, which no presence has counted in yet."""
    plan: PlannedWay | None = None
    """What its presences count in."""
    number: int = 0
    """Of the plan that its newest presence counts in, heard or not; 0: none."""
    is_on_plan: bool = False
    """Its newest presence counts in `plan`."""
    at: int = 0
    """The piece at the end of what it may use."""
    back: int = 0
    """The piece that it is in by what is measured of it."""
    beside: "_Beside | None" = None
    """Where it is in no piece of its plan: it returns to its path, or has none."""
    keeps: _Keeps = field(default_factory=lambda: _Keeps(None, {}))
    known_keeps: dict[tuple[int | None, ...], _Keeps] = field(default_factory=dict)
    """Of its plan, by where it is in its stays: it is tried out what a grant would change."""

    @property
    def end(self) -> int:
        return 0 if self.plan is None else len(self.plan.pieces) - 1

    def look_at_zones(self, holders: Mapping[str, str | None], held: Collection[str]) -> None:
        """Know from where it keeps others out of the zones that there are, `held` being its own."""
        stays = [] if self.plan is None else [stay for stay in self.plan.stays if stay.zone in holders]
        places: dict[Stay, int | None] = {}
        had: set[str] = set()
        for stay in stays:
            if stay.zone in held and stay.zone not in had and stay.last >= self.back:
                had.add(stay.zone)
                places[stay] = None
            else:
                places[stay] = self.at if stay.first <= self.at <= stay.last and stay.zone not in held else -1
        if self.keeps.plan is not self.plan or len(self.known_keeps) > _MOST_KNOWN:
            self.known_keeps = {}
        key = tuple(places.values())
        if key not in self.known_keeps:
            self.known_keeps[key] = _Keeps(self.plan, places)
        self.keeps = self.known_keeps[key]


@dataclass(frozen=True, slots=True, eq=False)
class _Near:
    """Which pieces of two plans are too near to each other."""

    plan: PlannedWay
    its_plan: PlannedWay
    bodies: Flags
    """`(s, t)`: without zones."""
    _tables: dict[tuple[_Keeps, _Keeps], tuple[NDArray[np.intp], Flags]] = field(default_factory=dict)

    def tables(self, mine: _Keeps, its: _Keeps) -> tuple[NDArray[np.intp], Flags]:
        """For each piece of the second plan the last one of the first that is too near to it; and all that are."""
        if (mine, its) not in self._tables:
            if len(self._tables) > _MOST_KNOWN:
                self._tables.clear()
            near = self.bodies
            for zone in mine.pieces.keys() & its.pieces.keys():
                near = near | np.logical_and.outer(mine.pieces[zone], its.pieces[zone])
            last = len(near) - 1 - near[::-1].argmax(axis=0) if len(near) else np.zeros(near.shape[1], np.intp)
            self._tables[mine, its] = np.where(near.any(axis=0), last, _FREE), near
        return self._tables[mine, its]


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """Room that a robot shares with another one."""

    other: str
    last: NDArray[np.intp]
    """For each piece of the robot's way the last one of the other's that is too near to it; `_FREE`: none."""
    near: Flags
    """`(t, s)`: which of the other's pieces are too near to which of its own."""


class Order:
    """The planned ways of all robots, and how far they have been let in."""

    def __init__(self, conflicts: Conflicts) -> None:
        self._conflicts = conflicts
        self.turn = ""
        """The robot whose turn it is; empty: nobody's."""
        self._robots: dict[str, _Robot] = {}
        self._near: dict[tuple[str, str], _Near] = {}
        """By two robots, for their plans."""
        self._shares: dict[str, list[_Shared]] = {}
        """By robot, while nobody's plan and zones change: with whom it shares room at all."""
        self._known_stuck: dict[tuple[tuple[str, int], ...], list[str]] = {}
        """By where all stand, while nobody's plan and zones change."""
        self._holders: Mapping[str, str | None] = {}
        """All zones by name, and who has them."""
        self._answers: dict[tuple[str, ...], tuple[object, Refusal | None]] = {}
        """By robot and the zones that it waits for: all that the newest answer goes by, and the answer."""

    def planned(self, way: PlannedWay) -> None:
        """Take a plan, unless it is older than the newest one."""
        robot = self._robots.setdefault(way.robot, _Robot())
        if robot.newest.accept(way.boot, way.owner, way.number):
            robot.coming = way

    def hear(self, presence: Presence, reserved: Mapping[int, int]) -> None:
        """Where a robot is on its planned way, by a presence that was taken.

        `reserved`: the pieces of the sections that it may use, by their ids, as far as they were told.
        """
        robot, way = self._robots.setdefault(presence.robot, _Robot()), presence.way
        coming = robot.coming
        if coming is not None and _counts_in(coming, presence):
            robot.plan, robot.coming = coming, None
        plan, robot.number = robot.plan, way.plan
        is_on_its_way = bool((way.pieces[: way.owned] != NO_PIECE).any())
        robot.beside = None if is_on_its_way else _Beside(way.sections[: way.owned], way.sections[way.owned :])
        if plan is not None and (way.plan == 0 or plan.owner != presence.owner):
            plan = robot.plan = None
        robot.is_on_plan = plan is not None and _counts_in(plan, presence)
        if robot.is_on_plan:
            mine = [piece for piece in reserved.values() if piece != NO_PIECE]
            robot.at = min(max(mine, default=0), robot.end)
            used = [piece for piece in way.pieces[: way.committed].tolist() if piece != NO_PIECE]
            robot.back = min(min(used, default=robot.at), robot.end)
        self._look_at_zones(presence.robot)

    def plans(self, robot: str) -> bool:
        """Whether a robot has a planned way."""
        return robot in self._positions()

    def leave_out(self, robot: str) -> None:
        """A robot that does not go on is in nobody's order, until its presences count in a plan again."""
        mine = self._robots.setdefault(robot, _Robot())
        mine.coming, mine.plan, mine.number, mine.beside = mine.coming or mine.plan, None, 0, None
        self._look_at_zones(robot)

    def hold(self, holders: Mapping[str, str | None]) -> None:
        """Who has which of all zones by now, by its name."""
        if holders != self._holders:
            self._holders = dict(holders)
            for robot in self._robots:
                self._look_at_zones(robot)

    def _look_at_zones(self, robot: str) -> None:
        self._keep_others_out(robot, {zone for zone, holder in self._holders.items() if holder == robot})

    def _keep_others_out(self, robot: str, held: Collection[str]) -> None:
        mine = self._robots[robot]
        before = mine.keeps
        mine.look_at_zones(self._holders, held)
        if mine.keeps is not before:
            self._shares.clear()
            self._known_stuck.clear()

    def why_not_grant(self, robot: str, zones: Sequence[str], going: Collection[str]) -> Refusal | None:
        """Who must get through before a robot has these zones; None: nobody, or it has no planned way.

        `going`: for whom it is to wait if need be. Who is silent keeps nobody out of a zone that is free.
        """
        mine = self._robots.get(robot)
        if mine is None or mine.number == 0:
            return None
        if not self.knows(robot, mine.number):
            return Refusal("", f"what {robot} has planned has not been heard yet")
        standing = {each: at for each, at in self._positions().items() if each in going or each == robot}
        basis = self.turn, standing, {each: self._robots[each].keeps for each in standing}
        key = robot, *zones
        if self._answers.get(key, (None, None))[0] != basis:
            if len(self._answers) > _MOST_KNOWN * len(self._robots):
                self._answers.clear()
            self._answers[key] = basis, self._why_not_now(robot, zones, standing)
        return self._answers[key][1]

    def _why_not_now(self, robot: str, zones: Sequence[str], standing: Mapping[str, int]) -> Refusal | None:
        already, was_before = self._stuck(standing), self._is_before_the_next(robot, standing)
        with self._holding(robot, zones):
            stuck, is_before = self._stuck(standing), self._is_before_the_next(robot, standing)
        if is_before and not was_before:
            why = f"{self.turn}, which has waited for long, must get through before {robot}"
            return self._waits_for(self.turn, robot, why, standing)
        if len(stuck) <= len(already):
            return None
        other = next((each for each in stuck if each != robot and each not in already), robot)
        return self._waits_for(other, robot, f"{other} must get through before {robot}", standing)

    def _is_before_the_next(self, robot: str, standing: Mapping[str, int]) -> bool:
        """Whether the robot whose turn it is waits for this one."""
        return self.turn in standing and self.turn != robot and robot in self._before(self.turn, standing)

    def knows(self, robot: str, plan: int) -> bool:
        """Whether the plan with this number is what the order goes by."""
        mine = self._robots.get(robot)
        return mine is not None and mine.plan is not None and mine.is_on_plan and mine.plan.number == plan

    def admitted(self, robot: str, pieces: Sequence[int]) -> tuple[int, Refusal | None]:
        """How many of the sections in these pieces of its plan a robot may be cleared, and who is in the way."""
        standing = self._positions()
        if robot not in standing or not pieces or not self._shared_by(robot):
            return len(pieces), None
        already = self._stuck(standing)
        count, refusal = self._out_of_the_way_of_the_next(robot, pieces, standing)
        while count > 0:
            last = max((piece for piece in pieces[:count] if piece != NO_PIECE), default=standing[robot])
            stuck = self._stuck(standing | {robot: max(last, standing[robot])})
            if len(stuck) <= len(already):
                return count, refusal
            others = sorted(
                (each for each in stuck if each != robot),
                key=lambda each: (self._last_near(each, robot)[last] <= standing[each], each in already),
            )
            other = others[0] if others else robot
            why = f"{robot} would be in the way of {other}, which must get through first"
            refusal = self._waits_for(other, robot, why, standing)
            count = next((k for k, piece in enumerate(pieces[:count]) if piece == last), 0)
        return 0, refusal

    def let_in(self, robot: str, pieces: Sequence[int]) -> None:
        """A robot was cleared sections in these pieces of its plan: it may be there before it says so."""
        mine = self._robots[robot]
        cleared = max((piece for piece in pieces if piece != NO_PIECE), default=mine.at)
        mine.at = min(max(cleared, mine.at), max(mine.end, 0))
        self._look_at_zones(robot)

    def _out_of_the_way_of_the_next(
        self, robot: str, pieces: Sequence[int], standing: Mapping[str, int]
    ) -> tuple[int, Refusal | None]:
        """How many of these pieces a robot may enter and need not get through before the one whose turn it is.

        One that must get through before it anyway may go on, until that is no longer so.
        """
        if self.turn not in standing or self.turn == robot:
            return len(pieces), None
        here, before = standing[robot], self._is_before_the_next(robot, standing)
        for count, piece in enumerate(pieces):
            if piece == NO_PIECE or piece <= here:
                continue
            here, was_before = piece, before
            before = self._is_before_the_next(robot, {**standing, robot: here})
            if before and not was_before:
                why = f"{robot} would be in the way of {self.turn}, which has waited for long and goes first"
                return count, self._waits_for(self.turn, robot, why, standing)
        return len(pieces), None

    def _waits_for(self, other: str, robot: str, why: str, standing: Mapping[str, int]) -> Refusal:
        """It names one that can go on at once, so no circle is told of where there is none."""
        able = self.goes_first(other) or [each for each in standing if self._farthest_bay(each, standing) is not None]
        first = min((each for each in able if each != robot), default=other)
        return Refusal(first, why if first == other else f"{why}, after {first}")

    def before(self, robot: str) -> set[str]:
        """Who must leave its place before a robot can go to where nobody still has to pass."""
        standing = self._positions()
        return self._before(robot, standing) if robot in standing else set()

    def goes_first(self, robot: str) -> list[str]:
        """Who of these waits for nobody; where there is nobody before it, the robot itself.

        Empty: it has no planned way, or they wait for each other, until somebody else has passed.
        """
        before = self.before(robot)
        if not before:
            return [robot] if self.plans(robot) else []
        return sorted(each for each in before if not self.before(each))

    def is_clear(self, robot: str) -> bool:
        """Whether nobody still has to pass where a robot is, at the end of what it may use."""
        standing = self._positions()
        return robot not in standing or not any(
            self._last_near(other, robot)[standing[robot]] >= at for other, at in standing.items() if other != robot
        )

    def look_further(self, robot: str) -> bool:
        """Whether a robot shares room with another one, by what is known of their plans, and its own goes on."""
        mine = self._robots.get(robot)
        if mine is None or mine.plan is None or not mine.plan.more:
            return False
        return any(
            self._too_near(other, robot)[its.at :, mine.at :].any()
            for other, its in self._robots.items()
            if other != robot and its.plan is not None
        )

    def way_back(self, robot: str, waiting: Sequence[str]) -> int | None:
        """To which piece of its plan a robot must be let back so that all who wait can get through; None: nowhere.

        Who is beside its own way can not go back along it, and keeps others from going back where it stands.
        """
        standing, mine = self._positions(), self._robots.get(robot)
        if robot not in standing or mine is None or mine.plan is None or mine.beside is not None:
            return None
        behind = mine.plan.pieces[: standing[robot]]
        kept_off, in_the_way = np.zeros(len(behind), dtype=bool), np.zeros(len(behind), dtype=bool)
        for other, its in self._robots.items():
            if other != robot and its.beside is not None:
                kept_off |= self._conflicts.too_near(robot, behind, other, its.beside.has).any(axis=1)
                if other in waiting:
                    in_the_way |= self._conflicts.too_near(robot, behind, other, its.beside.wants).any(axis=1)
        with self._holding(robot, (), others=False):  # out of a zone it gives it back
            for piece in range(len(behind) - 1, int(np.flatnonzero(kept_off).max(initial=-1)), -1):
                stuck = self._stuck(standing | {robot: piece})
                if not in_the_way[piece] and not any(each in stuck for each in waiting):
                    return piece
        return None

    def way_back_m(self, robot: str, waiting: Sequence[str]) -> float | None:
        """How far that is [m], for what moves farthest of the robot."""
        piece, mine = self.way_back(robot, waiting), self._robots.get(robot)
        if piece is None or mine is None or mine.plan is None:
            return None
        points = mine.plan.pieces.points[piece : mine.at + 1].astype(float)
        return float(np.linalg.norm(np.diff(points, axis=0), axis=-1).sum(axis=0).max(initial=0.0))

    @contextmanager
    def _holding(self, robot: str, zones: Collection[str], *, others: bool = True) -> Iterator[None]:
        """As if a robot had these zones, and the `others` that it has."""
        had = {zone for zone, holder in self._holders.items() if holder == robot} if others else set[str]()
        self._keep_others_out(robot, had.union(zones))
        try:
            yield
        finally:
            self._look_at_zones(robot)

    def _positions(self) -> dict[str, int]:
        return {name: robot.at for name, robot in self._robots.items() if robot.plan is not None and robot.end >= 0}

    def _stuck(self, standing: Mapping[str, int]) -> list[str]:
        """Who cannot get to the end of its way, one after the other, from where all stand; empty: the cell is safe."""
        key = tuple(standing.items())
        if key not in self._known_stuck:
            if len(self._known_stuck) > _MOST_KNOWN * len(self._robots):
                self._known_stuck.clear()
            self._known_stuck[key] = self._find_stuck(standing)
        return self._known_stuck[key]

    def _find_stuck(self, standing: Mapping[str, int]) -> list[str]:
        ends = {each: self._robots[each].end for each in standing}
        tries = _MOST_TRIES

        def stuck(at: dict[str, int]) -> list[str]:
            """Whoever can go to a bay may do so at once; of the others it may matter who goes first."""
            nonlocal tries
            tries -= 1
            went = True
            while went:
                went = False
                for each, end in ends.items():
                    if at[each] < end and (bay := self._farthest_bay(each, at)) is not None:
                        at[each], went = bay, True
            left = sorted(each for each, piece in at.items() if piece < ends[each])
            fewest = left
            for robot in left if tries > 0 else ():
                if fewest and self._reach(robot, at) == ends[robot]:
                    fewest = min(fewest, stuck({**at, robot: ends[robot]}), key=len)
            return fewest

        return stuck(dict(standing))

    def _before(self, robot: str, at: Mapping[str, int]) -> set[str]:
        """Who must leave its place before a robot can go to its next bay, and before those can go to theirs.

        This may be a circle where the cell is safe, too: until somebody else has passed, and more pieces are bays.
        """
        found: set[str] = set()
        left = [robot]
        while left:
            one = left.pop()
            bays = self._bays(one, at)
            bay = int(bays[0]) if len(bays) else None
            new = {each for each in at.keys() - found - {one, robot} if self._must_go_before(each, one, bay, at)}
            found |= new
            left += new
        return found

    def _must_go_before(self, other: str, robot: str, bay: int | None, at: Mapping[str, int]) -> bool:
        """It stands in the way to the bay, or where there is none, to the end, or this end is in its own way."""
        end = self._robots[robot].end
        way = slice(at[robot], (end if bay is None else bay) + 1)
        stands_in_the_way = bool(self._too_near(robot, other)[way, at[other]].any())
        return stands_in_the_way or (bay is None and self._last_near(other, robot)[end] > at[other])

    def _farthest_bay(self, robot: str, at: Mapping[str, int]) -> int | None:
        """To which it can go while the others stand."""
        bays = self._bays(robot, at)
        if len(bays):
            bays = bays[bays <= self._reach(robot, at)]
        return int(bays[-1]) if len(bays) else None

    def _bays(self, robot: str, at: Mapping[str, int]) -> NDArray[np.intp]:
        """The pieces ahead of it where nobody still has to pass."""
        here = at[robot]
        clear = np.ones(self._robots[robot].end - here, dtype=bool)
        for shared in self._shared_by(robot):
            if (its := at.get(shared.other)) is not None:
                clear &= shared.last[here + 1 :] < its
        return here + 1 + np.flatnonzero(clear)

    def _reach(self, robot: str, at: Mapping[str, int]) -> int:
        """The last piece to which it can go while the others stand; the rest of its own piece is ahead of it, too."""
        here = at[robot]
        blocked = np.zeros(self._robots[robot].end + 1 - here, dtype=bool)
        for shared in self._shared_by(robot):
            if (its := at.get(shared.other)) is not None:
                blocked |= shared.near[its, here:]
        return here - 1 + (int(blocked.argmax()) if blocked.any() else len(blocked))

    def _shared_by(self, robot: str) -> list[_Shared]:
        """With whom of all that have a plan it shares room."""
        if robot not in self._shares:
            others = (other for other in self._positions() if other != robot)
            tables = ((other, *self._tables(other, robot)) for other in others)
            self._shares[robot] = [_Shared(*each) for each in tables if each[2].any()]
        return self._shares[robot]

    def _last_near(self, robot: str, other: str) -> NDArray[np.intp]:
        """For each piece of the other's way the last one of the robot's own that is too near to it; `_FREE`: none."""
        return self._tables(robot, other)[0]

    def _too_near(self, robot: str, other: str) -> Flags:
        return self._tables(robot, other)[1]

    def _tables(self, robot: str, other: str) -> tuple[NDArray[np.intp], Flags]:
        mine, its = self._robots[robot].keeps, self._robots[other].keeps
        if mine.plan is None or its.plan is None:
            raise ValueError(f"{robot} or {other} has no plan")
        known = self._near.get((robot, other))
        if known is None or known.plan is not mine.plan or known.its_plan is not its.plan:
            back = self._near.get((other, robot))
            if back is not None and back.plan is its.plan and back.its_plan is mine.plan:
                bodies = back.bodies.T
            else:
                bodies = self._bodies_near(robot, mine.plan.pieces, other, its.plan.pieces, known)
            known = self._near[robot, other] = _Near(mine.plan, its.plan, bodies)
        return known.tables(mine, its)

    def _bodies_near(self, robot: str, mine: Sections, other: str, its: Sections, known: _Near | None) -> Flags:
        """Measured only where one of two pieces was in no plan before: the same id is the same space."""
        near = np.zeros((len(mine), len(its)), dtype=bool)
        before, its_before = (
            (known.plan.pieces, known.its_plan.pieces) if known is not None else (Sections(), Sections())
        )
        old, its_old = _same(mine, before), _same(its, its_before)
        new, kept = np.flatnonzero(old == _FREE), np.flatnonzero(old != _FREE)
        its_new, its_kept = np.flatnonzero(its_old == _FREE), np.flatnonzero(its_old != _FREE)
        if known is not None:
            near[np.ix_(kept, its_kept)] = known.bodies[np.ix_(old[kept], its_old[its_kept])]
        if len(new):
            near[new] = self._conflicts.too_near(robot, mine[new], other, its)
        if len(kept) and len(its_new):
            near[np.ix_(kept, its_new)] = self._conflicts.too_near(robot, mine[kept], other, its[its_new])
        return near


def _counts_in(plan: PlannedWay, presence: Presence) -> bool:
    """Whether a presence counts in this plan: by its number, and in pieces that it has."""
    way = presence.way
    told = way.pieces[way.pieces != NO_PIECE]
    return (plan.owner, plan.number) == (presence.owner, way.plan) and bool((told < len(plan.pieces)).all())


def _same(pieces: Sections, others: Sections) -> NDArray[np.intp]:
    """Which of the others each piece is; `_FREE`: none."""
    places = {id: place for place, id in enumerate(others.ids.tolist())}
    return np.array([places.get(id, _FREE) for id in pieces.ids.tolist()], dtype=np.intp)
