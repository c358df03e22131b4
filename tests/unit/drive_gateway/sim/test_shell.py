"""Simulated drives on a python-can bus: the `canopen` library as their master, and how the shell begins and ends."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from importlib.resources import files
from uuid import uuid4

import can
import canopen
import pytest

from drive_gateway.canopen.nmt import NmtState
from drive_gateway.config.settings import BusSettings, GatewaySettings, RobotDrives
from drive_gateway.gateway.bus import steady_bus
from drive_gateway.gateway.bus.opening import BusError
from drive_gateway.sim.config.simulation import Simulation
from drive_gateway.sim.shell import SimulatedDrives, run_simulated_drives
from tests.unit.sim_drive_world import AXIS, COUNTS, CYCLE_S, LAG_S, NODE, START

DEADLINE_S = 20.0
SIMULATION = Simulation(lag_s=LAG_S, starts=dict.fromkeys((("left", "j1"), ("left", "j2")), START / COUNTS))


def gateway(interface: str = "virtual") -> GatewaySettings:
    return GatewaySettings(
        name="left_bus",
        bus=BusSettings(interface, f"test-{uuid4()}", 1_000_000, {}),
        cycle_s=CYCLE_S,
        overrun_limit_s=2.0,  # drives wait for a busy master as long as they can
        heartbeat_producer_s=0.1,
        heartbeat_timeout_s=0.5,
        tpdo_timeout_s=0.2,
        boot_timeout_s=2.0,
        robots={"left": RobotDrives("left", (AXIS, replace(AXIS, name="j2", node_id=NODE + 1)))},
    )


def wait_for(condition: Callable[[], bool], do: Callable[[], None] = lambda: None) -> None:
    """Do something each cycle until the condition holds."""
    pace = threading.Event()
    deadline = time.monotonic() + DEADLINE_S
    while not condition():
        assert time.monotonic() < deadline, "deadline passed"
        do()
        pace.wait(CYCLE_S)


@contextmanager
def master_of(drives: SimulatedDrives, channel: str) -> Iterator[canopen.Network]:
    """A network of the `canopen` library on a bus whose drives have booted: no boot-up is still to come."""
    wait_for(lambda: all(node.nmt is NmtState.PRE_OPERATIONAL for node in drives.nodes))
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface="virtual", channel=channel)
    try:
        yield network
    finally:
        network.disconnect()


@pytest.fixture
def master() -> Iterator[canopen.Network]:
    settings = gateway()
    with SimulatedDrives(settings, SIMULATION) as drives, master_of(drives, settings.bus.channel) as network:
        yield network


class Command:
    """What the master sends in each cycle; the target runs to `end` in steps of 40 counts."""

    def __init__(self, node: canopen.RemoteNode, network: canopen.Network) -> None:
        self._node = node
        self._network = network
        self._target = START
        self.end = START
        self.word = 0

    def cycle(self) -> None:
        self._target = min(self._target + 40, self.end)
        rpdo = self._node.rpdo[1]
        rpdo[0].raw, rpdo[1].raw = self.word, self._target
        rpdo.transmit()
        self._network.sync.transmit()

    def shows(self, state: int) -> bool:
        return self._node.tpdo[1][0].raw & 0x6F == state


def add_node(network: canopen.Network) -> canopen.RemoteNode:
    """The node after a reset, with all the time that a busy host may need for an answer."""
    node = network.add_node(NODE, str(files("drive_gateway.sim") / "cia402_drive.eds"))
    node.sdo.RESPONSE_TIMEOUT = DEADLINE_S
    booted = threading.Event()
    # The library's own wait misses a boot-up that comes before it begins to wait.
    node.nmt.add_heartbeat_callback(lambda state: booted.set() if state == NmtState.BOOT_UP else None)
    node.nmt.send_command(0x81)
    assert booted.wait(DEADLINE_S)
    return node


def test_canopen_master_reads_the_identity(master: canopen.Network) -> None:
    node = add_node(master)
    assert node.sdo["Identity"]["Product code"].raw == 0x402
    assert node.sdo[0x1008].raw == "zencell simulated drive"


def test_canopen_master_scans_both_nodes(master: canopen.Network) -> None:
    wait_for(lambda: master.scanner.nodes == [NODE, NODE + 1], lambda: master.scanner.search(NODE + 1))


def test_canopen_master_maps_enables_and_moves(master: canopen.Network) -> None:
    node = add_node(master)
    for index, value in ((0x6085, 300_000), (0x605A, 6)):
        node.sdo[index].raw = value
    node.sdo[0x60C2][1].raw = 4
    node.sdo[0x6060].raw = 8
    for pdo, objects in ((node.rpdo[1], (0x6040, 0x607A)), (node.tpdo[1], (0x6041, 0x6064))):
        pdo.read()
        pdo.clear()
        for index in objects:
            pdo.add_variable(index)
        pdo.trans_type, pdo.enabled = 1, True
        pdo.save()
    node.nmt.state = "OPERATIONAL"
    command = Command(node, master)
    for word, state in ((0x00, 0x40), (0x06, 0x21), (0x07, 0x23), (0x0F, 0x27)):
        command.word = word
        wait_for(partial(command.shows, state), command.cycle)
    command.end = START + 2000
    wait_for(lambda: node.tpdo[1][1].raw == START + 2000, command.cycle)
    command.word = 0x02
    wait_for(partial(command.shows, 0x07), command.cycle)


def test_frames_come_through_a_wire_that_takes_its_time() -> None:
    settings = gateway()
    with SimulatedDrives(settings, replace(SIMULATION, wire_time=True)) as drives:
        with master_of(drives, settings.bus.channel) as network:
            assert add_node(network).sdo["Identity"]["Product code"].raw == 0x402
        wire = drives._carrier.wire
        assert wire is not None
        assert wire.busy_s > 4 * 47 / settings.bus.bitrate


def test_closed_drives_leave_no_thread() -> None:
    before = set(threading.enumerate())
    with SimulatedDrives(gateway(), SIMULATION) as drives:
        running = set(threading.enumerate()) - before
    assert len(running) == 1
    assert drives.ended.is_set()
    assert not running & set(threading.enumerate())


def test_what_stops_the_thread_is_logged_and_kept(caplog: pytest.LogCaptureFixture) -> None:
    with SimulatedDrives(gateway(), SIMULATION) as drives:
        drives.nodes[0].step = lambda _now: 1 / 0
        assert drives.ended.wait(DEADLINE_S)
    assert "stopped" in drives.problem
    assert drives.problem in caplog.text


def test_drives_outlive_a_failure_of_their_bus(caplog: pytest.LogCaptureFixture) -> None:
    with SimulatedDrives(gateway(), SIMULATION) as drives:
        assert drives._bus is not None
        assert drives._bus._bus is not None
        old = drives._bus._bus
        old.shutdown()
        wait_for(lambda: drives._bus is not None and drives._bus._bus not in (old, None))
        with master_of(drives, drives._settings.channel) as network:
            assert add_node(network).sdo["Identity"]["Product code"].raw == 0x402
        wait_for(lambda: "works again" in caplog.text)


def test_bus_that_cannot_be_opened_is_named() -> None:
    settings = replace(gateway(), bus=BusSettings("socketcan", "no_such_bus", 1_000_000, {}))
    with pytest.raises(BusError, match="no_such_bus"), SimulatedDrives(settings, SIMULATION):
        pass


def test_drives_alone_refuse_a_bus_of_one_process() -> None:
    with pytest.raises(BusError, match="--simulate"):
        run_simulated_drives(gateway(), SIMULATION, threading.Event())


def test_drives_alone_end_with_the_stop_event(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(steady_bus, "open_bus", lambda settings: can.Bus(channel=settings.channel, interface="virtual"))
    stop = threading.Event()
    stop.set()
    assert run_simulated_drives(gateway("udp_multicast"), SIMULATION, stop) == 0
    assert f"nodes {NODE}, {NODE + 1}" in capsys.readouterr().out
