"""A loop on the gateway's schedule that does nothing: what the machine itself costs in punctuality."""

import multiprocessing
from multiprocessing.synchronize import Event
from types import TracebackType
from typing import Self

from cell.core import Effect
from cell.net.runner import Priority, run_core
from drive_gateway.gateway.cycle.lateness import Lateness

NO_FIFO = "import os\ndef _no(*_): raise PermissionError\nos.sched_setscheduler = _no\n"
"""Code that keeps a process from real-time scheduling, as a system does that does not allow it."""


START_S = 60.0


class _Idle:
    """A core without work."""

    def __init__(self, cycle_s: float) -> None:
        self._lateness = Lateness(cycle_s)
        self.each_s: list[float] = []

    def receive(self, message: object, now: float) -> None:
        """Nothing is ever said to it."""

    def step(self, now: float) -> list[Effect]:
        self.each_s.append(self._lateness.cycle(now))
        return []


class IdleLoop:
    """Context manager: the loop in a process of its own; it runs when the manager is entered."""

    def __init__(self, cycle_s: float, fifo: bool) -> None:
        context = multiprocessing.get_context("spawn")
        self._stop = context.Event()
        self._runs = context.Event()
        self._results: multiprocessing.Queue[list[float]] = context.Queue()
        words = (cycle_s, fifo, self._runs, self._stop, self._results)
        self._process = context.Process(target=_loop, args=words, daemon=True)

    def __enter__(self) -> Self:
        self._process.start()
        if not self._runs.wait(START_S):
            raise RuntimeError(f"the idle loop did not start within {START_S} s")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        # Not by `_stop`: the process would wait until somebody takes what it has measured.
        self._process.terminate()
        self._process.join()

    def lateness_s(self) -> list[float]:
        """End it: how late each cycle was."""
        self._stop.set()
        return self._results.get(timeout=10.0)


def _loop(cycle_s: float, fifo: bool, runs: Event, stop: Event, results: "multiprocessing.Queue[list[float]]") -> None:
    idle = _Idle(cycle_s)
    runs.set()
    run_core(
        idle,
        period_s=cycle_s,
        inbox=lambda: (),
        perform=lambda _effect: None,
        stop=stop,
        priority=Priority.BUS if fifo else None,
    )
    results.put(idle.each_s)
