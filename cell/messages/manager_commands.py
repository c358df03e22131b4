"""What the manager is asked for: `manager/cmd/<verb>`."""

from dataclasses import dataclass
from typing import ClassVar

from cell.messages.call import Command


@dataclass(frozen=True, slots=True)
class SetEstop(Command):
    verb: ClassVar[str] = "estop"
    id: str
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class ResetEstop(Command):
    verb: ClassVar[str] = "reset"
    by: str


@dataclass(frozen=True, slots=True)
class ClearZone(Command):
    """The operator has looked: nobody is inside."""

    verb: ClassVar[str] = "clear_zone"
    zone: str
    by: str


@dataclass(frozen=True, slots=True)
class ClearSetup(Command):
    """The operator has looked: a robot in set-up whose gateway is silent stands, and stays so."""

    verb: ClassVar[str] = "clear_setup"
    robot: str
    by: str


@dataclass(frozen=True, slots=True)
class AdoptZone(Command):
    """The operator gives an orphaned zone to the robot that stands in it, under its new boot."""

    verb: ClassVar[str] = "adopt_zone"
    zone: str
    robot: str
    by: str
