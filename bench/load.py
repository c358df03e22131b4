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
from dataclasses import dataclass
from pathlib import Path

from bench.bare import bare_cell
from bench.gateway import copy_on_free_ports
from bench.timing import Row

SETTLE_S = 15.0
"""Until all processes run, the drives are on and both programs move."""
BARE_SETTLE_S = 3.0
ALLOWED_TWO_ARMS = 0.60
"""Of a core: what the project promises for two arms at 250 Hz, all processes together."""
_MODULES = {
    "cell.commands.main": "manager",
    "cell.commands.drive_gateway": "gateway",
    "cell.commands.robot_agent": "agent",
}
_WORDS = ("left", "right", "left_bus", "right_bus")
_TICK_S = 1.0 / os.sysconf("SC_CLK_TCK")
_CELL = "import sys\nfrom cell.commands.main import main\nsys.exit(main())"


def load(seconds: float = 30.0) -> list[Row]:
    """The example cell, its programs without end, beside bare messages and frames at its rates."""
    with tempfile.TemporaryDirectory() as folder:
        cell = copy_on_free_ports(Path(folder))
        without_end(cell.parent / "programs")
        with running(cell) as parent:
            time.sleep(SETTLE_S)
            seen = used(family(parent), seconds)
    with bare_cell() as processes:
        time.sleep(BARE_SETTLE_S)
        bare = sum(each.seconds for each in used(processes, seconds)) / seconds
    share = sum(each.seconds for each in seen) / seconds
    what = "two arms at 250 Hz, all processes, per second"
    return [
        Row(what, share, share / ALLOWED_TWO_ARMS, "of 60 % of a core"),
        Row(what, share, share / bare, "of bare messages and frames at the same rates"),
        *(
            Row(f"- {each.name}", each.seconds / seconds, each.seconds / seconds / share, "of all")
            for each in seen
            if each.seconds
        ),
    ]


@dataclass(frozen=True, slots=True)
class Used:
    """Processor time of a process."""

    name: str
    seconds: float


def used(processes: list[int], seconds: float) -> list[Used]:
    """Of each process, in so many seconds from now on."""
    before = [_cpu_s(pid) for pid in processes]
    time.sleep(seconds)
    return [Used(_name(pid), _cpu_s(pid) - had_s) for pid, had_s in zip(processes, before, strict=True)]


def without_end(programs: Path) -> None:
    """Programs that repeat do so for ever."""
    for program in programs.glob("*.prog"):
        program.write_text(re.sub(r"^GOTO again \d+$", "GOTO again 100000", program.read_text(), flags=re.MULTILINE))


@contextmanager
def running(cell: Path) -> Iterator[int]:
    """`cell up` with all programs; its process id.

    Raises RuntimeError: it ended by itself, so there was nothing to measure.
    """
    words = [sys.executable, "-c", _CELL, "up", str(cell), "--run"]
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield process.pid
        if process.poll() is not None:
            raise RuntimeError(f"cell up {cell} ended by itself with {process.returncode}; run it by hand to read why")
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


def family(parent: int) -> list[int]:
    """A process and all that it has started."""
    found, index = [parent], 0
    while index < len(found):
        for task in Path(f"/proc/{found[index]}/task").iterdir():
            found += [int(child) for child in (task / "children").read_text().split()]
        index += 1
    return found


def _name(pid: int) -> str:
    """Of a process of a cell, by its command line."""
    words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
    for module, name in _MODULES.items():
        if module in words:
            return " ".join([name, *(word for word in words[words.index(module) + 1 :][:3] if word in _WORDS)])
    return "cell up" if "up" in words else "planning"


def _cpu_s(pid: int) -> float:
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) * _TICK_S
