"""What messages and frames alone cost: processes that send and hear at the rates of a cell, and do nothing else.

`python -m bench.bare ROLE PORT` is one of them; the sizes are those of messages of `cell_configs/two_arms`.
"""

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import can
import zenoh

from cell.commands.start import ZENOH_THREADS
from cell.core import Effect
from cell.net.options import Link, ZenohOptions, zenoh_config
from cell.net.runner import Priority, run_core

CYCLE_S, STEP_S = 0.004, 0.02
AXES = 6


@dataclass(frozen=True, slots=True)
class Role:
    """One process: its period, what it sends in each, what it hears, how many frames go over its bus in a period."""

    period_s: float
    sends: tuple[tuple[str, int], ...]
    """Key and bytes."""
    hears: tuple[str, ...]
    frames: int = 0


def roles() -> dict[str, Role]:
    """Of two arms: their gateways, their agents, the manager, and who watches."""
    found = {
        "manager": Role(STEP_S, (("manager/state", 700),), ("robot/*/presence", "gateway/*/state")),
        "watcher": Role(0.1, (), ("robot/*/state", "gateway/*/state", "manager/state")),
    }
    for side in ("left", "right"):
        found[f"gateway-{side}"] = Role(
            CYCLE_S, ((f"robot/{side}/drives", 300),), (f"robot/{side}/setpoints", "manager/state"), 1 + 2 * AXES
        )
        sends = ((f"robot/{side}/presence", 3500), (f"robot/{side}/setpoints", 4000), (f"robot/{side}/state", 1500))
        found[f"agent-{side}"] = Role(STEP_S, sends, (f"robot/{side}/drives", "manager/state"))
    return found


class _Bare:
    """A core that sends what its role says and looks at nothing."""

    def __init__(self, role: Role, session: zenoh.Session) -> None:
        self._publishers = [(session.declare_publisher(f"bare/{key}"), bytes(size)) for key, size in role.sends]
        self._slots: dict[str, bytes] = {}
        self._lock = threading.Lock()
        self._hearing = [session.declare_subscriber(f"bare/{key}", self._store) for key in role.hears]
        self._frames = role.frames
        ends = 2 if role.frames else 0
        self.buses = [can.Bus(interface="virtual", channel="bare") for _ in range(ends)]

    def _store(self, sample: zenoh.Sample) -> None:
        with self._lock:
            self._slots[str(sample.key_expr)] = sample.payload.to_bytes()

    def receive(self, message: object, now: float) -> None:
        """Nothing is done with it."""

    def step(self, now: float) -> list[Effect]:  # noqa: ARG002 (a core is given the time)
        """Send everything of one period."""
        with self._lock:
            self._slots.clear()
        for publisher, payload in self._publishers:
            publisher.put(payload)
        if self.buses:
            there = self._frames // 2 + 1
            self._pass(there, *self.buses)
            self._pass(self._frames - there, *reversed(self.buses))
        return []

    def _pass(self, frames: int, sender: can.BusABC, receiver: can.BusABC) -> None:
        for number in range(frames):
            sender.send(can.Message(arbitration_id=0x180 + number, data=bytes(6), is_extended_id=False))
        for _ in range(frames):
            receiver.recv(0.0)


def main(role: str, port: str) -> None:
    """Run one process until SIGTERM."""
    stop = threading.Event()
    signal.signal(signal.SIGTERM, lambda *_: stop.set())
    endpoint = (f"tcp/127.0.0.1:{port}",)
    link = Link("peer", listen=endpoint) if role == "manager" else Link("peer", connect=endpoint)
    plan = roles()[role]
    with zenoh.open(zenoh_config(link, ZenohOptions())) as session:
        core = _Bare(plan, session)
        run_core(core, period_s=plan.period_s, inbox=list, perform=lambda _: None, stop=stop, priority=Priority.BUS)
        for bus in core.buses:
            bus.shutdown()


@contextmanager
def bare_cell() -> Iterator[list[int]]:
    """All of them; their process ids."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = str(free.getsockname()[1])
    with ExitStack() as stack:
        processes, environment = [], {"ZENOH_RUNTIME": ZENOH_THREADS, **os.environ}
        for role in roles():
            process = subprocess.Popen([sys.executable, "-m", "bench.bare", role, port], env=environment)
            stack.callback(process.wait)
            stack.callback(process.terminate)
            processes.append(process.pid)
        yield processes


if __name__ == "__main__":
    main(*sys.argv[1:])
