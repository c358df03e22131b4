"""How soon the manager answers a robot that asks for room: the example cell, seen by a client on the same host.

`python -m bench clearance` alone. Presence and clearance come to the client from the manager on one link, so what is
measured is how long the manager waits and works.
"""

import tempfile
import threading
import time
from pathlib import Path

import numpy as np

from bench.gateway import copy_on_free_ports
from bench.load import SETTLE_S, running, without_end
from bench.timing import Row
from cell.config import load_cell
from cell.messages import Clearance, Presence
from cell.net.codec import decode
from cell.net.options import Link
from cell.net.session import CellSession

SECONDS = 20.0
ALLOWED_S = 0.004
"""From the presence that asks to its answer, in 99 of 100."""


def clearances() -> list[Row]:
    """The median and the 99th percentile, while both programs run without end."""
    with tempfile.TemporaryDirectory() as folder:
        cell = copy_on_free_ports(Path(folder))
        without_end(cell.parent / "programs")
        with running(cell):
            time.sleep(SETTLE_S)
            waits = np.array(_waits(cell))
    rows = [("median", float(np.median(waits))), ("99th percentile", float(np.percentile(waits, 99)))]
    return [Row(f"clearance, {name} of {len(waits)}", each, each / ALLOWED_S, "of 4 ms") for name, each in rows]


def _waits(cell: Path) -> list[float]:
    """From each presence that is answered by a clearance to that [s]."""
    settings = load_cell(cell)
    heard: list[tuple[float, str, bytes]] = []
    lock = threading.Lock()

    def store(key: str, data: bytes) -> None:
        with lock:
            heard.append((time.monotonic(), key, data))

    link = Link("client", connect=(settings.manager_endpoint,))
    with CellSession(settings.name, link, "bench", "clearance", "bench") as session:
        for what in ("presence", "clearance"):
            session.hear(f"{session.keys.prefix}robot/*/{what}", store)
        time.sleep(SECONDS)
    asked: dict[tuple[str, int, int], float] = {}
    waits = []
    for at, key, data in sorted(heard):
        if key.endswith("presence"):
            presence = decode(Presence, data)
            asked.setdefault((presence.robot, presence.owner, presence.sequence), at)
        else:
            answer = decode(Clearance, data)
            since = asked.pop((answer.robot, answer.owner, answer.presence), None)
            waits += [] if since is None else [at - since]
    return waits
