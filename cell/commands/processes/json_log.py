"""A process' log for programs: one JSON object per line, in the form of lists (`cell.commands.client.json_lines`)."""

import json
import logging
from datetime import UTC, datetime

from cell.messages import Event

_SEVERITY = {logging.DEBUG: "info", logging.INFO: "info", logging.WARNING: "warning"}
"""Above them all is an alarm."""


class JsonLog(logging.Formatter):
    """The lines of the process `part`: robot-left says them as `robot/left`, as in its events."""

    def __init__(self, part: str) -> None:
        super().__init__()
        self._name = part.replace("-", "/", 1)

    def format(self, record: logging.LogRecord) -> str:
        """Time and severity as in `cell events --json`; an event that is logged is told with code and remedy."""
        told = {
            "kind": "log",
            "name": self._name,
            "at": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z"),
            "severity": _SEVERITY.get(record.levelno, "alarm"),
            "logger": record.name,
        }
        event = getattr(record, "event", None)
        if isinstance(event, Event):
            told |= {"text": event.text, "code": event.code, "remedy": event.remedy}
        else:
            told["text"] = record.getMessage()
        if record.exc_info is not None:
            told["trace"] = self.formatException(record.exc_info)
        return json.dumps(told)
