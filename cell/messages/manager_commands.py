"""What the manager is asked for: `manager/cmd/<verb>`."""

from dataclasses import dataclass, field
from typing import Annotated, ClassVar

import numpy as np
from annotated_types import Ge, Le, MaxLen

from cell.geometry import SpaceOf, measured_solid
from cell.messages.call import Command, command
from cell.messages.common import Count, Few, Name, Number, Vector, Words, check_quaternion
from cell.messages.event import Severity
from cell.messages.manager_state import Confinement
from cell.messages.zone import Edge

Rank = Annotated[int, Ge(0), Le(1000)]


@command("manager")
@dataclass(frozen=True, slots=True)
class SetEstop(Command):
    """As an `Estop`, which cuts its texts."""

    verb: ClassVar[str] = "estop"
    id: Name
    by: str
    reason: str


@command("manager")
@dataclass(frozen=True, slots=True)
class ResetEstop(Command):
    """End these emergency stops, which the operator has seen, and no others."""

    verb: ClassVar[str] = "reset"
    by: Words
    ids: Annotated[tuple[Name, ...], Few]


@command("manager")
@dataclass(frozen=True, slots=True)
class ClearZone(Command):
    """The operator has looked: nobody is inside."""

    verb: ClassVar[str] = "clear_zone"
    zone: Name
    by: Words


@command("manager")
@dataclass(frozen=True, slots=True)
class ClearSetup(Command):
    """The operator has looked: a robot in set-up whose gateway is silent stands, and stays so."""

    verb: ClassVar[str] = "clear_setup"
    robot: Name
    by: Words


@command("manager")
@dataclass(frozen=True, slots=True)
class ConfineRobot(Command):
    """The operator's word that a robot which does not tell where it is stays inside a box."""

    verb: ClassVar[str] = "confine"
    robot: Name
    box: Confinement
    by: Words


@command("manager")
@dataclass(frozen=True, slots=True)
class RobotStands(Command):
    """The operator's word that a robot which does not tell where it is stands where it was last known."""

    verb: ClassVar[str] = "stands"
    robot: Name
    by: Words


@command("manager")
@dataclass(frozen=True, slots=True)
class EndAssurance(Command):
    """What an operator has said of where this robot stays does not hold any more."""

    verb: ClassVar[str] = "end_assurance"
    robot: Name
    by: Words


@command("manager")
@dataclass(frozen=True, slots=True)
class AdoptZone(Command):
    """The operator gives an orphaned zone to the robot that stands in it, under its new boot."""

    verb: ClassVar[str] = "adopt_zone"
    zone: Name
    robot: Name
    by: Words


@command("manager")
@dataclass(frozen=True, slots=True)
class PlaceFrame(Command):
    """Give a frame this pose in its parent, in the manager's cell file and in the running cell.

    `data` of the reply is the version under which it is there.
    """

    verb: ClassVar[str] = "place_frame"
    frame: Name
    position_m: Vector
    quaternion_xyzw: tuple[float, float, float, float]
    by: Words

    def __post_init__(self) -> None:
        """Raises `ValueError` when the quaternion is no orientation."""
        check_quaternion(self.quaternion_xyzw)


@command("manager")
@dataclass(frozen=True, slots=True)
class TeachFrame(Command):
    """Place a frame by points measured in world; the reply is that of `PlaceFrame`."""

    verb: ClassVar[str] = "teach_frame"
    frame: Name
    points_m: tuple[Vector, Vector, Vector]
    """Two on its X, in its direction, and one on its Y: its origin is the foot of that on X."""
    by: Words
    origin_m: Vector | None = None
    """Its origin instead of the foot."""


@dataclass(frozen=True, slots=True)
class Place:
    """A pose in the frame in which something is given."""

    position_m: Vector
    quaternion_xyzw: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        """Raises `ValueError` when the quaternion is no orientation."""
        check_quaternion(self.quaternion_xyzw)


@command("manager")
@dataclass(frozen=True, slots=True)
class SetZone(Command):
    """Change a zone, in the manager's cell file and in the running cell; what is left out stays as it is.

    `data` of the reply is the version under which it is there.
    """

    verb: ClassVar[str] = "set_zone"
    zone: Name
    by: Words
    place: Place | None = None
    """Of its middle, in the frame in which the cell file gives it."""
    shape: Name | None = None
    """As in `ZoneGeometry`, with `size_m`."""
    size_m: Annotated[tuple[Edge, ...], MaxLen(10)] = ()
    of: SpaceOf | None = None
    priority: Annotated[dict[Name, Rank], Few] = field(default_factory=dict)
    """By robot: before how many others that wait it goes. Who is left out keeps his."""

    def __post_init__(self) -> None:
        """Raises `ValueError` where nothing would change, and for a shape that is none."""
        if self.shape is not None:
            measured_solid(self.shape, self.size_m, np.eye(4))
        elif self.size_m:
            raise ValueError("lengths without a shape")
        if self.place is None and self.shape is None and self.of is None and not self.priority:
            raise ValueError("nothing to change: a place, a shape, of, or a priority is missing")


@command("manager")
@dataclass(frozen=True, slots=True)
class ListEvents(Command):
    """The newest `limit` of the stored events that fit; `data` of the reply is a `KeptEvents` in JSON."""

    verb: ClassVar[str] = "events"
    after: Count = 0
    """Only events with a greater number."""
    before: Count | None = None
    """Only events with a smaller number: for the page before one."""
    since: Number | None = None
    """Only events that were heard at this moment or later [s since 1970, UTC]."""
    severity: Severity = Severity.INFO
    """Only events so severe or more, and those before which others were lost."""
    limit: Count = 100
    """At most 200."""
