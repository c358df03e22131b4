"""Circles of robots that wait for each other, and since when each lasts: zones and cleared space both have them.

Nobody backs by itself: what a program has switched on its way can not be undone by going back. So people are told.
"""

from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from cell.messages import Deadlock

LASTING_S = 1.0
"""What lasts so long is no passing moment; what was not seen for so long is over."""

C = TypeVar("C", bound=Hashable)
W = TypeVar("W", bound=Hashable)


@dataclass(slots=True)
class _Seen:
    first: float
    last: float
    deadlock: Deadlock | None = None
    """Once it was told."""


@dataclass(slots=True)
class LastingCircles(Generic[C]):
    """Those that were seen of late, by what makes two of them the same."""

    _seen: dict[C, _Seen] = field(default_factory=dict)

    @property
    def present(self) -> tuple[Deadlock, ...]:
        """Those that were told and still last."""
        return tuple(each.deadlock for each in self._seen.values() if each.deadlock is not None)

    def look(self, circles: Iterable[C], now: float, told: Callable[[C], Deadlock]) -> list[Deadlock]:
        """What is to be told: `circles` are there `now` [s], and some of them have lasted for `LASTING_S` just now."""
        for circle in circles:
            self._seen.setdefault(circle, _Seen(now, now)).last = now
        self._seen = {circle: each for circle, each in self._seen.items() if now - each.last <= LASTING_S}
        found = []
        for circle, each in self._seen.items():
            if each.deadlock is None and each.last == now and now - each.first >= LASTING_S:
                each.deadlock = told(circle)
                found.append(each.deadlock)
        return found


def circles_of(waiting: Mapping[str, Mapping[W, str]]) -> list[tuple[tuple[str, W], ...]]:
    """As (robot, what it waits for), for each robot the shortest circle of which it is the first by name.

    `waiting`: by robot, what it waits for, and whose that is.
    """
    circles = (_circle(start, waiting) for start in sorted(waiting))
    return [circle for circle in circles if circle]


def _circle(start: str, waiting: Mapping[str, Mapping[W, str]]) -> tuple[tuple[str, W], ...]:
    ways: list[tuple[tuple[str, W], ...]] = [((start, what),) for what in waiting[start]]
    reached = set[str]()
    for way in ways:  # grows while it is gone through: the shorter ways come first
        robot, what = way[-1]
        other = waiting[robot][what]
        if other == start:
            return way
        if other > start and other in waiting and other not in reached:
            reached.add(other)
            ways += [(*way, (other, further)) for further in waiting[other]]
    return ()
