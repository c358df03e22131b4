"""A process' log: on its terminal or in a file that rotates, as text or, for programs, as JSON."""

import json
import logging
import os
from datetime import UTC, datetime
from logging.handlers import RotatingFileHandler
from pathlib import Path

from cell.messages import Event

LOG_BYTES = 1_000_000
OLD_LOGS = 4
TEXT = logging.Formatter("%(asctime)s %(levelname)s %(name)s: %(message)s")
_SEVERITY = {logging.DEBUG: "info", logging.INFO: "info", logging.WARNING: "warning"}
"""Above them all is an alarm."""


class JsonLog(logging.Formatter):
    """One JSON object per line, in the form of lists (`cell.commands.client.json_lines`).

    Those of the process robot-left are said by `robot/left`, as in its events.
    """

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


def log_to(path: Path, form: logging.Formatter = TEXT, most_bytes: int = LOG_BYTES) -> None:
    """Append the process' log, and all that it prints, to `path`; a full file becomes `path.1`, at most 4 are kept."""
    log_by(_LogFile(path, most_bytes), form)


def log_by(handler: logging.Handler, form: logging.Formatter) -> None:
    """All that the process logs goes to `handler`."""
    handler.setFormatter(form)
    logging.basicConfig(level=logging.INFO, handlers=[handler])


class _LogFile(RotatingFileHandler):
    """A log that stdout and stderr go to as well: what is printed there, and the last words of a dying interpreter."""

    def __init__(self, path: Path, most_bytes: int) -> None:
        super().__init__(path, maxBytes=most_bytes, backupCount=OLD_LOGS, encoding="utf-8")
        self._take_over()

    def doRollover(self) -> None:
        super().doRollover()
        self._take_over()

    def _take_over(self) -> None:
        if self.stream is not None:
            for fd in (1, 2):
                os.dup2(self.stream.fileno(), fd)
