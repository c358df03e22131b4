"""Where the page's messages come from: a running cell, or whatever plays one back."""

import time
from typing import Protocol

from cell.core import Arrived
from cell.net.session import CellSession

STATES = (
    "manager/state",
    "robot/*/state",
    "robot/*/presence",
    "robot/*/planned_way",
    "robot/*/clearance",
    "robot/*/drives",
    "gateway/*/state",
    "zone/*",
    "frame/*",
)
"""What the page shows the newest of."""
EVENTS = "event/**"
"""What the page shows all of."""


class Source(Protocol):
    """Messages of a cell with the times at which they arrived, on one clock."""

    def take_new(self) -> list[Arrived]:
        """What arrived since the last call: of each state the newest is enough, of events every one; oldest first."""

    def now(self) -> float:
        """The time by the clock of the messages [s]. A recording's goes as fast as it is played, and back in a seek."""


class Player(Source, Protocol):
    """A recording that is played; not for several threads."""

    began: float
    ends: float
    """Of the recording, by the clock of its messages [s]."""

    def pace(self, speed: float) -> None:
        """Go on so many times as fast as it was; 0 stands."""

    def seek(self, at: float) -> None:
        """Go on from a moment [s]."""


class LiveSource:
    """The messages of a running cell."""

    def __init__(self, session: CellSession) -> None:
        self._states = session.watch(*STATES)
        self._events = session.queue(EVENTS)

    def take_new(self) -> list[Arrived]:
        """See `Source`."""
        events = [Arrived(event, self.now()) for event in self._events.take()]
        return sorted([*self._states.take_arrived(), *events], key=lambda arrived: arrived.at)

    def now(self) -> float:
        """See `Source`."""
        return time.monotonic()
