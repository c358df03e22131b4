"""Planning in a process of its own: a plan takes tens of milliseconds, and Python has one interpreter lock."""

import logging
import multiprocessing
import signal
from collections import deque
from multiprocessing.connection import Connection
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from robot_agent.agent.planning import ExtendRequest, PlanFailed, Planned, Planner, PlanRequest
from robot_agent.kinematics import Model
from robot_agent.trajectory import Limits


class PlanWorker:
    """A context manager around the planning process of one robot; results come in the order of the requests.

    The process ends when this side closes or dies: it holds the other end of a pipe that nobody else has.
    """

    def __init__(self, model: Model, limits: Limits, pose_world_base: NDArray[np.float64], cycle_s: float) -> None:
        context = multiprocessing.get_context("spawn")
        self._here, there = context.Pipe()
        planner = Planner(model, limits, pose_world_base, cycle_s)
        self._process = context.Process(target=_serve, args=(there, planner), daemon=True, name="planner")
        self._there: Connection | None = there
        self._waiting: deque[PlanRequest | ExtendRequest] = deque()

    def __enter__(self) -> Self:
        self._process.start()
        if self._there is not None:
            self._there.close()
            self._there = None
        return self

    def __exit__(
        self, kind: type[BaseException] | None, value: BaseException | None, trace: TracebackType | None
    ) -> None:
        # It holds nothing, and may be in the middle of its imports or of a plan that nobody waits for any more.
        self._here.close()
        self._process.kill()
        self._process.join(timeout=2.0)

    def submit(self, request: PlanRequest | ExtendRequest) -> None:
        """Hand a request to the planning process."""
        self._waiting.append(request)
        try:
            self._here.send(request)
        except OSError:
            logging.getLogger(__name__).error("the planning process is gone")

    def results(self) -> list[Planned | PlanFailed]:
        """What is planned since the last look; requests that a dead process took along have failed."""
        results: list[Planned | PlanFailed] = []
        try:
            while self._waiting and self._here.poll():
                results.append(self._here.recv())
                self._waiting.popleft()
        except (EOFError, OSError):
            text = "the planning process has died; see the agent's log, then restart the agent"
            results.extend(PlanFailed(request.id, request.line, text) for request in self._waiting)
            self._waiting.clear()
        return results


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
