"""How soon the manager answers a robot that asks for room: the example cell, seen by a client on the same host.

`python -m bench clearance` alone. Presence and clearance come to the client from the manager on one link, so what is
measured is how long the manager waits and works. Beside it a process that answers each presence and does nothing else,
whose messages pass through the manager's links, too: what this machine costs, with all processes of the cell on it.
"""

import multiprocessing
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import numpy as np
import zenoh

from bench.gateway import copy_on_free_ports
from bench.load import SETTLE_S, running, without_end
from bench.timing import Row
from cell.config import load_cell
from cell.config.settings import CellSettings
from cell.messages import Clearance, Presence
from cell.net.codec import decode
from cell.net.keys import Keys
from cell.net.options import Link, ZenohOptions, zenoh_config
from cell.net.runner import Priority, scheduling
from cell.net.session import CellSession

SECONDS = 20.0
ALLOWED_S = 0.004
"""From the presence that asks to its answer, in 99 of 100."""
_ECHO = "bench/echo"
_START_S = 30.0


def clearances() -> list[Row]:
    """The median and the 99th percentile, while both programs run without end."""
    with tempfile.TemporaryDirectory() as folder:
        cell = copy_on_free_ports(Path(folder))
        without_end(cell.parent / "programs")
        with running(cell):
            time.sleep(SETTLE_S)
            with _echo(cell):
                answered, echoed = _waits(cell)
    return list(_rows(answered, echoed))


def _rows(answered: list[float], echoed: list[float]) -> Iterator[Row]:
    for name, share in (("median", 50), ("99th percentile", 99)):
        wait, bare = float(np.percentile(answered, share)), float(np.percentile(echoed, share))
        what = f"clearance, {name} of {len(answered)}"
        yield Row(what, wait, wait / ALLOWED_S, "of 4 ms")
        yield Row(what, wait, wait / bare, f"of an answer without any work, {1e3 * bare:.1f} ms")


@contextmanager
def _echo(cell: Path) -> Iterator[None]:
    """A process that answers each presence with its own beginning."""
    context = multiprocessing.get_context("spawn")
    runs = context.Event()
    process = context.Process(target=_answer_all, args=(load_cell(cell), runs), daemon=True)
    process.start()
    try:
        if not runs.wait(_START_S):
            raise RuntimeError(f"the process that answers did not start within {_START_S} s")
        yield
    finally:
        process.terminate()
        process.join()


def _answer_all(settings: CellSettings, runs: threading.Event) -> None:
    prefix = Keys(settings.name).prefix
    with ExitStack() as stack:
        with scheduling(Priority.FEEDING):  # as the manager's
            config = zenoh_config(Link("client", connect=(settings.manager_endpoint,)), ZenohOptions())
            session = stack.enter_context(zenoh.open(config))
        publisher = session.declare_publisher(prefix + _ECHO, express=True, priority=zenoh.Priority.REAL_TIME)

        def answer(sample: zenoh.Sample) -> None:
            presence = decode(Presence, sample.payload.to_bytes())
            publisher.put(_name(presence))

        session.declare_subscriber(f"{prefix}robot/*/presence", answer)
        runs.set()
        threading.Event().wait()


def _name(presence: Presence) -> str:
    return f"{presence.robot} {presence.owner} {presence.sequence}"


def _waits(cell: Path) -> tuple[list[float], list[float]]:
    """From each presence that is answered by a clearance to that, and from each to its echo [s]."""
    settings = load_cell(cell)
    heard: list[tuple[float, str, bytes]] = []
    lock = threading.Lock()

    def store(key: str, data: bytes) -> None:
        with lock:
            heard.append((time.monotonic(), key, data))

    link = Link("client", connect=(settings.manager_endpoint,))
    with ExitStack() as stack:
        # Whoever measures must not wait for a processor.
        with scheduling(Priority.FEEDING):
            session = stack.enter_context(CellSession(settings.name, link, "bench", "clearance", "bench"))
        for what in ("robot/*/presence", "robot/*/clearance", _ECHO):
            session.hear(f"{session.keys.prefix}{what}", store)
        time.sleep(SECONDS)
    since: dict[str, float] = {}
    waits: dict[str, list[float]] = {"clearance": [], "echo": []}
    answered: set[str] = set()
    for at, key, data in sorted(heard):
        kind = key.rpartition("/")[2]
        if kind == "presence":
            since.setdefault(_name(decode(Presence, data)), at)
            continue
        if kind == "echo":
            name = data.decode()
        else:
            answer = decode(Clearance, data)
            name = f"{answer.robot} {answer.owner} {answer.presence}"
            if name in answered:
                continue
            answered.add(name)
        if name in since:
            waits[kind].append(at - since[name])
    return waits["clearance"], waits["echo"]
