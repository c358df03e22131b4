"""The space that a robot's way takes, in pieces, and what the manager clears of it (`docs/architecture.md`, 4.5)."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from annotated_types import MaxLen
from numpy.typing import NDArray

from cell.messages.common import Count, Duration, Few, Name, Number, Text
from cell.messages.state import Urgency, state

Single = NDArray[np.float32]
"""As it travels."""
Pieces = NDArray[np.uint32]
NO_PIECE = 2**32 - 1
MOST_SECTIONS = 2000
"""In one presence."""
MOST_STAYS = 1000
"""In one planned way."""


@dataclass(frozen=True, slots=True, eq=False)
class Sections:
    """Pieces of a robot's way, in the order of travel: what covers its body wherever it is within each.

    A section is cut once, when its motion is planned; its id is a hash of what it covers, so a section with a known id
    is the same space as before.
    """

    ids: NDArray[np.uint64] = field(default_factory=lambda: np.empty(0, np.uint64))
    """`(s,)`"""
    points: Single = field(default_factory=lambda: np.empty((0, 0, 2, 3), np.float32))
    """`(s, c, 2, 3)` [m]: end points of the capsules' axes in world, those of the links in their order."""
    radii: Single = field(default_factory=lambda: np.empty((0, 0), np.float32))
    """`(s, c)` [m]: of the capsules, grown by all that the body may be beside them within the section."""

    def __len__(self) -> int:
        return len(self.ids)

    def __getitem__(self, some: slice | NDArray[np.intp]) -> "Sections":
        return Sections(self.ids[some], self.points[some], self.radii[some])

    def joined(self, others: "Sections") -> "Sections":
        """These and the others after them; where bodies have fewer capsules, their first one counts several times."""
        if not len(self) or not len(others):
            return self if len(self) else others
        most = max(self.radii.shape[1], others.radii.shape[1])
        one, other = self._with(most), others._with(most)
        ids = np.concatenate([one.ids, other.ids])
        points = np.concatenate([one.points, other.points])
        return Sections(ids, points, np.concatenate([one.radii, other.radii]))

    def _with(self, capsules: int) -> "Sections":
        which = np.arange(capsules) % max(capsules, 1)
        which[self.radii.shape[1] :] = 0
        return (
            self
            if len(which) == self.radii.shape[1]
            else Sections(self.ids, self.points[:, which], self.radii[:, which])
        )


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """The sections of a robot from where it is measured on, in the order of travel.

    The first `committed` may be passed by what was sent, all of them up to rest; the first `owned` it may use without
    asking, the others it asks for.
    """

    sections: Sections = field(default_factory=Sections)
    committed: Count = 0
    owned: Count = 0
    links: Annotated[tuple[Name, ...], Few] = ()
    """The link that each of a section's capsules is of."""
    fixed: Annotated[tuple[Count, ...], Few] = ()
    """The capsules that never move: of the base."""
    plan: Count = 0
    """Number of the `PlannedWay` that `pieces` count in; 0: none."""
    pieces: Pieces = field(default_factory=lambda: np.empty(0, np.uint32))
    """`(s,)`: the piece of the planned way in which each section lies; `NO_PIECE` for one that lies in none. Empty
    without a plan."""


@dataclass(frozen=True, slots=True)
class Stay:
    """The pieces of a planned way that lead through an exclusive zone."""

    zone: Name
    first: Count
    """From somewhere in here on the robot needs the zone: with others between which it does not stop, from the first
    of them on."""
    last: Count
    """To somewhere in here."""


@state("robot/{robot}/planned_way")
@dataclass(frozen=True, slots=True, eq=False)
class PlannedWay:
    """The space of all motions that a robot has planned, in coarse pieces: by it robots do not block each other.

    Repeated, and told anew when more is planned; the robot is somewhere along it.
    """

    robot: Name
    boot: Name
    owner: Count
    """The claim of its agent."""
    number: Count
    """Grows with each new plan under one claim; from 1."""
    more: bool
    """The program goes on after these motions."""
    pieces: Sections = field(default_factory=Sections)
    """In the order in which they are passed."""
    stays: Annotated[tuple[Stay, ...], MaxLen(MOST_STAYS)] = ()
    """In the zones of the cell, in the order in which they begin."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """Why no more is cleared for a robot."""

    by: Name
    """The robot that is in the way."""
    text: Text
    """For people."""
    link: Name = ""
    other_link: Name = ""
    distance_m: Number = 0.0
    """Of the two links, their growth included."""
    since: Duration = 0.0
    """Cell time [s] since which the robot has been cleared nothing."""


@state("robot/{robot}/clearance", Urgency.REAL_TIME)
@dataclass(frozen=True, slots=True)
class Clearance:
    """The manager's answer to a presence that asks: the first `cleared` of the sections asked for may be used."""

    robot: Name
    boot: Name
    """Of the manager."""
    epoch: Count
    owner: Count
    """The claim of the presence that is answered."""
    presence: Count
    """Its sequence."""
    number: Count
    """Grows from one clearance of a robot to the next, under one manager."""
    cleared: Count
    refused: Refusal | None = None
    """Why not all of it was cleared."""
    look_further: bool = False
    """By what is known of their plans it shares room with another robot: more of its program should be planned."""
