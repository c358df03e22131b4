"""Planning in a process of its own: a plan takes tens of milliseconds, and Python has one interpreter lock."""

import contextlib
import logging
import multiprocessing
import queue
import signal
import threading
import time
from collections import deque
from collections.abc import Iterable
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Self

from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import ExtendRequest, PlanFailed, Planned, PlanRequest

Request = PlanRequest | ExtendRequest
_GRACE_S = 1.0
"""A plan that nobody wants any more may still take so long: about as long as it takes to start another process."""
_START_AGAIN_S = 1.0
_LOOK_S = 0.05
"""How often it is looked whether a plan that is under way is still wanted."""


class PlanWorker:
    """A context manager around the planning process of one robot; results come in the order of the requests.

    A thread starts the process, sends one request after the other and receives what is planned: whoever submits and
    asks for results never waits. A process that dies is started again, and only the request that it had is lost.

    The process ends when this side closes or dies: it holds the other end of a pipe that nobody else has.
    """

    def __init__(self, planner: Planner) -> None:
        self._planner = planner
        self._changed = threading.Condition()
        self._waiting: deque[Request] = deque()
        self._open: Request | None = None
        """The one that is being planned, while it is wanted."""
        self._began: Request | None = None
        """The newest one that a process was wanted for."""
        self._closing = False
        self._process: multiprocessing.process.BaseProcess | None = None
        self._results: queue.SimpleQueue[Planned | PlanFailed] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._run, name="plans", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # The process holds nothing, and may be in the middle of its imports or of a plan that nobody waits for.
        with self._changed:
            self._closing = True
            if self._process is not None:
                self._process.kill()
            self._changed.notify()
        self._thread.join(timeout=5.0)

    def submit(self, request: Request) -> None:
        """Have a request planned after those that were submitted before."""
        with self._changed:
            self._waiting.append(request)
            self._changed.notify()

    def drop(self, ids: Iterable[int]) -> None:
        """Forget requests. What is being planned for one of them is interrupted if it takes long."""
        unwanted = set(ids)
        with self._changed:
            self._waiting = deque(request for request in self._waiting if request.id not in unwanted)
            if self._open is not None and self._open.id in unwanted:
                self._open = None

    def results(self) -> list[Planned | PlanFailed]:
        """What is planned since the last look; a request that a dead process took along has failed."""
        return [self._results.get_nowait() for _ in range(self._results.qsize())]

    def _run(self) -> None:
        while not self._closing:
            try:
                here = self._start()
            except OSError as error:
                self._not_started(error)
                continue
            with here, contextlib.suppress(EOFError, OSError):
                self._serve(here)
            self._ended()

    def _start(self) -> Connection:
        """This side's end of the pipe to a new process."""
        context = multiprocessing.get_context("spawn")
        here, there = context.Pipe()
        process = context.Process(target=_serve, args=(there, self._planner), daemon=True, name="planner")
        process.start()
        there.close()
        with self._changed:
            self._process = process
            if self._closing:
                process.kill()
        return here

    def _not_started(self, error: OSError) -> None:
        """The computer has no process to give: what was submitted fails; it is tried again after a moment."""
        with self._changed:
            self._changed.wait_for(lambda: bool(self._waiting) or self._closing, _START_AGAIN_S)
            failed, self._waiting = self._waiting, deque()
        logging.getLogger(__name__).error("the planning process could not be started: %s", error)
        for request in failed:
            text = (
                f"line {request.line}: the planning process could not be started ({error}): free memory or end "
                "processes on this computer, then run the program again"
            )
            self._results.put(PlanFailed(request.id, request.line, text))

    def _serve(self, here: Connection) -> None:
        """Have one request after the other planned, until the process dies, is killed, or this side closes."""
        while True:
            with self._changed:
                self._changed.wait_for(lambda: bool(self._waiting) or self._closing)
                if self._closing:
                    return
                if self._process is not None and not self._process.is_alive() and self._began is not self._waiting[0]:
                    self._began = self._waiting[0]  # it died while it had nothing to do: another one shall plan this
                    return
                self._open = self._began = self._waiting.popleft()
            here.send(self._open)
            begun = time.monotonic()
            while not here.poll(_LOOK_S):
                if self._open is None and time.monotonic() - begun > _GRACE_S:
                    return
            result = here.recv()
            with self._changed:
                if self._open is not None:
                    self._results.put(result)
                self._open = None

    def _ended(self) -> None:
        """The process is of no use any more: end it, and say what became of the request that it had."""
        with self._changed:
            request, self._open = self._open, None
            process, self._process = self._process, None
        if process is None:
            return
        process.kill()
        process.join(timeout=5.0)
        if request is None or self._closing:
            return
        logging.getLogger(__name__).error("the planning process died, exit code %s", process.exitcode)
        text = (
            f"line {request.line}: the planning process died (exit code {process.exitcode}) while it planned from "
            "here; it is started again: run the program again, and if it dies again see the agent's log"
        )
        self._results.put(PlanFailed(request.id, request.line, text))


def _serve(pipe: Connection, planner: Planner) -> None:
    """The planning process: one request after the other until the pipe ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    while True:
        try:
            request = pipe.recv()
        except (EOFError, OSError):
            return
        try:
            result: Planned | PlanFailed = planner.plan(request)
        except Exception as error:  # a bug must reach the operator as a failed line, not as a robot that waits for ever
            logging.getLogger(__name__).exception("planning line %d", request.line)
            result = PlanFailed(request.id, request.line, f"internal error while planning: {error!r}")
        try:
            pipe.send(result)
        except OSError:
            return
