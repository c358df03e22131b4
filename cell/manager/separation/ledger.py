"""Which space is reserved for which robot, and what more may be cleared for whom (`docs/architecture.md`, section 4.5).

No rule here depends on a time: a robot keeps what it owns, and what was cleared for it and not yet confirmed, however
old its newest presence is.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Protocol

import numpy as np

from cell.geometry import Box, capsule_distance
from cell.messages import Body, Presence
from cell.messages.common import Vector
from cell.messages.sections import Clearance, Refusal, Sections
from cell.net.freshness import NewestOf

MOST_OPEN = 8
"""So many clearances of one robot may be unconfirmed; then the newest one is repeated until it is confirmed."""
_AT_ONCE = 64
"""So many sections are compared with a body in one go."""
_SIDE_BY_SIDE_M = 0.02
"""Sections are a little thicker than the robot in them: another one at its side may be in them."""

TooNear = tuple[int, Refusal] | None
"""The first section that comes too near, and why; None where none does."""


class Whereabouts(Enum):
    """Where a robot says that it is, beside what is reserved for it."""

    RESERVED = auto()
    """In there; or the presence says nothing of it."""
    APPEARED = auto()
    """Nobody could know: it was lost before, or begins with a new claim."""
    BESIDE = auto()
    """Where nothing was reserved for it."""


class Admission(Protocol):
    """How far a robot may be let in, so that all get through."""

    def hear(self, presence: Presence, reserved: Mapping[int, int]) -> None:
        """A presence was taken; `reserved`: the pieces of the sections that its robot may use, by their ids."""

    def knows(self, robot: str, plan: int) -> bool:
        """Whether the plan with this number has been heard."""

    def admitted(self, robot: str, pieces: Sequence[int]) -> tuple[int, Refusal | None]:
        """How many of the sections in these pieces of its plan a robot may be cleared, and what is in the way."""

    def let_in(self, robot: str, pieces: Sequence[int]) -> None:
        """A robot was cleared sections in these pieces of its plan."""

    def leave_out(self, robot: str) -> None:
        """Nobody waits for this robot to pass."""

    def look_further(self, robot: str) -> bool:
        """Whether a robot should plan more of its program."""


class Separation(Protocol):
    """What is too near to what."""

    def first_too_near(self, robot: str, asked: Sections, other: str, reserved: Sections) -> TooNear:
        """The first section of `asked` that comes too near to one of `reserved`."""

    def first_nearer(self, robot: str, asked: Sections, other: str, reserved: Sections, present: Sections) -> TooNear:
        """The same for a robot that may be too near already: only what is nearer than `present` counts."""

    def first_in_reach(
        self, robot: str, asked: Sections, other: str, base: Vector, reach_m: float, why: str
    ) -> TooNear:
        """The first section of `asked` that is within the reach of `other` from its base: `why` it may be there."""

    def first_at_box(self, robot: str, asked: Sections, other: str, box: Box) -> TooNear:
        """The first section of `asked` that comes too near to the box in which `other` stays."""

    def meets(self, robot: str, body: Sections, other: str, sections: Sections, within_m: float = 0.0) -> bool:
        """Whether a robot's body comes nearer than that to sections of `other`; by default, whether they overlap."""


@dataclass(frozen=True, slots=True)
class _Ask:
    presence: int
    owner: int
    sections: Sections
    plan: int
    pieces: list[int]


@dataclass(slots=True)
class _Robot:
    newest: NewestOf = field(default_factory=NewestOf)
    owned: Sections = field(default_factory=Sections)
    open: dict[int, Sections] = field(default_factory=dict)
    """By number: what was cleared and is not confirmed, so the robot may own it."""
    newest_clearance: Clearance | None = None
    body: Body | None = None
    """Of its newest presence; one that is not known is anywhere within its reach."""
    rests: bool = True
    """By its newest presence nothing moves it."""
    known_under: int = 0
    """The newest claim under which it knew where it is: no clearance of an earlier one counts."""
    named: bool = False
    """Its newest presence names this manager."""
    assured: bool = False
    """An operator has said where it stays: what is reserved for it, and its box."""
    box: Box | None = None
    ask: _Ask | None = None
    pieces: dict[int, int] = field(default_factory=dict)
    """Of sections, by their ids: the piece of its plan in which each lies."""

    def reserved(self) -> list[Sections]:
        return [self.owned, *self.open.values()]

    @property
    def lost(self) -> bool:
        return self.body is not None and not self.body.known

    def place(self, owned: Sections) -> None:
        """This is all that it may use, by the word of somebody else."""
        self.owned, self.open, self.ask = owned, {}, None


