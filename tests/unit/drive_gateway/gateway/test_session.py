"""A session of the gateway, logged by python-can, replayed and decoded by the `canopen` library as an observer.

The observer shares no code with the gateway: `canopen.LocalNode` takes what is said to a node as that node would,
`canopen.RemoteNode` takes what the node says.
"""

from importlib.resources import as_file, files
from itertools import groupby
from pathlib import Path

import can
import canopen
import pytest
from canopen.profiles.p402 import State402

from cell.messages import AxisStatus, Claim, DisableDrives, EnableDrives
from drive_gateway.gateway.bus.opening import open_bus
from tests.unit.gateway_thread import running_gateway
from tests.unit.gateway_world import gateway_settings

NODE = 1
PDO_RECORDS = (0x1400, 0x1600, 0x1800, 0x1A00)
LINKED = {
    0x1400: [("01", "01 02 00 80"), ("02", "01"), ("01", "01 02 00 00")],
    0x1600: [("00", "00"), ("01", "10 00 40 60"), ("02", "20 00 7a 60"), ("00", "02")],
    0x1800: [("01", "81 01 00 c0"), ("02", "01"), ("01", "81 01 00 40")],
    0x1A00: [("00", "00"), ("01", "10 00 41 60"), ("02", "20 00 64 60"), ("00", "02")],
}
"""What is written to each PDO record of node 1: sub-index and bytes. Bit 30 of the TPDO is as the drive has it."""


class Observer:
    """Decodes a log; `seen` is what happened to node 1, in order: its service, and what it said."""

    def __init__(self, eds: str) -> None:
        self.seen: list[tuple[str, str]] = []
        self.linked: dict[int, list[tuple[str, str]]] = {index: [] for index in PDO_RECORDS}
        # A bus of their own, where nobody hears what the decoding nodes would answer.
        self._networks = [canopen.Network().connect(interface="virtual", channel=f"observer {n}") for n in range(2)]
        told, heard = self._networks
        self.node = told.create_node(NODE, eds)
        self.node.add_write_callback(self._on_write)
        told.subscribe(0x000, lambda _id, data, _at: self._see("nmt", f"{data[0]:02X} {data[1]:02X}"))
        told.subscribe(0x080, lambda _id, data, _at: self._see("sync", f"{len(data)} bytes"))
        remote = heard.add_node(NODE, eds)
        remote.nmt.add_heartbeat_callback(lambda state: self._see("heartbeat", str(state)))
        remote.emcy.add_callback(lambda error: self._see("emergency", f"{error.code:04X}"))
        tpdo = remote.tpdo[1]
        tpdo.cob_id, tpdo.enabled = 0x180 + NODE, True
        tpdo.add_variable(0x6041)
        tpdo.add_variable(0x6064)
        tpdo.subscribe()
        tpdo.add_callback(lambda pdo: self._see("drive", _state(pdo[0].raw)))

    def replay(self, log: Path) -> None:
        """Play a log of python-can into the observer, as fast as it goes."""
        try:
            for message in can.MessageSync(can.LogReader(log), timestamps=False):
                for network in self._networks:
                    network.notify(message.arbitration_id, message.data, message.timestamp)
        finally:
            self.node.nmt.stop_heartbeat()
            for network in self._networks:
                network.disconnect()

    def of(self, *services: str) -> list[tuple[str, str]]:
        """What was seen of some services, repetitions left out."""
        return [event for event, _ in groupby(event for event in self.seen if event[0] in services)]

    def first(self, service: str, what: str) -> int:
        """Where something was seen first."""
        return self.seen.index((service, what))

    def _see(self, service: str, what: str) -> None:
        self.seen.append((service, what))

    def _on_write(self, index: int, subindex: int, data: bytes, **_: object) -> None:
        self._see("sdo write", f"{index:04X}:{subindex:02X}")
        if index in self.linked:
            self.linked[index].append((f"{subindex:02d}", bytes(data).hex(" ")))


def _state(statusword: int) -> str:
    found = [name for name, (mask, value) in State402.SW_MASK.items() if statusword & mask == value]
    return found[0]


