"""Log lines of a process as JSON: time, source and text, and what is more where the line tells an event."""

import json
import logging
import re
import sys

from cell.commands.processes.json_log import JsonLog
from cell.messages import Event, Severity


def told(level: int, text: str, *words: object, **more: object) -> dict[str, object]:
    record = logging.getLogger("drive_gateway").makeRecord("drive_gateway", level, "", 1, text, words, **more)
    line = JsonLog("gateway-left_bus").format(record)
    assert "\n" not in line
    found: dict[str, object] = json.loads(line)
    return found


def test_a_line_has_its_source_time_severity_and_text() -> None:
    line = told(logging.WARNING, "%s is not\nwritten", "reach.json", exc_info=None)
    assert list(line)[:2] == ["kind", "name"]
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z", str(line.pop("at")))
    assert line == {
        "kind": "log", "name": "gateway/left_bus", "severity": "warning", "logger": "drive_gateway",
        "text": "reach.json is not\nwritten",
    }  # fmt: skip


def test_an_event_is_told_with_its_code_and_remedy() -> None:
    event = Event("gateway/left_bus", 7, Severity.ALARM, "node_lost", "node 1 was lost", "check power")
    line = told(logging.ERROR, "%s", event.text, exc_info=None, extra={"event": event})
    assert [line[key] for key in ("severity", "code", "text", "remedy")] == [
        "alarm", "node_lost", "node 1 was lost", "check power",
    ]  # fmt: skip


def test_an_exception_is_in_the_same_line_as_what_was_said_of_it() -> None:
    try:
        raise ValueError("no")
    except ValueError:
        line = told(logging.ERROR, "planning line %d", 3, exc_info=sys.exc_info())
    assert line["text"] == "planning line 3"
    assert str(line["trace"]).endswith("ValueError: no")
