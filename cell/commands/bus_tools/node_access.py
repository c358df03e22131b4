"""How a tool reaches the nodes of a bus: through the running gateway, or on the bus itself when there is none.

A bus has one master. While a gateway runs, everything goes through it; only a bus that nobody masters is opened here.
"""

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Protocol

from cell.commands.bus_tools.bus_line import BusLine
from cell.commands.bus_tools.place import BusPlace, refuse_virtual
from cell.commands.client.cell_view import POLL_S, echo
from cell.commands.client.connection import client_session
from cell.commands.errors import CommandError
from cell.messages import Command, GatewayState, Heard, ReadObject, Reply, WriteObject
from cell.net.errors import CallError, Unreachable
from cell.net.session import CellSession, new_call

ANSWER_S = 5.0
STATE_S = 1.0
"""A gateway's state comes much more often."""
TRANSFER_S = 30.0
"""For one object of any length: 26 kB take 4 s at 125 kbit/s. A node that is silent is told long before."""


class NodeAccess(Protocol):
    """The object dictionaries of a bus' nodes. Both methods raise `CommandError` with the reason."""

    def read(self, node_id: int, index: int, sub: int) -> bytes: ...

    def write(self, node_id: int, index: int, sub: int, data: bytes) -> None: ...


class GatewayLine:
    """The nodes through the running gateway, which refuses what would be unsafe now."""

    def __init__(self, session: CellSession, gateway: str) -> None:
        self._session = session
        self._gateway = gateway
        self._states = session.watch(f"gateway/{gateway}/state")
        self._seen: Heard | None = None

    def ask(self, command: Command, timeout_s: float = ANSWER_S) -> Reply:
        """The gateway's answer; a refusal and no answer become a `CommandError`."""
        try:
            reply = self._session.ask(f"gateway/{self._gateway}", new_call(command, self._newest()), timeout_s)
        except CallError as error:
            raise CommandError(
                f"gateway {self._gateway} gave no usable answer: {error}",
                "see what was done with: cell drives; if it was not, give the order again",
            ) from error
        if not reply.ok:
            raise CommandError(f"gateway {self._gateway} refuses: {reply.text}")
        return reply

    def _newest(self) -> Heard | None:
        """What the call is made in view of; None when the gateway tells no state."""
        deadline = time.monotonic() + STATE_S
        while True:
            for state in self._states.take_new():
                if isinstance(state, GatewayState):
                    self._seen = echo(state)
            if self._seen is not None or time.monotonic() > deadline:
                return self._seen
            time.sleep(POLL_S)

    def read(self, node_id: int, index: int, sub: int) -> bytes:
        return bytes.fromhex(self.ask(ReadObject(node_id, index, sub), TRANSFER_S).data)

    def write(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        self.ask(WriteObject(node_id, index, sub, data.hex()), TRANSFER_S)


@contextmanager
def running_gateway(place: BusPlace) -> Iterator[GatewayLine | None]:
    """The gateway of a cell file at its endpoint; `None` when nobody answers there, or no cell file was named."""
    if place.cell is None or place.drives is None:
        yield None
        return
    gateway = place.drives.name
    with ExitStack() as stack:
        try:
            session = stack.enter_context(client_session(place.cell, (place.cell.gateways[gateway].endpoint,)))
        except Unreachable:
            yield None
            return
        yield GatewayLine(session, gateway)


def gateways_way(place: BusPlace, command: str) -> str:
    """How the gateway of a cell does what a tool does."""
    return f"where a cell runs, let its gateway do it: {place.command(command, '...')}"


@contextmanager
def node_access(place: BusPlace, command: str, may_move: bool = False) -> Iterator[NodeAccess]:
    """The nodes of a bus, whichever way they can be reached; `command`: the tool's word, for a refusal."""
    with ExitStack() as stack:
        line = stack.enter_context(running_gateway(place))
        if line is not None:
            yield line
            return
        refuse_virtual(place)
        yield stack.enter_context(BusLine(place, gateways_way(place, command), may_move))


@contextmanager
def bus_alone(place: BusPlace, instead: str, may_move: bool = False) -> Iterator[BusLine]:
    """The bus itself, for what only its master may do. Raises `CommandError` while its gateway runs."""
    with running_gateway(place) as line:
        if line is not None and place.drives is not None:
            raise CommandError(
                f"gateway {place.drives.name} runs and is the master of its bus; nothing was sent",
                f"{instead}; or end it first",
            )
    refuse_virtual(place)
    with BusLine(place, instead, may_move) as bus:
        yield bus
