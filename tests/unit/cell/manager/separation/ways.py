"""Robots on planned ways whose conflicts are drawn or given, without any geometry."""

import random
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from cell.geometry.arrays import Flags
from cell.manager.separation.order import Order
from cell.messages import Body, PlannedWay, Presence, Sections, Stay, Way


def pieces_of(robot: str, count: int) -> Sections:
    """Piece k of a robot has the id 1000 times its letter, and k; each lies 60 mm from the one before it."""
    ids = np.uint64(1000 * ord(robot)) + np.arange(count, dtype=np.uint64)
    points = np.zeros((count, 1, 2, 3), np.float32)
    points[..., 0] = 0.06 * np.arange(count)[:, None, None]
    return Sections(ids, points, np.zeros((count, 1), np.float32))


class Known:
    """Conflicts as they were drawn: pairs of (robot, piece)."""

    def __init__(self, near: set[frozenset[tuple[str, int]]]) -> None:
        self.near = near

    def too_near(self, robot: str, sections: Sections, other: str, others: Sections) -> Flags:
        return np.array(
            [[self.meet(robot, i, other, j) for j in range(len(others))] for i in range(len(sections))], dtype=bool
        ).reshape(len(sections), len(others))

    def meet(self, robot: str, piece: int, other: str, others: int) -> bool:
        return frozenset([(robot, piece), (other, others)]) in self.near


class Ways:
    """Robots on planned ways, who may use what they stand in and what was admitted."""

    def __init__(
        self,
        counts: dict[str, int],
        near: set[frozenset[tuple[str, int]]],
        stays: Mapping[str, tuple[Stay, ...]] = MappingProxyType({}),
    ) -> None:
        self.known, self.order, self.counts = Known(near), Order(Known(near)), counts
        self.at = dict.fromkeys(counts, 0)
        self.stays = {robot: stays.get(robot, ()) for robot in counts}
        self.holders: dict[str, str | None] = dict.fromkeys("pqr")
        self.going = set(counts)
        for robot, count in counts.items():
            pieces = pieces_of(robot, count)
            self.order.planned(PlannedWay(robot, "b", 1, 1, more=False, pieces=pieces, stays=self.stays[robot]))
            self.hear(robot)

    def hear(self, robot: str, at: int | None = None, plan: int = 1) -> None:
        here = self.at[robot] = self.at[robot] if at is None else at
        section = pieces_of(robot, here + 1)[slice(here, here + 1)]
        way = Way(section, 1, 1, plan=plan, pieces=np.uint32([here]))
        body = Body(True, (0.0, 0.0, 0.0), 1.0)
        presence = Presence(robot, "b", 1, 1, None, "", body, 0.0, way=way)
        self.order.hear(presence, {int(section.ids[0]): here})

    def onward(self, robot: str, ahead: int) -> int:
        """Let a robot go on by up to so many pieces, which it says; how many it went."""
        admitted = self.let_in(robot, ahead)
        self.hear(robot)
        return admitted

    def let_in(self, robot: str, ahead: int) -> int:
        """Let a robot go on by up to so many pieces; how many."""
        here = self.at[robot]
        asked = list(range(here + 1, min(here + 1 + ahead, self.counts[robot])))
        self.order.hold(self.holders)
        free = next((k for k, piece in enumerate(asked) if self.blocked(robot, piece)), len(asked))
        admitted, _ = self.order.admitted(robot, asked[:free])
        self.at[robot] = here + admitted
        self.order.let_in(robot, asked[:admitted])
        return admitted

    def blocked(self, robot: str, piece: int) -> bool:
        return bool(self._not_held(robot, self.needed(robot, piece))) or any(
            self.known.meet(robot, piece, other, at) for other, at in self.at.items() if other != robot
        )

    def needed(self, robot: str, piece: int) -> set[str]:
        """The zones in which the robot is there; in the first piece of several it may stand in front of them."""
        return {
            stay.zone for stay in self.stays[robot] if stay.first + (0 < stay.first < stay.last) <= piece <= stay.last
        }

    def ask(self, robot: str, ahead: int) -> str:
        """Let a robot ask for the zones that it needs next, if it does within so many pieces; why it has not got them.

        It gives back what it has passed.
        """
        here = self.at[robot]
        ahead_of_it = range(here, min(here + 1 + ahead, self.counts[robot]))
        needed = {zone for piece in ahead_of_it for zone in self.needed(robot, piece)}
        for zone, holder in self.holders.items():
            if holder == robot and zone not in needed:
                self.holders[zone] = None
        wished = next(
            (new for piece in ahead_of_it if (new := self._not_held(robot, self.needed(robot, piece)))), set[str]()
        )
        if any(self.holders.get(zone) for zone in wished):
            return "another one has it"
        self.order.hold(self.holders)
        refusal = self.order.why_not_grant(robot, sorted(wished), self.going) if wished else None
        if refusal is not None:
            return refusal.text
        self.holders |= dict.fromkeys(wished, robot)
        return ""

    def _not_held(self, robot: str, zones: set[str]) -> set[str]:
        return {zone for zone in zones if self.holders.get(zone) != robot}

    def in_the_way_of(self, robot: str) -> str:
        """Who stands in the next piece of a robot, or has to get through before it goes there; empty: nobody."""
        following = self.at[robot] + 1
        stands = next((other for other, at in self.at.items() if self.known.meet(robot, following, other, at)), "")
        _, refusal = self.order.admitted(robot, [following])
        return stands or ("" if refusal is None else refusal.by)

    def goes_in_the_end(self, robot: str) -> bool:
        """Whether the one for which it waits can go on, or the one for which that one waits, and so on."""
        for _ in self.counts:
            following = self.at[robot] + 1
            _, refusal = self.order.admitted(robot, [following])
            if refusal is None:
                return not self.blocked(robot, following)
            robot = refusal.by
        return False

    @property
    def done(self) -> bool:
        return all(self.at[robot] == count - 1 for robot, count in self.counts.items())


def drawn_ways(seed: int) -> Ways:
    """Up to four robots; at their beginnings and ends they are in nobody's way."""
    rng = random.Random(seed)
    counts = {robot: rng.randint(3, 9) for robot in "abcd"[: rng.randint(2, 4)]}
    near: set[frozenset[tuple[str, int]]] = set()
    for robot in counts:
        for other in counts:
            if robot < other:
                share = rng.choice([0.05, 0.2, 0.5])
                near |= {
                    frozenset([(robot, i), (other, j)])
                    for i in range(1, counts[robot] - 1)
                    for j in range(1, counts[other] - 1)
                    if rng.random() < share
                }
    return Ways(counts, near)


def again_and_again(seed: int, rounds: int) -> Ways:
    """As `drawn_ways`, with ways that are gone over and over again."""
    once = drawn_ways(seed)
    near = {
        frozenset([(robot, i + k * once.counts[robot]), (other, j + m * once.counts[other])])
        for (robot, i), (other, j) in (sorted(each) for each in once.known.near)
        for k in range(rounds)
        for m in range(rounds)
    }
    return Ways({robot: rounds * count for robot, count in once.counts.items()}, near)


def two_loop_and_one_waits() -> Ways:
    """Either a or b is always in the middle, which is theirs together and not c's."""
    middle = {
        frozenset([(robot, piece), ("c", its)])
        for robot in "ab"
        for piece in range(62)
        for its in (2, 3)
        if piece % 6 not in (0, 1)
    }
    ways = Ways({"a": 62, "b": 62, "c": 6}, middle)
    ways.onward("a", 3)
    return ways
