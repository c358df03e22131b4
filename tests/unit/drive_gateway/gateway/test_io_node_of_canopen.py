"""An I/O node that shares no code with the gateway: `canopen.LocalNode` with objects and habits of CiA 401 alone.

Its PDO mapping is fixed, as that of small couplers is, and it has no error mode of its outputs.
"""

from collections.abc import Iterator
from dataclasses import replace

import canopen
import pytest
from canopen.objectdictionary import ODArray, ODRecord, ODVariable, datatypes

from cell.messages import SwitchOutput
from drive_gateway.config.settings import IoSettings, NamedInput, OutputSettings, RobotDrives
from drive_gateway.sim import inner_bus
from drive_gateway.sim.shell import simulated_nodes
from tests.unit.gateway_thread import Client, running_gateway
from tests.unit.gateway_world import gateway_settings

NODE = 40
U8, U16, U32 = datatypes.UNSIGNED8, datatypes.UNSIGNED16, datatypes.UNSIGNED32
IO = IoSettings("coupler", NODE, input_bytes=1, output_bytes=1, waived=frozenset({0x1016, 0x6206, 0x6207}))
PLAIN = gateway_settings()
SETTINGS = replace(
    PLAIN,
    io_nodes=(IO,),
    robots={
        "left": RobotDrives(
            "left",
            PLAIN.robots["left"].axes,
            (OutputSettings("gripper", "", 2, keep=True, io="coupler"),),
            (NamedInput("part_present", "", 5, io="coupler"),),
        )
    },
)


def variable(index: int, sub: int, kind: int, default: int, access: str = "ro") -> ODVariable:
    item = ODVariable(f"{index:04X}:{sub:02X}", index, sub)
    item.data_type, item.default, item.access_type = kind, default, access
    return item


def dictionary() -> canopen.ObjectDictionary:
    objects = canopen.ObjectDictionary()
    objects.add_object(variable(0x1000, 0, U32, 0x00030191))
    objects.add_object(variable(0x1001, 0, U8, 0))
    objects.add_object(variable(0x1017, 0, U16, 0, "rw"))
    records = {
        0x1018: [(1, U32, 0x123, "ro")],
        0x1400: [(1, U32, 0x200 + NODE, "rw"), (2, U8, 255, "rw")],
        0x1600: [(0, U8, 1, "ro"), (1, U32, 0x62000108, "ro")],
        0x1800: [(1, U32, 0x180 + NODE, "rw"), (2, U8, 255, "rw")],
        0x1A00: [(0, U8, 1, "ro"), (1, U32, 0x60000108, "ro")],
    }
    for index, parts in records.items():
        record = ODRecord(f"{index:04X}", index)
        for sub, kind, default, access in parts:
            record.add_member(variable(index, sub, kind, default, access))
        objects.add_object(record)
    for index, access in ((0x6000, "ro"), (0x6200, "rw")):
        array = ODArray(f"{index:04X}", index)
        array.add_member(variable(index, 0, U8, 1))
        array.add_member(variable(index, 1, U8, 0, access))
        objects.add_object(array)
    return objects


class Coupler:
    """PDOs of CiA 301 by hand: the newest outputs act with SYNC, the inputs come with each n-th one."""

    def __init__(self) -> None:
        self.network = canopen.Network()
        self.network.connect(interface="virtual", channel=SETTINGS.bus.channel)
        self.node = self.network.create_node(NODE, dictionary())
        self.inputs = 0
        self._latched: bytes | None = None
        self._syncs = 0
        self.network.subscribe(0x000, self._on_nmt)
        self.network.subscribe(0x080, self._on_sync)
        self.network.subscribe(0x200 + NODE, self._on_rpdo)

    @property
    def outputs(self) -> int:
        return int.from_bytes(self.node.get_data(0x6200, 1), "little")

    def _on_nmt(self, _id: int, data: bytearray, _at: float) -> None:
        if data[0] == 0x82 and data[1] in (0, NODE):
            self.node.nmt.send_command(0x82)
            self.node.nmt.state = "PRE-OPERATIONAL"

    def _on_rpdo(self, _id: int, data: bytearray, _at: float) -> None:
        if self.node.nmt.state == "OPERATIONAL":
            self._latched = bytes(data)

    def _on_sync(self, _id: int, _data: bytearray, _at: float) -> None:
        if self.node.nmt.state != "OPERATIONAL":
            return
        every = self.node.get_data(0x1800, 2)[0]
        self._syncs += 1
        if every <= 240 and self._syncs % every == 0:
            self.network.send_message(0x180 + NODE, bytes((self.inputs,)))
        if self._latched is not None:
            self.node.set_data(0x6200, 1, self._latched)
            self._latched = None

    def close(self) -> None:
        self.node.nmt.stop_heartbeat()
        self.network.disconnect()


@pytest.fixture
def coupler(monkeypatch: pytest.MonkeyPatch) -> Iterator[Coupler]:
    """The drives beside it are simulated, the node is not."""
    monkeypatch.setattr(
        inner_bus,
        "simulated_nodes",
        lambda settings, *others: simulated_nodes(replace(settings, io_nodes=()), *others),
    )
    coupler = Coupler()
    yield coupler
    coupler.close()


def test_a_node_of_another_maker_comes_up_is_switched_and_shows_its_inputs(coupler: Coupler) -> None:
    with running_gateway(SETTINGS) as (client, _stop, _codes):
        client.until(lambda: client.state is not None and client.state.ready)
        assert _input(client) is False
        coupler.inputs = 1 << 5
        client.until(lambda: _input(client) is True)
        reply = client.ask(SwitchOutput("left", "gripper", True, "me"))
        assert reply.ok, reply.text
        assert coupler.outputs == 1 << 2
        coupler.network.unsubscribe(0x080)
        client.until(lambda: _input(client) is None)
        (status,) = client.state.io_nodes
        assert not status.operational


def _input(client: Client) -> bool | None:
    return client.state.inputs["left"]["part_present"]
