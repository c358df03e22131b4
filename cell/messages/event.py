"""What people should know: events and alarms."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from cell.messages.common import Count, Few, Name, Number, Text, Whole


class Severity(Enum):
    INFO = "info"
    WARNING = "warning"
    ALARM = "alarm"


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
