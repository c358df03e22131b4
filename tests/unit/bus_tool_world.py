"""A bus for the tools of `drive-gateway`, and who else may be on it: nodes of the `canopen` library, an LSS slave."""

import struct
import threading
from collections.abc import Iterator
from contextlib import contextmanager

import can
import canopen
import pytest
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes
from typer.testing import CliRunner

from cell.commands import drive_gateway_command
from cell.commands.bus_tools import bus_line, place
from cell.commands.errors import CommandError
from drive_gateway.errors import GatewayError

DEADLINE_S = 20.0
U8, U16, U32, I32, TEXT = (
    datatypes.UNSIGNED8,
    datatypes.UNSIGNED16,
    datatypes.UNSIGNED32,
    datatypes.INTEGER32,
    datatypes.VISIBLE_STRING,
)


class ToolBus:
    """One virtual bus of this process, and the tools on it."""

    def __init__(self, channel: str) -> None:
        self.channel = channel

    def run(self, *words: str) -> str:
        """What a tool prints."""
        result = CliRunner().invoke(drive_gateway_command.app, self._words(words))
        assert result.exit_code == 0, (result.output, result.exception)
        return result.output

    def refused(self, *words: str) -> str:
        """Why a tool did nothing, or not all: what and what next."""
        result = CliRunner().invoke(drive_gateway_command.app, self._words(words))
        assert result.exit_code != 0, result.output
        if isinstance(result.exception, CommandError):
            return f"{result.exception.what}; {result.exception.next_step}"
        assert isinstance(result.exception, GatewayError | SystemExit), result.exception
        return str(result.exception) if isinstance(result.exception, GatewayError) else result.output

    def _words(self, words: tuple[str, ...]) -> list[str]:
        if any(word.endswith(".yaml") for word in words):
            return [*words]
        return [words[0], "--interface", "virtual", "--channel", self.channel, *words[1:]]


@pytest.fixture
def tool_bus(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> ToolBus:
    """A bus on which tools of this process are let, and where they listen for a short while only."""
    monkeypatch.setattr(place, "IN_ONE_PROCESS", ())
    monkeypatch.setattr(bus_line, "LISTEN_S", 0.1)
    return ToolBus(request.node.nodeid)


@contextmanager
def network_on(channel: str) -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.02
    network.connect(interface="virtual", channel=channel)
    try:
        yield network
    finally:
        for node in network.values():
            node.nmt.stop_heartbeat()
        network.disconnect()


def dictionary(objects: dict[tuple[int, int], tuple[int, object]]) -> canopen.ObjectDictionary:
    """Objects by index and sub-index: data type and value. Indices with a sub-index above 0 are records."""
    od = canopen.ObjectDictionary()
    records = {index for index, sub in objects if sub}
    for (index, sub), (kind, value) in sorted(objects.items()):
        variable = ODVariable(f"object {index:04X}:{sub:02X}", index, sub)
        variable.data_type, variable.access_type, variable.default = kind, "rw", value
        if index not in records:
            od.add_object(variable)
            continue
        if index not in od:
            od.add_object((ODArray if index == 0x1003 else ODRecord)(f"record {index:04X}", index))
        od[index].add_member(variable)
    return od


IDENTITY = {
    (0x1000, 0): (U32, 0x20192),
    (0x1001, 0): (U8, 0),
    (0x1018, 0): (U8, 4),
    (0x1018, 1): (U32, 0x1D),
    (0x1018, 2): (U32, 0x402),
    (0x1018, 3): (U32, 1),
    (0x1018, 4): (U32, 4711),
    (0x1017, 0): (U16, 0),
}
DRIVE = {**IDENTITY, (0x6040, 0): (U16, 0), (0x6041, 0): (U16, 0x0240), (0x607A, 0): (I32, 0), (0x6081, 0): (U32, 0)}


@contextmanager
def local_node(
    channel: str, node_id: int, objects: dict[tuple[int, int], tuple[int, object]]
) -> Iterator[canopen.LocalNode]:
    """A node by the `canopen` library, which shares no code with this project."""
    with network_on(channel) as network:
        yield network.create_node(node_id, dictionary(objects))


class LssSlave(can.Listener):
    """A node as CiA 305 describes it, seen from the bus: waiting or configuration state, Node-ID, identity, store.

    The frames are those of CiA 305, section "LSS protocol": identifiers 7E5h (to the node) and 7E4h (from it), the
    command specifier in the first byte, numbers little-endian behind it.
    """

    def __init__(self, bus: can.BusABC, node_id: int, identity: tuple[int, int, int, int]) -> None:
        self._bus = bus
        self.active = self.pending = self.stored = node_id
        self.identity = identity
        self.configuring = False
        self.store_error = 0
        self._matched: list[int] = []

    def on_message_received(self, msg: can.Message) -> None:
        if msg.arbitration_id != 0x7E5:
            return
        command, number = msg.data[0], struct.unpack_from("<I", msg.data, 1)[0]
        if command == 0x04:
            self.configuring = msg.data[1] == 1
        elif 0x40 <= command <= 0x43:
            self._matched = [*(self._matched if command > 0x40 else []), number]
            if command == 0x43 and tuple(self._matched) == self.identity:
                self.configuring = True
                self._answer(0x44)
        elif not self.configuring:
            return
        elif command == 0x11:
            fits = 1 <= msg.data[1] <= 127 or msg.data[1] == 0xFF
            self.pending = msg.data[1] if fits else self.pending
            self._answer(0x11, 0 if fits else 1)
        elif command == 0x17:
            self.stored = self.pending if not self.store_error else self.stored
            self._answer(0x17, self.store_error)
        elif 0x5A <= command <= 0x5D:
            self._answer(command, *self.identity[command - 0x5A].to_bytes(4, "little"))
        elif command == 0x5E:
            self._answer(0x5E, self.active)

    def _answer(self, *data: int) -> None:
        content = bytes(data).ljust(8, b"\0")
        self._bus.send(can.Message(arbitration_id=0x7E4, data=content, is_extended_id=False))


@contextmanager
def lss_slave(channel: str, node_id: int, identity: tuple[int, int, int, int]) -> Iterator[LssSlave]:
    with can.Bus(interface="virtual", channel=channel) as bus:
        slave = LssSlave(bus, node_id, identity)
        notifier = can.Notifier(bus, [slave], timeout=0.02)
        try:
            yield slave
        finally:
            notifier.stop()


@contextmanager
def sending(channel: str, number: int, data: bytes, remote: bool = False) -> Iterator[can.BusABC]:
    """Somebody sends a frame fifty times a second; what is heard beside it can be received from the bus."""
    end = threading.Event()
    with can.Bus(interface="virtual", channel=channel) as bus:

        def send() -> None:
            while not end.wait(0.02):
                bus.send(can.Message(arbitration_id=number, data=data, is_extended_id=False, is_remote_frame=remote))

        thread = threading.Thread(target=send)
        thread.start()
        try:
            yield bus
        finally:
            end.set()
            thread.join(DEADLINE_S)
