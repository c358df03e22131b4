"""The space that a robot's way takes, in pieces, and what the manager clears of it.

What agents and manager will say to each other when robots share space without zones (`docs/architecture.md`, section
4.5, planned). The rules are built on it already; no process sends it yet.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from cell.messages.common import Count, Heard, Name, Number, Text

Single = NDArray[np.float32]
"""As it travels."""


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


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """The sections of a robot from where it is measured on, in the order of travel.

    The first `committed` may be passed by what was sent, all of them up to rest; the first `owned` it may use without
    asking, the others it asks for.
    """

    sections: Sections = field(default_factory=Sections)
    committed: int = 0
    owned: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class WayReport:
    """What an agent says of its robot's way."""

    robot: Name
    boot: Name
    owner: Count
    """The claim under which the agent owns the robot; it orders the runs of a robot's agents."""
    sequence: Count
    heard: Heard | None
    """The newest manager state that was heard."""
    epoch: Count
    """The highest of a manager that is known."""
    taken: Count
    """Number of that manager's newest clearance that was taken."""
    known: bool
    """The robot knows where it is; until then it may be anywhere within its reach."""
    way: Way


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


@dataclass(frozen=True, slots=True)
class Clearance:
    """The manager's answer to a report that asks: the first `cleared` of the sections asked for may be used."""

    robot: Name
    boot: Name
    """Of the manager."""
    epoch: Count
    owner: Count
    """The claim of the report that is answered."""
    report: Count
    """Its sequence."""
    number: Count
    """Grows from one clearance of a robot to the next, under one manager."""
    cleared: Count
    refused: Refusal | None = None
    """Why not all of it was cleared."""
