"""Whatever goes wrong on a bus in mid-motion: the robot stops, somebody says why, and an operator gets it back."""

import random
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from cell.messages import Claim, EnableDrives, ResetDrives, SetpointBlock
from cell.messages.event import Severity
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import GatewaySettings
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

LAYOUTS = [
    settings(axis("J1", 1), axis("J2", node, number=number, counts_per_unit=-80_000.0))
    for node, number in ((2, 1), (1, 2))
]
"""Two axes on a node each, and both on one."""
MOVE_S = 2.0
STOP_S = 1.2
"""Within this time after a fault nothing moves any more: monitoring times, and the braking itself."""
SEEDS = 200


@dataclass(frozen=True)
class Fault:
    """How something breaks, and how it is put right again."""

    name: str
    begin: Callable[[GatewayBench, int, random.Random], None]
    end: Callable[[GatewayBench, int], None] = lambda _world, _node: None


def cable_out(world: GatewayBench, node: int, _rng: random.Random) -> None:
    world.bus.nodes[node].silence()


def cable_in(world: GatewayBench, node: int) -> None:
    world.bus.nodes[node].silence(False)


def bus_cut(world: GatewayBench, _node: int, _rng: random.Random) -> None:
    world.lost = lambda _frame: True


def losing(*bases: int) -> Callable[[GatewayBench, int, random.Random], None]:
    """The frames of one node with these identifiers never arrive (0x80 alone: SYNC)."""

    def begin(world: GatewayBench, node: int, _rng: random.Random) -> None:
        gone = {base if base == 0x080 else base + node for base in bases}
        world.lost = lambda frame: frame.id in gone

    return begin


def bus_whole(world: GatewayBench, _node: int) -> None:
    world.lost = lambda _frame: False


def power_cycle(world: GatewayBench, node: int, _rng: random.Random) -> None:
    world.bus.nodes[node].power_cycle()


def emergency(world: GatewayBench, node: int, rng: random.Random) -> None:
    code = rng.choice([0x2310, 0x3210, 0x3220, 0x4210, 0x4310, 0x7121, 0x7380, 0x8480, 0x8611, 0xFF01, 0x1234])
    world.bus.nodes[node].raise_emergency(code)


def second_master(world: GatewayBench, node: int, rng: random.Random) -> None:
    command = rng.choice([0x02, 0x80, 0x81, 0x82])
    world.bus.send(CanFrame(0x000, bytes([command, rng.choice([0, node])])), world.now)


def late_cycle(world: GatewayBench, _node: int, rng: random.Random) -> None:
    world.cycle(late_s=rng.uniform(0.03, 0.5))


def gateway_killed(world: GatewayBench, _node: int, rng: random.Random) -> None:
    world.alive = False
    world.run(rng.choice([0.0, 0.02, 0.1, 0.5, 1.5]))
    world.restart_gateway()


FAULTS = (
    Fault("cable out", cable_out, cable_in),
    Fault("bus cut", bus_cut, bus_whole),
    Fault("TPDO lost", losing(0x180), bus_whole),
    Fault("heartbeat of a node lost", losing(0x700), bus_whole),
    Fault("RPDO lost", losing(0x200), bus_whole),
    Fault("SYNC lost", losing(0x080), bus_whole),
    Fault("node power-cycled", power_cycle),
    Fault("emergency", emergency),
    Fault("second master", second_master),
    Fault("late cycle", late_cycle),
    Fault("gateway killed", gateway_killed),
)


def moving(layout: GatewaySettings = LAYOUTS[0]) -> GatewayBench:
    """All axes are on their way through a long move; its agent is never heard again."""
    world = GatewayBench(layout)
    world.ready()
    owner = world.enabled()
    s = np.arange(0.0, MOVE_S + CYCLE_S / 2, CYCLE_S) / MOVE_S
    way = np.array([1.0, -0.8])
    position = world.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), way)
    velocity = np.outer(30 * s**2 * (1 - s) ** 2 / MOVE_S, way)
    first = world.feedback.tick + 5
    world.tell(SetpointBlock("left", owner, 1, 0, first, CYCLE_S, len(s), position, velocity))
    world.until(lambda: world.feedback.block == 1)
    return world


def places(world: GatewayBench) -> list[float]:
    return [drive.position for node in world.bus.nodes.values() for drive in node.drives]


@pytest.mark.parametrize("seed", range(SEEDS))
def test_a_fault_in_motion_stops_the_robot_is_named_and_can_be_recovered_from(seed: int) -> None:
    rng = random.Random(seed)
    fault = FAULTS[seed % len(FAULTS)]
    layout = LAYOUTS[seed // len(FAULTS) % 2]
    node = rng.choice([each.node_id for each in layout.robots["left"].axes])
    world = moving(layout)
    world.run(rng.uniform(0.3, 1.2))
    world.events.clear()
    fault.begin(world, node, rng)
    world.run(STOP_S)
    stopped = places(world)
    world.run(0.2)
    assert places(world) == pytest.approx(stopped, abs=1.0), f"{fault.name}: still moves"

    fault.end(world, node)
    world.ready()
    named = [event for event in world.events if event.severity is Severity.ALARM]
    restarted = fault.name == "gateway killed"
    assert restarted or named, f"{fault.name}: nobody says what it was"
    assert all(event.text and event.remedy for event in named)
    assert places(world) == pytest.approx(stopped, abs=1.0), f"{fault.name}: moved again by itself"

    owner = world.ask(Claim("left", "after", "d")).claim.owner
    reset = world.ask(ResetDrives("left", owner))
    assert reset.ok, f"{fault.name}: {reset.text}"
    enabled = world.ask(EnableDrives("left", owner))
    assert enabled.ok, f"{fault.name}: {enabled.text}"
    world.run(0.2)
    assert places(world) == pytest.approx(stopped, abs=3.0), f"{fault.name}: moved when it was enabled"


def test_a_node_that_stays_away_is_said_to_be_away() -> None:
    world = moving()
    world.run(0.5)
    world.bus.nodes[2].silence()
    world.run(5.0)
    owner = world.ask(Claim("left", "after", "d")).claim.owner
    world.ask(ResetDrives("left", owner))
    assert "node 2 (left J2)" in world.state.problem
    owner = world.ask(Claim("left", "after", "d")).claim.owner
    refused = world.ask(EnableDrives("left", owner))
    assert not refused.ok
    assert "node 2 (left J2)" in refused.text


def test_a_gateway_that_restarts_finds_enabled_drives_and_switches_them_off_before_anything_else() -> None:
    world = moving()
    world.run(0.5)
    world.alive = False
    world.cycle()
    world.restart_gateway()
    world.ready()
    assert {status.name for status in world.feedback.axes} == {"SWITCH_ON_DISABLED"}
