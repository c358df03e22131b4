"""Which space is reserved for which robot, and what more may be cleared for whom (`docs/architecture.md`, section 4.5).

No rule here depends on a time: a robot keeps what it owns, and what was cleared for it and not yet confirmed, however
old its newest report is.
"""

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Protocol

from cell.messages.sections import Clearance, Refusal, Sections, WayReport
from cell.net.freshness import NewestOf

MOST_OPEN = 8
"""So many clearances of one robot may be unconfirmed; before it confirms one of them it gets no more."""


class Separation(Protocol):
    """What is too near to what."""

    def first_too_near(self, robot: str, asked: Sections, other: str, reserved: Sections) -> tuple[int, Refusal] | None:
        """The first section of `asked` that comes too near to one of `reserved`, and why; None where none does."""


@dataclass(frozen=True, slots=True)
class _Ask:
    report: int
    owner: int
    sections: Sections


@dataclass(slots=True)
class _Robot:
    newest: NewestOf = field(default_factory=NewestOf)
    owned: Sections = field(default_factory=Sections)
    open: dict[int, Sections] = field(default_factory=dict)
    """By number: what was cleared and is not confirmed, so the robot may own it."""
    number: int = 0
    """Of the newest clearance."""
    known: bool = False
    """Where it is: it is referenced. Until then it may be anywhere within its reach."""
    named: bool = False
    """Its newest report names this manager."""
    ask: _Ask | None = None

    def reserved(self) -> list[Sections]:
        return [self.owned, *self.open.values()]


class Ledger:
    """What each robot may use, by what it says and by what was cleared for it.

    Nothing is cleared before every robot has named this manager: one that has not may use what a manager of before has
    cleared.
    """

    def __init__(self, robots: Collection[str], boot: str, epoch: int, separation: Separation) -> None:
        """`epoch` is greater than that of every manager before."""
        self._boot = boot
        self._epoch = epoch
        self._separation = separation
        self._robots = {robot: _Robot() for robot in sorted(robots)}
        self.deposed = False
        """A manager of a higher epoch is at work; this one clears nothing any more."""

    def hear(self, report: WayReport) -> None:
        """Take a report, unless it is older than the newest one or of an earlier claim. Its age does not count."""
        robot = self._robots.get(report.robot)
        if robot is None:
            return
        before = robot.newest.era
        if not robot.newest.accept(report.boot, report.owner, report.sequence):
            return
        self.deposed |= report.epoch > self._epoch
        way, names_me = report.way, report.heard is not None and report.heard.boot == self._boot
        robot.named = names_me and report.epoch == self._epoch
        robot.known = report.known
        if report.owner > before and robot.known:
            # The gateway gave this claim at rest, and plays no block of an earlier owner.
            robot.open = {}
        elif robot.named:
            robot.open = {number: cleared for number, cleared in robot.open.items() if number > report.taken}
        if robot.known:
            robot.owned = way.sections[: way.owned]
        asked = way.sections[way.owned :]
        robot.ask = _Ask(report.sequence, report.owner, asked) if robot.named and len(asked) else None

    @property
    def awaited(self) -> list[str]:
        """The robots without whose word nothing is cleared."""
        return [name for name, robot in self._robots.items() if not robot.named]

    def reserved(self, robot: str) -> list[Sections]:
        """All that a robot may use."""
        return self._robots[robot].reserved()

    def clear(self) -> list[Clearance]:
        """Answer what was asked for since the last call, one robot after another."""
        clearances = []
        for name, robot in self._robots.items():
            ask, robot.ask = robot.ask, None
            if ask is None or len(robot.open) >= MOST_OPEN:
                continue
            cleared, refusal = self._longest(name, ask.sections)
            robot.number += 1
            if cleared > 0:
                robot.open[robot.number] = ask.sections[:cleared]
            clearances.append(
                Clearance(name, self._boot, self._epoch, ask.owner, ask.report, robot.number, cleared, refusal)
            )
        return clearances

    def _longest(self, name: str, asked: Sections) -> tuple[int, Refusal | None]:
        """How many of the sections may be used, and what stands against the next one."""
        if self.deposed:
            return 0, Refusal("", f"a manager of a higher epoch than {self._epoch} is at work: stop this one")
        if awaited := self.awaited:
            return 0, Refusal(awaited[0], f"{', '.join(awaited)} not heard yet")
        cleared, refusal = len(asked), None
        for other, robot in self._robots.items():
            if other == name:
                continue
            if not robot.known:
                return 0, Refusal(other, f"{other} does not know where it is: `cell drives` says how it finds out")
            for reserved in robot.reserved():
                found = self._separation.first_too_near(name, asked[:cleared], other, reserved)
                if found is not None:
                    cleared, refusal = found
        return cleared, refusal
