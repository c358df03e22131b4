"""Orders from `cell up` to several robots at once."""

import threading
import time
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from cell.commands.client.cell_view import echo
from cell.commands.client.connection import ask_until_answered
from cell.messages import Call, Command, Reply, RobotState
from cell.net.errors import CallError
from cell.net.session import CellSession, new_call

PATIENCE_S = 10.0
"""So long an order is repeated, and a refused one given anew: on a busy host one may come too late."""
RETRY_S = 0.5
MOST_AT_ONCE = 32


@dataclass(slots=True)
class _Order:
    call: Call
    outcome: Future[Reply]
    first_given: float
    given: float


class Orders:
    """One kind of command for many robots, carried out at most once by each.

    An order that nobody answers is repeated under its id, so that it is the same order. A refused one is given anew, in
    view of the robot's newest state. After `patience_s` both are given up (`take_given_up`).
    """

    def __init__(self, session: CellSession, command: Command, patience_s: float | None = None) -> None:
        self._session = session
        self._command = command
        self._patience_s = PATIENCE_S if patience_s is None else patience_s
        self._pool = ThreadPoolExecutor(MOST_AT_ONCE, thread_name_prefix="orders")
        self._end = threading.Event()
        self._orders: dict[str, _Order] = {}
        self._told: set[str] = set()
        self.obeyed: set[str] = set()
        self.problems: dict[str, str] = {}
        """Robot: why it has not obeyed yet, in its own words."""
        self.given_up: set[str] = set()
        """Robots that get no such order any more."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._end.set()
        self._pool.shutdown(cancel_futures=True)

    def give(self, state: RobotState) -> None:
        """Order the robot whose newest state this is, unless it has obeyed, is still thinking or was given up."""
        robot, now = state.robot, time.monotonic()
        order = self._orders.get(robot)
        if order is not None:
            self._look_at(order, state, now)
            if robot in self.obeyed | self.given_up or not order.outcome.done() or now - order.given < RETRY_S:
                return
        call = new_call(self._command, echo(state))
        outcome = self._pool.submit(
            ask_until_answered, self._session, f"robot/{robot}", call, self._patience_s, self._end
        )
        self._orders[robot] = _Order(call, outcome, now if order is None else order.first_given, now)

    def take_given_up(self) -> dict[str, str]:
        """Robot: why it got the order and does not obey, for those that were given up since the last look."""
        new = {robot: self.problems[robot] for robot in sorted(self.given_up - self._told)}
        self._told |= self.given_up
        return new

    def _look_at(self, order: _Order, state: RobotState, now: float) -> None:
        """Take note of how the newest order to a robot ended."""
        robot = state.robot
        if robot in self.obeyed | self.given_up or not order.outcome.done():
            return
        try:
            reply = order.outcome.result()
        except CallError as error:
            self.problems[robot] = f"{error}; it may have been carried out"
            self.given_up.add(robot)
            return
        if reply.ok:
            self.obeyed.add(robot)
            self.problems.pop(robot, None)
            return
        self.problems[robot] = reply.text
        if order.call.heard is not None and order.call.heard.boot != state.boot:
            # What the agent before it did with the order, the new one does not know.
            self.problems[robot] = (
                f"its agent was started anew; the order may have been carried out before ({reply.text})"
            )
            self.given_up.add(robot)
        elif now - order.first_given > self._patience_s:
            self.given_up.add(robot)
