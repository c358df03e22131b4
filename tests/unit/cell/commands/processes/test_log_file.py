"""The log of a process: times, rotation, what is printed beside it; as JSON, what an event tells."""

import json
import logging
import re
import subprocess
import sys
from pathlib import Path

from cell.commands.processes.log_file import OLD_LOGS, JsonLog
from cell.messages import Event, Severity
from tests.unit.repository import ROOT

LOGS_AND_PRINTS = """
import logging, os, sys
from pathlib import Path
from cell.commands.processes.log_file import log_to
log_to(Path(sys.argv[1]), most_bytes=2000)
for number in range(int(sys.argv[2])):
    logging.getLogger("robot_agent").info("line %d", number)
print("printed", flush=True)
os.write(2, b"last words\\n")
"""
TIMED = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d,\d{3} INFO robot_agent: line \d+")


def run(log: Path, lines: int) -> None:
    words = [sys.executable, "-c", LOGS_AND_PRINTS, str(log), str(lines)]
    subprocess.run(words, check=True, cwd=ROOT, timeout=60)


def test_a_log_has_times_is_bounded_and_takes_what_is_printed_after_a_rotation(tmp_path: Path) -> None:
    log = tmp_path / "robot-left.log"
    run(log, 200)
    *timed, printed, last = log.read_text().splitlines()
    assert (printed, last) == ("printed", "last words")
    assert all(TIMED.fullmatch(line) for line in timed)
    assert timed[-1].endswith("line 199")
    files = sorted(tmp_path.iterdir())
    assert [file.name for file in files] == [log.name, *(f"{log.name}.{n}" for n in range(1, OLD_LOGS + 1))]
    assert all(file.stat().st_size < 2100 for file in files)


def test_a_log_is_continued_by_the_next_run(tmp_path: Path) -> None:
    log = tmp_path / "robot-left.log"
    log.write_text("before\n")
    run(log, 3)
    before, *lines = log.read_text().splitlines()
    assert (before, len(lines)) == ("before", 5)


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
