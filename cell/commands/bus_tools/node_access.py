"""How a tool reaches the nodes of a bus: through the running gateway, or on the bus itself when there is none.

A bus has one master. While a gateway runs, everything goes through it; only a bus that nobody masters is opened here.
"""

import queue
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Protocol

from cell.commands.client.cell_files import running_cell
from cell.commands.client.cell_view import POLL_S, echo, names
from cell.commands.client.connection import client_session
from cell.commands.errors import CommandError, quoted
from cell.messages import Command, GatewayState, Heard, ReadObject, Reply, WriteObject
from cell.net.errors import CallError, Unreachable
from cell.net.session import CellSession, new_call
from drive_gateway.canopen import cob_id
from drive_gateway.canopen.axis_objects import index_of
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config import GatewaySettings, load_drives
from drive_gateway.gateway.bus.bus_news import BusBack, BusFailed, BusNews, name_of, remedy_of
from drive_gateway.gateway.bus.bus_port import BusPort
from drive_gateway.gateway.bus.opening import BusError
from drive_gateway.gateway.bus.sdo_workers import SdoWorkers

ANSWER_S = 5.0
STATE_S = 1.0
"""A gateway's state comes much more often."""
LISTEN_S = 1.0
"""A master is heard by then: its SYNC comes every few ms, its heartbeat a few times a second."""
TRANSFER_S = 30.0
"""For one object of any length: 26 kB take 4 s at 125 kbit/s. A node that is silent is told long before."""
_STATUSWORD = 0x6041
_TORQUE_BITS = 0x6F
_WITH_TORQUE = (0x23, 0x27, 0x07, 0x0F)
"""Statusword & 6Fh of Switched On, Operation Enabled, Quick Stop Active, Fault Reaction Active."""


_COMMANDS = {
    **dict.fromkeys((0x200, 0x300, 0x400, 0x500), "a command to a drive"),
    cob_id.SDO_TO_NODE: "access to a node's objects",
}
"""By function code."""


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


class BusLine:
    """The nodes directly, on a bus without a master. Context manager.

    That a gateway cannot be reached does not say that none runs: the bus is listened to before anything is sent.
    """

    def __init__(self, drives: GatewaySettings, node_ids: list[int]) -> None:
        self._axes: dict[int, list[int]] = {}
        for axis in (axis for robot in drives.robots.values() for axis in robot.axes):
            self._axes.setdefault(axis.node_id, []).append(axis.number)
        self._axes |= {io.node_id: [] for io in drives.io_nodes}
        self._done: queue.SimpleQueue[SdoDone] = queue.SimpleQueue()
        self._settings = drives.bus
        self._failure = ""
        self._master = ""
        """Which of its frames was heard."""
        self._port = BusPort(drives.bus, self._on_frame, self._on_news)
        self._workers = SdoWorkers(node_ids, self._port.send, self._port.attend, self._done.put)
        self._stack = ExitStack()

    def __enter__(self) -> "BusLine":
        self._stack.enter_context(self._port)
        # Without a cycle nobody else reads.
        self._stack.enter_context(self._port.attend())
        self._stack.enter_context(self._workers)
        try:
            self._refuse_master()
        except CommandError:
            self._stack.close()
            raise
        return self

    def _refuse_master(self) -> None:
        """Listen for a while. Raises `CommandError` where somebody masters the bus."""
        deadline = time.monotonic() + LISTEN_S
        while time.monotonic() < deadline:
            if self._master:
                raise CommandError(
                    f"{name_of(self._settings)} has a master: {self._master}; nothing was sent",
                    "let the gateway do it, from where its endpoint can be reached, or stop that master first",
                )
            time.sleep(POLL_S)

    def __exit__(self, *error: object) -> None:
        self._stack.close()

    def probe(self, node_ids: list[int], index: int, sub: int) -> dict[int, SdoDone]:
        """Read one object of many nodes at once."""
        for node_id in node_ids:
            self._workers.submit(Sdo(f"{node_id}/{index}", node_id, index, sub, None))
        outcomes = [self._done.get(timeout=ANSWER_S) for _ in node_ids]
        self._refuse_failed_bus()
        return {int(outcome.request_id.partition("/")[0]): outcome for outcome in outcomes}

    def read(self, node_id: int, index: int, sub: int) -> bytes:
        return self._carry_out(Sdo(f"{node_id}/read", node_id, index, sub, None))

    def write(self, node_id: int, index: int, sub: int, data: bytes) -> None:
        for axis in self._axes.get(node_id, (1,)):
            word = int.from_bytes(self.read(node_id, index_of(_STATUSWORD, axis), 0), "little")
            if word & _TORQUE_BITS in _WITH_TORQUE:
                raise CommandError(
                    f"node {node_id} has its power stage on (statusword {word:04X}h); a write is refused",
                    "switch the drive off first",
                )
        self._carry_out(Sdo(f"{node_id}/write", node_id, index, sub, data))

    def _carry_out(self, request: Sdo) -> bytes:
        self._workers.submit(request)
        name = f"{request.index:04X}h:{request.sub:02X} of node {request.node_id}"
        try:
            outcome = self._done.get(timeout=TRANSFER_S)
        except queue.Empty as error:
            raise CommandError(
                f"{name}: the transfer did not end within {TRANSFER_S:g} s",
                "nothing may be assumed about what was done",
            ) from error
        if outcome.problem:
            self._refuse_failed_bus()
            raise CommandError(f"{name}: {outcome.problem}")
        return outcome.data

    def _refuse_failed_bus(self) -> None:
        """Silent nodes say nothing while the bus itself is down. Raises `BusError`."""
        if self._failure:
            raise BusError(self._settings, self._failure, remedy_of(self._settings))

    def _on_news(self, news: BusNews) -> None:
        match news:
            case BusFailed(text):
                self._failure = text
            case BusBack():
                self._failure = ""

    def _on_frame(self, frame: CanFrame) -> None:
        self._master = self._master or _of_master(frame)
        self._workers.take(frame)


