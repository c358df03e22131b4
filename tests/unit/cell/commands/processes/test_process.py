"""The log of a child of `cell up`: times, rotation, and what is printed beside it."""

import re
import subprocess
import sys
from pathlib import Path

from cell.commands.processes.process import OLD_LOGS
from tests.unit.repository import ROOT

LOGS_AND_PRINTS = """
import logging, os, sys
from pathlib import Path
from cell.commands.processes.process import log_to
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
