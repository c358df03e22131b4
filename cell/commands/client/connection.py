"""How an operator's command finds the running cell, asks a process of it, and reports the answer."""

import os
import socket
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from cell.commands.client.cell_files import check_robot, existing, running_cell
from cell.commands.client.cell_view import CellView, Snapshot, echo, names
from cell.commands.errors import CommandError, quoted
from cell.config import load_cell
from cell.config.settings import CellSettings
from cell.messages import Call, Command, GatewayState, Heard, ManagerState, Presence, Reply
from cell.net.errors import CallError, Unreachable
from cell.net.options import Link
from cell.net.runner import new_boot
from cell.net.session import CellSession, new_call

STATE_TIMEOUT_S = 1.0
ANSWER_TIMEOUT_S = 5.0
TRY_S = 1.5
"""So long one query waits before the call is repeated."""
_PAUSE_S = 0.1


@dataclass(frozen=True)
class Connection:
    """An operator's connection to a running cell."""

    file: Path
    settings: CellSettings
    session: CellSession
    view: CellView
    stop: threading.Event | None = None
    """Set by Ctrl-C: from then on nothing is asked for any more."""

    def check_robot(self, robot: str) -> None:
        """Raise `CommandError` when the cell has no such robot."""
        check_robot(self.settings, self.file, robot)

    def ask_robot(self, robot: str, command: Command) -> Reply:
        """Ask a robot's agent, in view of its newest state."""
        self.check_robot(robot)
        snapshot = self.view.wait_for(lambda seen: robot in seen.robots, STATE_TIMEOUT_S)
        state = snapshot.robots.get(robot)
        if state is None:
            raise self._silent(robot)
        return self._ask(f"robot/{robot}", command, echo(state))

    def ask_manager(self, command: Command) -> Reply:
        """Ask the cell manager, in view of its newest state."""
        return self._ask("manager", command, echo(self.manager_state()))

    def manager_state(self) -> ManagerState:
        """The newest state of the manager. Raises `CommandError` when it is silent."""
        state = self.view.wait_for(lambda seen: seen.manager is not None, STATE_TIMEOUT_S).manager
        if state is None:
            raise CommandError(
                f"the manager of cell {self.settings.name} does not answer",
                f"start it with: cell manager {quoted(self.file)}",
            )
        return state

    def presence(self, robot: str) -> Presence:
        """The newest presence of a robot. Raises `CommandError` when it is silent."""
        seen = self.view.wait_for(lambda seen: robot in seen.presences, STATE_TIMEOUT_S).presences.get(robot)
        if seen is None:
            raise self._silent(robot)
        return seen

    def _silent(self, robot: str) -> CommandError:
        return CommandError(
            f"robot {robot} does not answer: is its agent running?",
            f"start it with: robot-agent {quoted(self.file)} {robot}",
        )

    def check_files(self, who: str, digest: str) -> None:
        """Raise `CommandError` when `who` runs with other files than those here, by which this order is worded."""
        own = load_cell(existing(self.file)).digest
        if own != digest:
            raise CommandError(
                f"{who} runs with the configuration {digest[:8] or 'unknown'}, the files here are {own[:8]}; "
                "what the order says in degrees, mm and names may mean something else there",
                f"use the files that the cell was started with, or start it again with those of {self.file}",
            )

    def ask_gateway(self, gateway: str, command: Command) -> Reply:
        """Ask a gateway of the cell, in view of its newest state; a refusal becomes a `CommandError`."""
        reply = self.order_gateway(gateway, command)
        if not reply.ok:
            raise CommandError(f"gateway {gateway} refuses: {reply.text}")
        return reply

    def order_gateway(self, gateway: str, command: Command) -> Reply:
        """Ask a gateway of the cell, in view of its newest state; a refusal is the caller's to tell."""
        return self._ask(f"gateway/{gateway}", command, echo(self.gateway_state(gateway)))

    def gateway_state(self, gateway: str) -> GatewayState:
        """The newest state of a gateway. Raises `CommandError` when it is silent."""
        state = self.view.wait_for(lambda seen: gateway in seen.gateways, STATE_TIMEOUT_S).gateways.get(gateway)
        if state is None:
            raise CommandError(
                f"gateway {gateway} does not answer", f"start it with: drive-gateway run {quoted(self.file)} {gateway}"
            )
        return state

    def snapshot(self) -> Snapshot:
        """The state of the cell, as soon as everybody in it was heard or has had the time for it."""
        return self.view.wait_for(
            lambda seen: (
                seen.manager is not None
                and set(seen.robots) == set(self.settings.robots)
                and set(seen.gateways) == set(self.settings.gateways)
            ),
            STATE_TIMEOUT_S,
        )

    def _ask(self, to: str, command: Command, heard: Heard | None) -> Reply:
        if self.stop is not None and self.stop.is_set():
            raise CommandError(f"{command.verb}: broken off before it was sent to {to}")
        try:
            patience_s = max(ANSWER_TIMEOUT_S, command.answer_within_s + TRY_S)
            return ask_until_answered(self.session, to, new_call(command, heard), patience_s, self.stop)
        except CallError as error:
            raise CommandError(
                f"{command.verb}: {to} gave no usable answer: {error}",
                f"see what was done with: cell status -f {quoted(self.file)}; if it was not, give the order again",
            ) from error