@pytest.fixture(scope="module")
def observer(tmp_path_factory: pytest.TempPathFactory) -> Observer:
    """What an observer saw of a bring-up, enabling, disabling and the gateway's end."""
    log = tmp_path_factory.mktemp("session") / "session.asc"
    bus = open_bus(gateway_settings().bus)
    logger = can.Logger(log)
    notifier = can.Notifier(bus, [logger])
    try:
        with running_gateway() as (client, _stop, _codes):
            client.until(lambda: client.state is not None and client.state.ready and client.feedback is not None)
            claim = client.ask(Claim("left", "a1", "d")).claim
            assert claim is not None
            for command, state in (
                (EnableDrives("left", claim.owner), AxisStatus.OPERATION_ENABLED),
                (DisableDrives("left", claim.owner), AxisStatus.SWITCH_ON_DISABLED),
            ):
                reply = client.ask(command)
                assert reply.ok, reply.text
                client.until(lambda wanted=state: set(client.feedback.axes) == {wanted})
    finally:
        notifier.stop()
        logger.stop()
        bus.shutdown()
    with as_file(files("drive_gateway.sim") / "cia402_drive.eds") as eds:
        decoded = Observer(str(eds))
        decoded.replay(log)
    return decoded


def test_a_node_is_reset_configured_and_started_and_says_so_in_between(observer: Observer) -> None:
    reset, start = observer.first("nmt", "82 01"), observer.first("nmt", "01 01")
    booted = reset + observer.seen[reset:].index(("heartbeat", "0"))
    *writes, parted = [place for place, (service, _) in enumerate(observer.seen) if service == "sdo write"]
    operational = observer.first("heartbeat", "5")
    assert reset < booted < writes[0] < writes[-1] < start < operational < parted
    assert observer.seen[parted][1].startswith("1016:01"), "a gateway that ends in order is not watched any more"


def test_every_pdo_is_disabled_emptied_mapped_counted_and_enabled_in_this_order(observer: Observer) -> None:
    assert observer.linked == LINKED
    for communication, mapping in ((0x1400, 0x1600), (0x1800, 0x1A00)):
        records = (f"{communication:04X}", f"{mapping:04X}")
        order = [what for service, what in observer.seen if service == "sdo write" and what[:4] in records]
        mapped = [f"{records[1]}:{sub}" for sub in ("00", "01", "02", "00")]
        assert order == [f"{records[0]}:01", f"{records[0]}:02", *mapped, f"{records[0]}:01"]


def test_the_observer_finds_the_pdo_map_that_the_gateway_meant(observer: Observer) -> None:
    observer.node.rpdo[1].read(from_od=False)
    observer.node.tpdo[1].read(from_od=False)
    mapped = [[variable.index for variable in pdo] for pdo in (observer.node.rpdo[1], observer.node.tpdo[1])]
    assert mapped == [[0x6040, 0x607A], [0x6041, 0x6064]]
    assert observer.node.tpdo[1].cob_id == 0x181
    assert observer.node.tpdo[1].trans_type == 1


def test_the_drive_goes_through_every_state_one_by_one_and_back(observer: Observer) -> None:
    assert [what for _, what in observer.of("drive")] == [
        "SWITCH ON DISABLED",
        "READY TO SWITCH ON",
        "SWITCHED ON",
        "OPERATION ENABLED",
        "SWITCHED ON",
        "READY TO SWITCH ON",
        "SWITCH ON DISABLED",
    ]


def test_process_data_flow_in_operational_only_and_one_answer_follows_each_sync(observer: Observer) -> None:
    start, closed = observer.first("nmt", "01 01"), observer.first("nmt", "80 01")
    drive = [place for place, (service, _) in enumerate(observer.seen) if service == "drive"]
    assert start < drive[0]
    assert observer.first("heartbeat", "5") < closed
    assert drive[-1] < closed + 3
    syncs = [place for place, (service, _) in enumerate(observer.seen) if service == "sync"]
    syncs = syncs[max(sum(place < start for place in syncs) - 1, 0) :]  # the one right before may be answered, too
    assert all(sync < answer for sync, answer in zip(syncs, drive, strict=False))
    assert len(drive) >= len(syncs) - 3


def test_nothing_went_wrong_and_nobody_else_was_managed(observer: Observer) -> None:
    assert not observer.of("emergency")
    commands = {what for service, what in observer.seen if service == "nmt"}
    assert commands == {f"{command} {node}" for command in ("82", "01", "80") for node in ("01", "02")}
