"""What the manager is asked for: `manager/cmd/<verb>`."""

from dataclasses import dataclass
from typing import ClassVar

from cell.messages.call import Command
from cell.messages.common import Name, Words


@dataclass(frozen=True, slots=True)
class SetEstop(Command):
    verb: ClassVar[str] = "estop"
    id: Name
    by: Words
    reason: Words


@dataclass(frozen=True, slots=True)
class ResetEstop(Command):
    verb: ClassVar[str] = "reset"
    by: Words


@dataclass(frozen=True, slots=True)
class ClearZone(Command):
    """The operator has looked: nobody is inside."""

    verb: ClassVar[str] = "clear_zone"
    zone: Name
    by: Words


@dataclass(frozen=True, slots=True)
class AdoptZone(Command):
    """The operator gives an orphaned zone to the robot that stands in it, under its new boot."""

    verb: ClassVar[str] = "adopt_zone"
    zone: Name
    robot: Name
    by: Words
