"""A loop on the gateway's schedule that does nothing: what the machine itself costs in punctuality."""

import multiprocessing
import time
from multiprocessing.synchronize import Event as Stop
from types import TracebackType
from typing import Self

from cell.core import Effect
from cell.net.runner import run_core
from drive_gateway.gateway.lateness import Lateness

NO_FIFO = "import os\ndef _no(*_): raise PermissionError\nos.sched_setscheduler = _no\n"
"""Code that keeps a process from real-time scheduling, as a system does that does not allow it."""


class _Idle:
    """A core without work."""

    def __init__(self, cycle_s: float) -> None:
        self.lateness = Lateness(cycle_s)

    def receive(self, message: object, now: float) -> None:
        """Nothing is ever said to it."""

    def step(self, now: float) -> list[Effect]:
        self.lateness.cycle(now)
        return []


class IdleLoop:
    """Context manager: the loop in a process of its own, from two seconds after the start on."""

    def __init__(self, cycle_s: float, fifo: bool) -> None:
        context = multiprocessing.get_context("spawn")
        self._stop = context.Event()
        self._results: multiprocessing.Queue[tuple[int, float]] = context.Queue()
        self._process = context.Process(target=_loop, args=(cycle_s, fifo, self._stop, self._results), daemon=True)

    def __enter__(self) -> Self:
        self._process.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        self._process.join()

    def counted(self) -> tuple[int, float]:
        """End it: late cycles, and the worst lateness [s]."""
        self._stop.set()
        return self._results.get(timeout=10.0)


def _loop(cycle_s: float, fifo: bool, stop: Stop, results: "multiprocessing.Queue[tuple[int, float]]") -> None:
    time.sleep(2.0)
    idle = _Idle(cycle_s)
    run_core(idle, period_s=cycle_s, inbox=lambda: (), perform=lambda _effect: None, stop=stop, realtime=fifo)
    results.put((idle.lateness.late_cycles, idle.lateness.worst_s))
