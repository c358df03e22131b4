"""What the manager permits, as repeated state."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from annotated_types import Gt, Le

from cell.messages.common import Count, Duration, Few, Heard, Name, Text, Token, Vector, Words, check_quaternion
from cell.messages.estop import Estop
from cell.messages.meeting import MeetingStatus
from cell.messages.state import Urgency, state


class ZoneState(Enum):
    """An exclusive zone: who may be inside (grant) and whose body is inside (occupancy) are two things."""

    FREE = "free"
    GRANTED = "granted"
    OCCUPIED = "occupied"
    ORPHANED = "orphaned"


@dataclass(frozen=True, slots=True)
class ZoneStatus:
    """A zone as the manager sees it. `since` is cell time [s] of the last change of state or holder."""

    state: ZoneState
    holder: Name | None
    token: Token | None
    queue: Annotated[tuple[Name, ...], Few]
    version: Count
    since: Duration
    reason: Text = ""
    """Why nobody is granted the zone although robots wait for it, or why it is orphaned; for people."""
    by: Name = ""
    """The robot for which it is not granted to the first in the queue, though it is free; empty: there is none."""


@dataclass(frozen=True, slots=True)
class SetupStatus:
    """The one robot of the cell in set-up: its drives may make motions of their own, all others stay at rest."""

    robot: Name
    free: bool
    """Every other robot has confirmed that it stands, and stays so: the motion may begin and go on."""
    reason: Text = ""
    """Why it is not free, for people."""


_Edge = Annotated[float, Gt(0.0), Le(1e6)]


@dataclass(frozen=True, slots=True)
class Confinement:
    """A box: full edge lengths along its own axes [m], its middle and its orientation in world."""

    size_m: tuple[_Edge, _Edge, _Edge]
    position_m: Vector
    quaternion_xyzw: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        """Raises `ValueError` when the quaternion is no orientation."""
        check_quaternion(self.quaternion_xyzw)


@dataclass(frozen=True, slots=True)
class Assurance:
    """An operator's word on where a robot stays that does not tell it itself; it ends when the robot does."""

    by: Words
    box: Confinement | None = None
    """All of it stays in there; None: it stands where it was last known."""


@dataclass(frozen=True, slots=True)
class Deadlock:
    """Robots that wait for each other: each needs now a zone that the next one holds, or room in which that stands.

    `zones` are those of them that are zones, in this order. Without any of them: each needs room, or waits for the next
    one at a meeting.
    """

    robots: Annotated[tuple[Name, ...], Few]
    zones: Annotated[tuple[Name, ...], Few]
    since: Duration
    """Cell time [s] at which it was found."""
    text: Text
    """Who waits for what, for people."""
    remedy: Text
    """The commands that free them."""


@state("manager/state", Urgency.INTERACTIVE)
@dataclass(frozen=True, slots=True)
class ManagerState:
    """The one message that permits motion; every agent checks that it answers its own newest presence."""

    cell: Name
    boot: Name
    epoch: Count
    sequence: Count
    cell_time: Duration
    digest: Name
    heard: Annotated[dict[Name, Heard], Few] = field(default_factory=dict)
    zones: Annotated[dict[Name, ZoneStatus], Few] = field(default_factory=dict)
    refused: Annotated[dict[Name, Text], Few] = field(default_factory=dict)
    """Robots that get no grants, and why (another configuration digest, not configured, unknown body)."""
    estops: Annotated[tuple[Estop, ...], Few] = ()
    """All that are in force, oldest first."""
    setup: SetupStatus | None = None
    setup_refused: Annotated[dict[Name, Text], Few] = field(default_factory=dict)
    """Robots that are to be set up and must wait: why, for people."""
    heard_gateways: Annotated[dict[Name, Heard], Few] = field(default_factory=dict)
    """Gateway: its newest state that the manager received."""
    deadlocks: Annotated[tuple[Deadlock, ...], Few] = ()
    frames: Annotated[dict[Name, Count], Few] = field(default_factory=dict)
    """Frame: the version in force."""
    meetings: Annotated[dict[Name, MeetingStatus], Few] = field(default_factory=dict)
    zone_change: Name | None = None
    """The zone that is being changed: all robots stay at rest, and it is granted to nobody, until that is over."""
    assured: Annotated[dict[Name, Assurance], Few] = field(default_factory=dict)
    """Robot: what an operator has said of where it stays, as long as that counts."""