def ask_until_answered(
    session: CellSession, to: str, call: Call, timeout_s: float, stop: threading.Event | None = None
) -> Reply:
    """Call `to`, and repeat the call under its id until somebody answers, `timeout_s` have passed or `stop` is set.

    The addressee knows the id and tells its first outcome again; by the echo it refuses a call that reaches it only
    when it is too old. A call without an echo is not repeated: nothing would keep a late one from being carried out.
    Raises `CallError` as the last query ended.
    """
    if call.heard is None:
        return session.ask(to, call, timeout_s)
    deadline = time.monotonic() + timeout_s
    pause = stop or threading.Event()
    while True:
        try:
            return session.ask(to, call, max(0.1, min(TRY_S, deadline - time.monotonic())))
        except CallError:
            if pause.wait(_PAUSE_S) or time.monotonic() > deadline:
                raise


@contextmanager
def connect(file: Path, endpoints: list[str] | None, stop: threading.Event | None = None) -> Iterator[Connection]:
    """Connect to the running cell of `file` as a client of its rendezvous, or of `endpoints`; see `Connection.stop`."""
    settings = running_cell(file)
    with reached(settings, file, endpoints) as session:
        yield Connection(file, settings, session, CellView(session, settings), stop)


@contextmanager
def reached(settings: CellSettings, file: Path, endpoints: list[str] | None) -> Iterator[CellSession]:
    """A client session at the rendezvous of a running cell, or at `endpoints`. Raises `CommandError`."""
    connect_to = tuple(endpoints) if endpoints else (settings.manager_endpoint,)
    with ExitStack() as stack:
        try:
            session = stack.enter_context(client_session(settings, connect_to))
        except Unreachable as error:
            raise CommandError(
                f"nobody of cell {settings.name} answers at {names(connect_to)}",
                f"start the cell with: cell up {quoted(file)}, "
                f"or, when only its manager is gone: cell manager {quoted(file)}",
            ) from error
        yield session


def client_session(settings: CellSettings, endpoints: tuple[str, ...]) -> CellSession:
    """A client session through one of `endpoints`; opening it raises `cell.net.errors.Unreachable`."""
    link = Link(mode="client", connect=endpoints)
    return CellSession(settings.name, link, "operator", f"{socket.gethostname()}-{os.getpid()}", new_boot())


def ask_each(operator: Connection, robots: Sequence[str], command: Command) -> None:
    """Ask one robot after another. Raises `CommandError` with what those said that did not, after all were asked."""
    failed: list[CommandError] = []
    for robot in robots:
        try:
            report(robot, operator.ask_robot(robot, command))
        except CommandError as error:
            failed.append(error)
    if failed:
        steps = "; ".join(dict.fromkeys(error.next_step for error in failed if error.next_step))
        raise CommandError("\n".join(error.what for error in failed), steps)


def report(who: str, reply: Reply) -> None:
    """Print a reply; a refusal becomes a `CommandError`."""
    if not reply.ok:
        raise CommandError(f"{who} refuses: {reply.text}")
    print(reply.text if reply.text.startswith(who) else f"{who}: {reply.text}")
