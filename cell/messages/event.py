"""What people should know: events and alarms, and how the manager keeps them."""

from dataclasses import dataclass, field
from enum import Enum


class Severity(Enum):
    INFO = "info"
    WARNING = "warning"
    ALARM = "alarm"


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened. `code` is stable and greppable, `text` is for people, `remedy` says what to do next."""

    source: str
    """Role and name, for example `robot/left`, `gateway/left_bus`, `manager`."""
    sequence: int
    severity: Severity
    code: str
    text: str
    remedy: str = ""
    data: dict[str, str | int | float | None] = field(default_factory=dict)
    boot: str = ""
    """Of the source: `sequence` grows by one within a boot, so who listens knows what was lost."""


@dataclass(frozen=True, slots=True)
class KeptEvent:
    """An event as the manager has stored it."""

    number: int
    """Grows with every event that is stored, over restarts of the manager too."""
    at: str
    """When the manager heard it: UTC, ISO 8601 with milliseconds, by the clock of the manager's computer."""
    event: Event
    lost: int = 0
    """So many events of the same source before this one never reached the manager."""


@dataclass(frozen=True, slots=True)
class KeptEvents:
    """The answer to `ListEvents`, oldest first."""

    events: tuple[KeptEvent, ...]
    newest: int
    """Number of the newest event that is stored; 0 when there is none."""
    problem: str = ""
    """Why events are not stored at present, for people."""
