"""What befalls a cell, one thing at a time."""

from dataclasses import dataclass
from typing import ClassVar

from tests.sim.judge.facts import Facts
from tests.sim.staff import Staff
from tests.sim.world import World


@dataclass(frozen=True, slots=True)
class Moment:
    """The next time that this happens to a robot, and so much later [s]."""

    robot: str
    what: str
    after_s: float = 0.0


@dataclass(frozen=True, slots=True)
class Stage:
    """What items act on."""

    world: World
    facts: Facts
    staff: Staff
    gone: set[str]
    """Processes that are down for a while on purpose."""


@dataclass(frozen=True, slots=True)
class Item:
    """Something that befalls the cell `at_s` after the start, or at the first such moment after that."""

    kind: ClassVar[str]
    at_s: float
    moment: Moment | None

    def strike(self, stage: Stage) -> float:
        """Let it happen; how long [s] it lasts."""
        raise NotImplementedError