def _of_master(frame: CanFrame) -> str:
    """What shows that somebody commands the nodes of a bus; empty for what nodes send by themselves."""
    what = {
        cob_id.NMT: "an NMT command",
        cob_id.SYNC: "SYNC",
        cob_id.ERROR_CONTROL | cob_id.MASTER_NODE_ID: "a master's heartbeat",
    }.get(frame.id)
    if what is None:
        what = _COMMANDS.get(cob_id.function_code(frame.id))
    return f"{what} ({frame.id:03X}h) is heard" if what else ""


def drives_of(file: Path, gateway: str) -> GatewaySettings:
    """The bus and the drives of one gateway of a cell file. Raises `CommandError` when it has no such gateway."""
    settings = running_cell(file)
    if gateway not in settings.gateways:
        raise CommandError(f"no gateway {gateway!r} in {file}; its gateways are: {names(settings.gateways)}")
    return load_drives(settings.gateways[gateway].drives, gateway)


@contextmanager
def running_gateway(file: Path, gateway: str) -> Iterator[GatewayLine | None]:
    """The gateway at its endpoint in the cell file; `None` when nobody answers there."""
    settings = running_cell(file)
    drives_of(file, gateway)
    with ExitStack() as stack:
        try:
            session = stack.enter_context(client_session(settings, (settings.gateways[gateway].endpoint,)))
        except Unreachable:
            yield None
            return
        yield GatewayLine(session, gateway)


@contextmanager
def node_access(file: Path, gateway: str) -> Iterator[NodeAccess]:
    """The nodes of a gateway's bus, whichever way they can be reached."""
    with ExitStack() as stack:
        line = stack.enter_context(running_gateway(file, gateway))
        if line is not None:
            yield line
            return
        drives = drives_of(file, gateway)
        refuse_virtual(drives, file)
        nodes = list({axis.node_id for robot in drives.robots.values() for axis in robot.axes})
        nodes += [io.node_id for io in drives.io_nodes]
        yield stack.enter_context(BusLine(drives, nodes))


def refuse_virtual(drives: GatewaySettings, file: Path) -> None:
    """A virtual bus cannot be opened from here: it lives in its gateway's process."""
    if drives.bus.interface == "virtual":
        raise CommandError(
            f"gateway {drives.name} does not run, and its bus {drives.bus.channel} is virtual: it lives in its process",
            f"start it with: drive-gateway run {quoted(file)} {drives.name} --simulate",
        )
