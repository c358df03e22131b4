"""Orders from `cell up` to several robots at once, repeated until each is obeyed."""

import time
from concurrent.futures import Future, ThreadPoolExecutor
from types import TracebackType
from typing import Self

from cell.commands.view import echo
from cell.messages import Command, Reply, RobotState
from cell.net.errors import CallError
from cell.net.session import CellSession, new_call

ANSWER_TIMEOUT_S = 2.0
RETRY_S = 0.5


class Orders:
    """One kind of command for many robots. A refused or lost order is given again; an obeyed one is not."""

    def __init__(self, session: CellSession, command: Command) -> None:
        self._session = session
        self._command = command
        self._pool = ThreadPoolExecutor(thread_name_prefix="orders")
        self._asked: dict[str, tuple[Future[Reply], float]] = {}
        self.obeyed: set[str] = set()
        self.problems: dict[str, str] = {}
        """Robot: why it has not obeyed yet, in its own words."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, tb: TracebackType | None) -> None:
        self._pool.shutdown(cancel_futures=True)

    def give(self, state: RobotState) -> None:
        """Order the robot whose newest state this is, unless it has obeyed or is still thinking."""
        self._collect(state.robot)
        asked = self._asked.get(state.robot)
        waiting = asked is not None and (not asked[0].done() or time.monotonic() - asked[1] < RETRY_S)
        if state.robot in self.obeyed or waiting:
            return
        call = new_call(self._command, echo(state))
        future = self._pool.submit(self._session.ask, f"robot/{state.robot}", call, ANSWER_TIMEOUT_S)
        self._asked[state.robot] = (future, time.monotonic())

    def _collect(self, robot: str) -> None:
        asked = self._asked.get(robot)
        if asked is None or not asked[0].done():
            return
        try:
            reply = asked[0].result()
        except CallError as error:
            self.problems[robot] = str(error)
            return
        if reply.ok:
            self.obeyed.add(robot)
            self.problems.pop(robot, None)
        else:
            self.problems[robot] = reply.text
