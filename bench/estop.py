"""An emergency stop: from the start of the command to the first message that a process of the cell hears."""

import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from bench.timing import Row, median_s
from cell.net.options import Link
from cell.net.session import CellSession

REPEATS = 15
PROMISED_S = 0.3
WAIT_S = 10.0
COMMAND = [sys.executable, "-m", "cell.commands.main", "estop", "-f"]


def emergency_stop() -> list[Row]:
    """The command as a process of its own, beside an interpreter that does nothing."""
    interpreter_s = median_s(lambda: subprocess.run([sys.executable, "-c", "pass"], check=True))
    first_s = [_first_heard_s() for _ in range(REPEATS + 1)][1:]
    median, worst = float(np.median(first_s)), max(first_s)
    to = f"of 0.3 s; worst {1e3 * worst:.0f} ms, the interpreter's own start {1e3 * interpreter_s:.0f} ms: "
    to += f"{median / interpreter_s:.3g} of them"
    return [Row("cell estop: from its start to the first message heard", median, median / PROMISED_S, to)]


def _first_heard_s() -> float:
    with socket.create_server(("127.0.0.1", 0)) as free:
        endpoint = f"tcp/127.0.0.1:{free.getsockname()[1]}"
    with tempfile.TemporaryDirectory() as folder:
        cell = Path(folder) / "cell.yaml"
        cell.write_text(f"cell: bench\nmanager: {{endpoint: '{endpoint}'}}\n")
        pause = threading.Event()
        with CellSession("bench", Link("peer", listen=(endpoint,)), "bench", "bench", "b1") as session:
            inbox = session.queue("estop")
            start = time.perf_counter()
            command = subprocess.Popen([*COMMAND, str(cell)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            try:
                while not inbox.take():
                    if time.perf_counter() - start > WAIT_S:
                        raise RuntimeError(f"no emergency stop within {WAIT_S:g} s")
                    pause.wait(0.0005)
                return time.perf_counter() - start
            finally:
                command.kill()
                command.wait()