class Ledger:
    """What each robot may use, by what it says and by what was cleared for it.

    Nothing is cleared before every robot has named this manager: one that has not may use what a manager of before has
    cleared. Of one that does not tell where it is an operator may say it (`confine`, `stand`).
    """

    def __init__(
        self, robots: Collection[str], boot: str, epoch: int, separation: Separation, order: Admission | None = None
    ) -> None:
        """`epoch` is greater than that of every manager before; without `order` nobody waits for others to pass."""
        self._boot = boot
        self._epoch = epoch
        self._separation = separation
        self._order = order
        self._robots = {robot: _Robot() for robot in sorted(robots)}
        self.deposed = False
        """A manager of a higher epoch is at work; this one clears nothing any more."""
        self.in_setup = ""
        """The robot whose drives may move it by themselves, anywhere within its reach."""

    def hear(self, presence: Presence) -> Whereabouts:
        """Take a presence, unless it is older than the newest one or of an earlier claim. Its age does not count.

        Where the robot is now is reserved for it from here on, whatever was before.
        """
        robot = self._robots.get(presence.robot)
        if robot is None:
            return Whereabouts.RESERVED
        if not robot.newest.accept(presence.boot, presence.owner, presence.sequence):
            return Whereabouts.RESERVED
        self.deposed |= presence.epoch > self._epoch
        robot.named = presence.epoch == self._epoch and presence.heard is not None and presence.heard.boot == self._boot
        way, lost = presence.way, robot.lost
        elsewhere = robot.assured and presence.body.known and not _is_where_said(presence, robot)
        known = {each for sections in robot.reserved() for each in sections.ids.tolist()}
        asked = way.sections[way.owned :]
        pieces = way.pieces.tolist()
        ask = _Ask(presence.sequence, presence.owner, asked, way.plan, pieces[way.owned :])
        robot.ask = ask if robot.named and presence.body.known and len(asked) else None
        robot.body, robot.rests = presence.body, presence.stop_time_s == 0.0
        anew = presence.body.known and presence.owner > robot.known_under
        if anew:
            # The gateway gave this claim at rest, and plays no block of an earlier owner.
            robot.known_under, robot.open = presence.owner, {}
        elif robot.named:
            robot.open = {number: cleared for number, cleared in robot.open.items() if number > presence.taken}
        if not presence.body.known:
            return Whereabouts.RESERVED
        robot.owned = way.sections[: way.owned]
        if self._order is not None:
            robot.pieces |= dict(zip(way.sections.ids.tolist(), pieces, strict=False))
            kept = {each for sections in robot.reserved() for each in sections.ids.tolist()}
            robot.pieces = {id: piece for id, piece in robot.pieces.items() if id in kept}
            self._order.hear(presence, robot.pieces)
        if robot.assured:
            return Whereabouts.BESIDE if elsewhere else Whereabouts.RESERVED
        if anew or lost:
            return Whereabouts.APPEARED
        return Whereabouts.RESERVED if known.issuperset(robot.owned.ids.tolist()) else Whereabouts.BESIDE

    @property
    def awaited(self) -> list[str]:
        """The robots without whose word nothing is cleared."""
        return [name for name, robot in self._robots.items() if not (robot.named or robot.assured)]

    def confine(self, name: str, box: Box) -> None:
        """By an operator's word a robot stays in this box; what it had does not count any more."""
        robot = self._robots[name]
        robot.place(Sections())
        robot.assured, robot.box, robot.named = True, box, False
        if self._order is not None:
            self._order.leave_out(name)

    def stand(self, name: str, place: Sections) -> None:
        """By an operator's word a robot stands in there."""
        robot = self._robots[name]
        robot.place(place)
        robot.assured, robot.box = True, None
        if self._order is not None:
            self._order.leave_out(name)

    def end_assurance(self, name: str) -> None:
        """What an operator has said of it does not count any more: it is where it says itself, once it is heard."""
        robot = self._robots[name]
        robot.assured, robot.box = False, None

    def moved_unseen(self, name: str) -> None:
        """A robot that does not know where it is has been moved: it is not where it was last known."""
        if self._robots[name].lost:
            self._robots[name].place(Sections())

    def last_place(self, name: str) -> Sections:
        """All that a robot was in when it was last known; empty when nobody knows."""
        place = Sections()
        for some in self._robots[name].reserved():
            place = place.joined(some)
        return place

    def reserved(self, robot: str) -> list[Sections]:
        """All that a robot may use."""
        return self._robots[robot].reserved()

    def intruded(self, name: str, body: Body, where: Whereabouts) -> str:
        """In whose reserved space a robot is measured, by the present pose of its body; empty: in nobody's.

        Robots that rest side by side when one of them is heard first are too near, and may part: then what the other
        one is in does not count, but what it may go on into does. `where`: by `hear`.
        """
        present = _present(body)
        for other, robot in self._robots.items():
            if other == name:
                continue
            if where is Whereabouts.APPEARED and robot.rests and robot.body is not None:
                its = _present(robot.body)
                if self._separation.meets(name, present, other, its, _SIDE_BY_SIDE_M):
                    continue
            if any(self._separation.meets(name, present, other, some) for some in robot.reserved()):
                return other
        return ""

    def clear(self) -> list[Clearance]:
        """Answer what was asked for since the last call, one robot after another."""
        clearances = []
        for name, robot in self._robots.items():
            ask, robot.ask = robot.ask, None
            if ask is None:
                continue
            newest = robot.newest_clearance
            if newest is None or len(robot.open) < MOST_OPEN:
                number = 1 if newest is None else newest.number + 1
                cleared, refusal = self._longest(name, ask.sections)
                if self._order is not None and ask.pieces:
                    cleared, refusal = self._admitted(self._order, name, ask, cleared, refusal)
                if cleared > 0:
                    robot.open[number] = ask.sections[:cleared]
                    robot.pieces |= dict(zip(ask.sections.ids[:cleared].tolist(), ask.pieces, strict=False))
                    if self._order is not None:
                        self._order.let_in(name, ask.pieces[:cleared])
                look_further = self._order is not None and self._order.look_further(name)
                robot.newest_clearance = newest = Clearance(
                    name, self._boot, self._epoch, ask.owner, ask.presence, number, cleared, refusal, look_further
                )
            clearances.append(newest)
        return clearances

    def _admitted(
        self, order: Admission, name: str, ask: _Ask, cleared: int, refusal: Refusal | None
    ) -> tuple[int, Refusal | None]:
        """The same, but no farther than all robots can still get through."""
        if not order.knows(name, ask.plan):
            return 0, Refusal("", f"what {name} has planned has not been heard yet")
        admitted, why = order.admitted(name, ask.pieces[:cleared])
        return (admitted, why) if admitted < cleared else (cleared, refusal)

    def _longest(self, name: str, asked: Sections) -> tuple[int, Refusal | None]:
        """How many of the sections may be used, and what stands against the next one."""
        if self.deposed:
            return 0, Refusal("", f"a manager of a higher epoch than {self._epoch} is at work: stop this one")
        if awaited := self.awaited:
            names = ", ".join(awaited)
            return 0, Refusal(awaited[0], f"{names} not heard yet: start its agent, or say {self._where(awaited[0])}")
        cleared, refusal = len(asked), None
        for other, robot in self._robots.items():
            if other == name:
                continue
            found = self._first_unknown(name, asked[:cleared], other, robot)
            cleared, refusal = found or (cleared, refusal)
            for reserved in robot.reserved():
                found = self._first_against(name, asked[:cleared], other, reserved)
                cleared, refusal = found or (cleared, refusal)
        return cleared, refusal

    def _first_unknown(self, name: str, asked: Sections, other: str, robot: _Robot) -> TooNear:
        """Against one that may be where nobody has measured it."""
        if robot.box is not None:
            return self._separation.first_at_box(name, asked, other, robot.box)
        if robot.body is None or robot.assured or not (robot.lost or other == self.in_setup):
            return None
        why = f"{other} does not know where it is: `cell drives` says how it finds out, or say {self._where(other)}"
        why = f"{other} is in set-up" if other == self.in_setup else why
        return self._separation.first_in_reach(name, asked, other, robot.body.base, robot.body.reach_m, why)

    def _first_against(self, name: str, asked: Sections, other: str, reserved: Sections) -> TooNear:
        """Robots that are too near already may part, and never come nearer.

        From one that moves nobody parts: what it has, to brake in for example, may be far more than where it comes to.
        """
        found = self._separation.first_too_near(name, asked, other, reserved)
        if found is None or not self._robots[other].rests:
            return found
        first, _ = found
        nearer = self._separation.first_nearer(name, asked[first:], other, reserved, self._robots[name].owned)
        return None if nearer is None else (first + nearer[0], nearer[1])

    def _where(self, robot: str) -> str:
        """How an operator says where a robot is that does not tell it; in its last place only if that is known."""
        stands = f"`cell stands {robot}` or " if len(self.last_place(robot)) else ""
        return f"where it stays: {stands}`cell confine {robot}`"


