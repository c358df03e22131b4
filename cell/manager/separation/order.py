"""Who goes first: robots that share room are let in only as far as all of them can still get through.

Clearing alone is no order: two robots that are both let in as far as nothing is in their way may end up nose to nose,
each in the other's way out. So what is cleared is cut further until the cell is *safe*: some robot can go to the end of
all that it has planned while the others stand at the ends of what they own; then another one, while that one stands at
the end of its way; and so on until all have (the safe states of Dijkstra's banker, on ways instead of money). Where the
cell is not safe already, nothing is cut: then geometry alone decides.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from cell.geometry.arrays import Flags
from cell.messages import PlannedWay, Presence, Refusal, Sections
from cell.messages.sections import NO_PIECE
from cell.net.freshness import NewestOf

_FREE = -1
_MOST_TRIES = 200
"""Of orders in which robots may go, where it matters."""


class Conflicts(Protocol):
    """What is too near to what."""

    def too_near(self, robot: str, sections: Sections, other: str, others: Sections) -> Flags:
        """Which sections `(s,)` come too near to which of the others `(t,)`: `(s, t)`."""


@dataclass(slots=True)
class _Robot:
    newest: NewestOf = field(default_factory=NewestOf)
    coming: PlannedWay | None = None
    """The newest plan, which no presence has counted in yet."""
    plan: PlannedWay | None = None
    """What its presences count in."""
    at: int = 0
    """The piece at the end of what it may use."""
    back: int = 0
    """The piece that it is in by what is measured of it."""

    @property
    def end(self) -> int:
        return 0 if self.plan is None else len(self.plan.pieces) - 1


class Order:
    """The planned ways of all robots, and how far they have been let in."""

    def __init__(self, conflicts: Conflicts) -> None:
        self._conflicts = conflicts
        self._robots: dict[str, _Robot] = {}
        self._last: dict[tuple[str, str], tuple[PlannedWay, PlannedWay, list[int], Flags]] = {}
        """By two robots and for their plans: for each piece of the second the last one of the first that is too near
        to it; and all that are."""

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
        if coming is not None and (coming.owner, coming.number) == (presence.owner, way.plan):
            robot.plan, robot.coming = coming, None
        if way.plan == 0:
            robot.plan = None
        plan = robot.plan
        if plan is None or (plan.owner, plan.number) != (presence.owner, way.plan):
            return
        mine = [piece for piece in reserved.values() if piece != NO_PIECE]
        robot.at = min(max(mine, default=0), robot.end)
        used = [piece for piece in way.pieces[: way.committed].tolist() if piece != NO_PIECE]
        robot.back = min(min(used, default=robot.at), robot.end)

    def leave_out(self, robot: str) -> None:
        """A robot that does not go on is in nobody's order, until its presences count in a plan again."""
        mine = self._robots.setdefault(robot, _Robot())
        mine.coming, mine.plan = mine.coming or mine.plan, None

    def knows(self, robot: str, plan: int) -> bool:
        """Whether the plan with this number is what the order goes by."""
        mine = self._robots.get(robot)
        return mine is not None and mine.plan is not None and mine.plan.number == plan

    def admitted(self, robot: str, pieces: Sequence[int]) -> tuple[int, Refusal | None]:
        """How many of the sections that lie in these pieces of its plan a robot may be cleared, and who is in the way.

        All of them, where the cell is not safe anyway.
        """
        standing = self._positions()
        if robot not in standing or not pieces or self._stuck(standing):
            return len(pieces), None
        count, refusal = len(pieces), None
        while count > 0:
            last = max((piece for piece in pieces[:count] if piece != NO_PIECE), default=standing[robot])
            stuck = self._stuck(standing | {robot: max(last, standing[robot])})
            if not stuck:
                return count, refusal
            other = next((each for each in stuck if each != robot), robot)
            refusal = Refusal(other, f"{robot} would be in the way of {other}, which must get through first")
            count = next((k for k, piece in enumerate(pieces[:count]) if piece == last), 0)
        return 0, refusal

    def look_further(self, robot: str) -> bool:
        """Whether what is known of a robot's plan ends where another one still has to pass."""
        mine = self._robots.get(robot)
        if mine is None or mine.plan is None or not mine.plan.more:
            return False
        return any(
            self._too_near(other, robot)[its.at :, mine.end].any()
            for other, its in self._robots.items()
            if other != robot and its.plan is not None
        )

    def way_back(self, robot: str, waiting: Sequence[str]) -> int | None:
        """To which piece of its plan a robot must be let back so that all who wait can get through; None: nowhere."""
        standing = self._positions()
        if robot not in standing:
            return None
        for piece in range(standing[robot] - 1, -1, -1):
            stuck = self._stuck(standing | {robot: piece})
            if not any(each in stuck for each in waiting):
                return piece
        return None

    def _positions(self) -> dict[str, int]:
        return {name: robot.at for name, robot in self._robots.items() if robot.plan is not None and robot.end >= 0}

    def _stuck(self, standing: Mapping[str, int]) -> list[str]:
        """Who cannot get to the end of its way, one after the other, from where all stand; empty: the cell is safe."""
        tries = _MOST_TRIES

        def stuck(at: dict[str, int], left: list[str]) -> list[str]:
            """Whoever ends in nobody's way may go at once; of the others it may matter who goes first."""
            nonlocal tries
            tries -= 1
            while robot := next((each for each in left if self._gets_through(each, at, left)), None):
                at, left = at | {robot: self._robots[robot].end}, [each for each in left if each != robot]
            fewest = left
            for robot in left if tries > 0 else ():
                if fewest and self._gets_through(robot, at):
                    others = [each for each in left if each != robot]
                    fewest = min(fewest, stuck(at | {robot: self._robots[robot].end}, others), key=len)
            return fewest

        return stuck(dict(standing), sorted(standing))

    def _gets_through(self, robot: str, at: Mapping[str, int], out_of: Sequence[str] = ()) -> bool:
        """Whether it can go to the end of its way, and is out of the way of these others there."""
        end = self._robots[robot].end
        free = all(self._last_near(robot, other)[at[other]] <= at[robot] for other in at if other != robot)
        return free and all(self._last_near(other, robot)[end] <= at[other] for other in out_of if other != robot)

    def _last_near(self, robot: str, other: str) -> list[int]:
        """For each piece of the other's way the last one of the robot's own that is too near to it."""
        return self._tables(robot, other)[0]

    def _too_near(self, robot: str, other: str) -> Flags:
        return self._tables(robot, other)[1]

    def _tables(self, robot: str, other: str) -> tuple[list[int], Flags]:
        mine, its = self._robots[robot].plan, self._robots[other].plan
        if mine is None or its is None:
            raise ValueError(f"{robot} or {other} has no plan")
        known = self._last.get((robot, other))
        if known is None or known[0] is not mine or known[1] is not its:
            back = self._last.get((other, robot))
            if back is not None and back[0] is its and back[1] is mine:
                near = back[3].T
            else:
                near = self._conflicts.too_near(robot, mine.pieces, other, its.pieces)
            rows = np.arange(len(near))[:, None]
            last = np.where(near, rows, _FREE).max(axis=0, initial=_FREE)
            known = self._last[robot, other] = mine, its, last.tolist(), near
        return known[2], known[3]
