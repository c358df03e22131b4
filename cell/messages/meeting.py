"""What robots and the manager tell each other about meetings: parts of `Presence` and `ManagerState`."""

from dataclasses import dataclass, field
from typing import Annotated

from cell.messages.common import Count, Duration, Few, Name, Text


@dataclass(frozen=True, slots=True)
class Arrival:
    """One robot's coming to one MEET, once: no two have the same."""

    boot: Name
    """Of its agent."""
    number: Count
    """Counts what that agent's programs came to."""


@dataclass(frozen=True, slots=True)
class Attendance:
    """The MEET at which a running program waits."""

    meeting: Name
    number: Count
    """As in `Arrival`."""
    held_up: Text = ""
    """Why the robot may not leave yet, for people; empty when it may."""


@dataclass(frozen=True, slots=True)
class Meets:
    """What a robot says of its meetings."""

    waits: Attendance | None = None
    left: Annotated[dict[Name, Annotated[dict[Name, Arrival], Few]], Few] = field(default_factory=dict)
    """Meeting that it left: by robot the arrivals that were released together, the newest time. A manager that is
    started again knows by it who may leave still."""
    held_up: Text = ""
    """For what else its running program waits, an input or an answer, for people."""


@dataclass(frozen=True, slots=True)
class MeetingStatus:
    """A meeting as the manager sees it.

    A robot leaves when its own arrival is in `released`. The newest release stays here until all have arrived anew:
    nobody has to have heard it by a certain time, and nobody leaves twice by it.
    """

    there: Annotated[tuple[Name, ...], Few] = ()
    """Robots that wait for others."""
    missing: Annotated[dict[Name, Text], Few] = field(default_factory=dict)
    """For whom they wait, and what is with those, for people; empty while nobody waits."""
    released: Annotated[dict[Name, Arrival], Few] = field(default_factory=dict)
    """By robot, all of the meeting, the arrivals that leave together; empty before the first time."""
    leave_at: Duration | None = None
    """Cell time [s] at which they leave; None: by the clock of a manager of before, so whoever waits still goes now."""
