"""What people should know: events and alarms, and how the manager keeps them."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from cell.messages.common import Count, Few, Name, Number, Text, Whole
from cell.messages.state import Urgency, state


class Severity(Enum):
    INFO = "info"
    WARNING = "warning"
    ALARM = "alarm"


@state("event/{source}", Urgency.HIGH, most_chunks=2)
@dataclass(frozen=True, slots=True)
class Event:
    """Something happened. `code` is stable and greppable, `text` is for people, `remedy` says what to do next."""

    source: Name
    """Role and name, for example `robot/left`, `gateway/left_bus`, `manager`."""
    sequence: Count
    severity: Severity
    code: Name
    text: Text
    remedy: Text = ""
    data: Annotated[dict[Name, Text | Whole | Number | None], Few] = field(default_factory=dict)
    boot: Name = ""
    """Of the source: `sequence` grows by one within a boot, so who listens knows what was lost."""


@dataclass(frozen=True, slots=True)
class KeptEvent:
    """An event as the manager has stored it."""

    number: Count
    """Grows with every event that is stored, over restarts of the manager too."""
    at: Name
    """When the manager heard it: UTC, ISO 8601 with milliseconds, by the clock of the manager's computer."""
    event: Event
    lost: Count = 0
    """So many events of the same source before this one never reached the manager."""


@dataclass(frozen=True, slots=True)
class KeptEvents:
    """The answer to `ListEvents`, oldest first."""

    events: tuple[KeptEvent, ...]
    newest: Count
    """Number of the newest event that is stored; 0 when there is none."""
    problem: Text = ""
    """Why events are not stored at present, for people."""
