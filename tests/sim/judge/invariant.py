"""What every invariant is: a name, the messages it looks at, and a way to say that it is broken."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, NoReturn

from tests.sim.judge.facts import Facts, Sample

Handlers = Mapping[type, Callable[[str, Any], None]]


class Broken(AssertionError):
    """An invariant does not hold: which, when [s after the start], for whom, and what was seen."""

    def __init__(self, invariant: str, at_s: float, who: str, what: str) -> None:
        super().__init__(f"{invariant} at {at_s:.3f} s, {who}: {what}")
        self.invariant = invariant
        self.at_s = at_s
        self.who = who
        self.what = what


class Invariant:
    """One thing that must hold. Handlers see a message before `facts` count it as the newest of its kind."""

    name: ClassVar[str]

    def __init__(self, facts: Facts) -> None:
        self.facts = facts

    @property
    def published(self) -> Handlers:
        """By kind of message: what to do with (process, message) at the moment it leaves."""
        return {}

    @property
    def delivered(self) -> Handlers:
        """By kind of message: what to do with (process, message) at the moment a core gets it."""
        return {}

    @property
    def effects(self) -> Handlers:
        """By kind of effect: what to do with (process, effect) before it is carried out."""
        return {}

    def lived(self, name: str, what: str) -> None:
        """A process was started, killed, frozen or thawed."""

    def look(self, sample: Sample) -> None:
        """One robot at one moment, some time after it; in the order of time."""

    def flush(self) -> None:
        """Judge what was kept for later."""

    def broken(self, who: str, what: str, at: float | None = None) -> NoReturn:
        """`at`: when, on the world's clock; now, where it is left out."""
        now = self.facts.now if at is None else at
        raise Broken(self.name, now - self.facts.start, who, what)
