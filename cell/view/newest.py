"""What was heard of a cell, and how long ago."""

from collections import deque
from collections.abc import Iterable, Mapping
from typing import TypeVar

from cell.core import Arrived
from cell.messages import Event, FramePose, PlannedWay, ZoneGeometry
from cell.messages.common import Count, Name

M = TypeVar("M")
SILENT_AFTER_S = 1.0
"""Who says nothing for so long is silent."""
SELDOM_SILENT_AFTER_S = 5.0
"""The same of what is repeated once a second."""
MOST_EVENTS = 500
_SELDOM: frozenset[type] = frozenset({ZoneGeometry, FramePose, PlannedWay})
_NAMED_BY: tuple[str, ...] = ("robot", "gateway", "zone", "frame", "cell")


class Newest:
    """The newest message of each kind and sender, and the last events; what is missing here is silent."""

    def __init__(self) -> None:
        self._heard: dict[tuple[type, Name], Arrived] = {}
        self.events: deque[tuple[Count, Arrived]] = deque(maxlen=MOST_EVENTS)
        """Newest last, each with its number: how many came before it."""
        self._events = 0
        self.now = -float("inf")
        """The time of the newest look."""

    def look(self, arrived: Iterable[Arrived], now: float) -> None:
        """Take what arrived. Where the time went back, a recording's seek, all of before is forgotten."""
        if now < self.now:
            self._heard.clear()
            self.events.clear()
        self.now = now
        for each in arrived:
            if isinstance(each.message, Event):
                self.events.append((self._events, each))
                self._events += 1
            else:
                self._heard[type(each.message), _name(each.message)] = each

    def of(self, kind: type[M]) -> Mapping[Name, M]:
        """By sender, those that are not silent."""
        names = [name for heard, name in self._heard if heard is kind]
        return {name: message for name in names if (message := self.heard(kind, name)) is not None}

    def heard(self, kind: type[M], name: Name) -> M | None:
        """That of one sender, unless he is silent."""
        last = self.last(kind, name)
        silent_after_s = SELDOM_SILENT_AFTER_S if kind in _SELDOM else SILENT_AFTER_S
        return last[0] if last is not None and self.now - last[1] <= silent_after_s else None

    def one(self, kind: type[M]) -> M | None:
        """Of the kind that one alone sends."""
        return next(iter(self.of(kind).values()), None)

    def last(self, kind: type[M], name: Name) -> tuple[M, float] | None:
        """The last one that was heard, and when, however long ago."""
        found = self._heard.get((kind, name))
        return (found.message, found.at) if found is not None and isinstance(found.message, kind) else None


def _name(message: object) -> Name:
    return next(name for field in _NAMED_BY if isinstance(name := getattr(message, field, None), str))
