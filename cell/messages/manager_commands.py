"""What the manager is asked for: `manager/cmd/<verb>`."""

from dataclasses import dataclass
from typing import ClassVar

from cell.messages.call import Command
from cell.messages.event import Severity


@dataclass(frozen=True, slots=True)
class SetEstop(Command):
    verb: ClassVar[str] = "estop"
    id: str
    by: str
    reason: str


@dataclass(frozen=True, slots=True)
class ResetEstop(Command):
    """End these emergency stops, which the operator has seen, and no others."""

    verb: ClassVar[str] = "reset"
    by: str
    ids: tuple[str, ...]


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


@dataclass(frozen=True, slots=True)
class ListEvents(Command):
    """The newest `limit` of the stored events that fit; `data` of the reply is a `KeptEvents` in JSON."""

    verb: ClassVar[str] = "events"
    after: int = 0
    """Only events with a greater number."""
    before: int | None = None
    """Only events with a smaller number: for the page before one."""
    since: float | None = None
    """Only events that were heard at this moment or later [s since 1970, UTC]."""
    severity: Severity = Severity.INFO
    """Only events so severe or more, and those before which others were lost."""
    limit: int = 100
    """At most 200."""
