"""What people should know: events and alarms."""

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
