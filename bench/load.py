"""A whole cell as it runs on simulated drives: the processor time of each process."""

import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from bench.gateway import copy_on_free_ports
from bench.timing import Row

SETTLE_S = 15.0
"""Until all processes run, the drives are on and both programs move."""
ALLOWED_TWO_ARMS = 0.60
"""Of a core: what the project promises for two arms at 250 Hz, all processes together."""
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
_CELL = "from cell.commands.cell import main\nmain()"


def load(seconds: float = 30.0) -> list[Row]:
    """The example cell, its programs without end."""
    with tempfile.TemporaryDirectory() as folder:
        cell = copy_on_free_ports(Path(folder))
        _without_end(cell.parent / "programs")
        used = measure(cell, seconds)
    share = sum(used.values()) / seconds
    total = Row("two arms at 250 Hz, all processes, per second", share, share / ALLOWED_TWO_ARMS, "of 60 % of a core")
    parts = [(f"- {name}", used_s / seconds) for name, used_s in used.items()]
    return [total, *(Row(name, part, part / share, "of all of them") for name, part in parts)]


def measure(cell: Path, seconds: float) -> dict[str, float]:
    """Processor time [s] of each process of a cell that runs its programs, in so many seconds."""
    with _running(cell) as parent:
        time.sleep(SETTLE_S)
        before = {pid: _cpu_s(pid) for pid in _family(parent)}
        time.sleep(seconds)
        after = {pid: _cpu_s(pid) for pid in before}
        return {_name(pid): after[pid] - before[pid] for pid in before}


def _without_end(programs: Path) -> None:
    for program in programs.glob("*.prog"):
        program.write_text(re.sub(r"^GOTO again \d+$", "GOTO again", program.read_text(), flags=re.MULTILINE))


@contextmanager
def _running(cell: Path) -> Iterator[int]:
    words = [sys.executable, "-c", _CELL, "up", str(cell), "--run"]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process.pid
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def _family(parent: int) -> list[int]:
    """A process and all that it has started."""
    found, index = [parent], 0
    while index < len(found):
        for task in Path(f"/proc/{found[index]}/task").iterdir():
            found += [int(child) for child in (task / "children").read_text().split()]
        index += 1
    return found


def _name(pid: int) -> str:
    words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
    return " ".join(word for word in words if word and not word.startswith(("/", "-")))[-60:]


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICK_S