def _is_where_said(presence: Presence, robot: _Robot) -> bool:
    """Whether a body, as it is measured now, is where an operator has said; all of it that ever moves."""
    body = presence.body
    moves = [each for each in range(len(body.radii_m)) if each not in presence.way.fixed]
    ends, radii = body.poses[0, moves].astype(float), body.radii_m[moves].astype(float)
    if robot.box is not None:
        local = (ends - robot.box.pose_world_box[:3, 3]) @ robot.box.pose_world_box[:3, :3]
        return bool((np.abs(local) + radii[:, None, None] <= robot.box.size / 2.0).all())
    # A capsule is in another one when the balls at both of its ends are.
    balls = np.repeat(ends[:, :, None], 2, axis=2)[:, :, None, None], -radii[:, None, None, None]
    covered = np.zeros(len(moves), dtype=bool)
    for some in _parts(robot.owned):
        away = capsule_distance(*balls, some.points.astype(float), some.radii.astype(float))
        covered |= np.any((away <= 0.0).all(axis=1), axis=(1, 2))
    return bool(covered.all())


def _present(body: Body) -> Sections:
    """A body as it is measured now, as a section without an id."""
    return Sections(np.zeros(1, np.uint64), body.poses[:1].astype(np.float32), body.radii_m[None].astype(np.float32))


def _parts(sections: Sections) -> Iterator[Sections]:
    """All of them, in parts that are compared in little memory."""
    for start in range(0, len(sections), _AT_ONCE):
        yield sections[start : start + _AT_ONCE]
