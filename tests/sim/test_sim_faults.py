"""Whatever goes wrong on a bus in mid-motion: the robot stops, somebody says why, and an operator gets it back."""

import random
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from cell.messages import AxisStatus, Claim, EnableDrives, Event, ResetDrives
from cell.messages.drives import PlayoutState
from cell.messages.event import Severity
from drive_gateway.canopen.frame import CanFrame
from drive_gateway.config.settings import GatewaySettings
from drive_gateway.gateway.nodes import bring_up
from drive_gateway.sim.axis.axis_servo import AxisServo
from tests.sim.gateway_bench import GatewayBench
from tests.sim.long_move import LAYOUTS, moving, places

BEGIN_S = (0.4, 0.7)
"""When after the start of the move something breaks: both axes go with 0.1 rad/s and more."""
STOP_S = 0.7
"""Within this time after a fault nothing moves any more: monitoring times, and the braking itself."""
STILL_S = 0.1
DARK_S = (0.0, 0.02, 0.1, 0.5, 1.5)
"""A killed gateway is started again after so long."""
LATEST_S = 0.2
"""TPDOs are late by up to this."""
IN_TEST, IN_ALL = 68, 200


@dataclass(frozen=True)
class Fault:
    """How something breaks, what must be said about it, and how it is put right again."""

    name: str
    said: tuple[str, ...]
    """Codes of events; one of them must come, and name the node that broke. EMCY codes count as well."""
    begin: Callable[[GatewayBench, int, random.Random], None]
    end: Callable[[GatewayBench, int], None] = lambda _world, _node: None
    everywhere: bool = False
    """It befalls all nodes: any of them may be named, or none."""


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
    world.bus.nodes[node].raise_emergency(rng.choice(CODES))


def second_master(world: GatewayBench, node: int, rng: random.Random) -> None:
    command = rng.choice([0x02, 0x80, 0x81, 0x82])
    world.bus.send(CanFrame(0x000, bytes([command, rng.choice([0, node])])), world.now)


def late_cycle(world: GatewayBench, _node: int, rng: random.Random) -> None:
    world.cycle(late_s=rng.uniform(0.03, 0.5))


def gateway_killed(world: GatewayBench, _node: int, rng: random.Random) -> None:
    world.alive = False
    world.run(rng.choice(DARK_S))
    world.restart_gateway()


def late_tpdos(world: GatewayBench, node: int, rng: random.Random) -> None:
    world.bus.nodes[node].delay_tpdos(rng.uniform(0.06, LATEST_S))


def punctual_tpdos(world: GatewayBench, node: int) -> None:
    world.bus.nodes[node].delay_tpdos(0.0)
    world.run(LATEST_S)


def encoder_jump(world: GatewayBench, node: int, rng: random.Random) -> None:
    world.bus.nodes[node].servo.jump(rng.choice([-1, 1]) * rng.randint(40_000, 300_000))


def input_open(world: GatewayBench, node: int, rng: random.Random) -> None:
    world.bus.nodes[node].set_input(rng.choice([16, 17]), False)


def inputs_closed(world: GatewayBench, node: int) -> None:
    for bit in (16, 17):
        world.bus.nodes[node].set_input(bit, True)


def axis_fault(
    command: Callable[[AxisServo, bool], None],
) -> tuple[Callable[[GatewayBench, int, random.Random], None], Callable[[GatewayBench, int], None]]:
    """A fault on command that lasts until it is taken back."""
    return (
        lambda world, node, _rng: command(world.bus.nodes[node].servo, True),
        lambda world, node: command(world.bus.nodes[node].servo, False),
    )


CODES = (0x2310, 0x3210, 0x3220, 0x4210, 0x4310, 0x7121, 0x7380, 0x8480, 0x8611, 0xFF01, 0x1234)
_LOST = ("tpdo_silent", "heartbeat_lost")
_FOLLOWING = ("8611", "following_error")
FAULTS = (
    Fault("cable out", _LOST, cable_out, cable_in),
    Fault("bus cut", _LOST, bus_cut, bus_whole, everywhere=True),
    Fault("TPDO lost", ("tpdo_silent",), losing(0x180), bus_whole),
    Fault("heartbeat of a node lost", ("heartbeat_lost",), losing(0x700), bus_whole),
    Fault("RPDO lost", ("8700",), losing(0x200), bus_whole),
    Fault("SYNC lost", ("8700", "tpdo_silent"), losing(0x080), bus_whole, everywhere=True),
    Fault("node power-cycled", ("unexpected_boot",), power_cycle),
    Fault("emergency", tuple(f"{code:04X}" for code in CODES), emergency),
    Fault("second master", ("left_operational", "unexpected_boot", "tpdo_silent"), second_master, everywhere=True),
    Fault("late cycle", ("late_cycle",), late_cycle, everywhere=True),
    Fault("gateway killed", ("found_with_torque", "drive_fault"), gateway_killed, everywhere=True),
    Fault("late TPDOs", ("tpdo_silent",), late_tpdos, punctual_tpdos),
    Fault("encoder jump", _FOLLOWING, encoder_jump),
    Fault("enable input open", ("left_enabled",), input_open, inputs_closed),
    Fault("blocked axis", _FOLLOWING, *axis_fault(lambda servo, on: servo.block(on))),
    Fault("stuck brake", _FOLLOWING, *axis_fault(lambda servo, on: servo.stick_brake(on))),
    Fault("hot motor", ("4310",), *axis_fault(lambda servo, on: servo.heat(on))),
)


def named(world: GatewayBench, fault: Fault, node: int) -> list[Event]:
    """What was said that names this fault and its node."""
    events = [event for event in world.events if event.severity is not Severity.INFO]
    return [
        event
        for event in events
        if any(word == event.code or f"{word}h" in event.text for word in fault.said)
        and (fault.everywhere or f"node {node} " in event.text)
        and event.text
        and event.remedy
    ]


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nodes that are away are tried more often, so that nobody waits for them."""
    monkeypatch.setattr(bring_up, "RETRY_S", 0.1)


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize(
    "seed", [*range(IN_TEST), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(IN_TEST, IN_ALL))]
)
def test_a_fault_in_motion_stops_the_robot_is_named_and_can_be_recovered_from(seed: int) -> None:
    rng = random.Random(seed)
    fault = FAULTS[seed % len(FAULTS)]
    layout = LAYOUTS[seed // len(FAULTS) % 2]
    node = rng.choice([each.node_id for each in layout.robots["left"].axes])
    world = moving(layout)
    world.run(rng.uniform(*BEGIN_S))
    assert np.abs(world.feedback.velocity).min() > 0.1, "the fault must come in motion"
    world.events.clear()
    fault.begin(world, node, rng)
    world.run(STOP_S)
    stopped = places(world)
    world.run(STILL_S)
    assert places(world) == pytest.approx(stopped, abs=1.0), f"{fault.name}: still moves"

    fault.end(world, node)
    world.until(lambda: world.state is not None and world.state.ready and world.feedback is not None)
    world.run(0.12)
    assert named(world, fault, node), f"{fault.name}: only said {[event.text for event in world.events]}"
    assert places(world) == pytest.approx(stopped, abs=1.0), f"{fault.name}: moved again by itself"
    assert not world.feedback.enabled
    restarted = fault.name == "gateway killed"
    assert restarted or world.feedback.state is PlayoutState.FAULT, f"{fault.name}: the gateway knows of no fault"

    owner = world.ask(Claim("left", "after", "d")).claim.owner
    reset = world.ask(ResetDrives("left", owner))
    assert reset.ok, f"{fault.name}: {reset.text}"
    enabled = world.ask(EnableDrives("left", owner))
    assert enabled.ok, f"{fault.name}: {enabled.text}"
    world.run(0.1)
    assert set(world.feedback.axes) == {AxisStatus.OPERATION_ENABLED}
    assert places(world) == pytest.approx(stopped, abs=3.0), f"{fault.name}: moved when it was enabled"


@pytest.mark.parametrize("layout", LAYOUTS)
def test_without_a_fault_the_motion_would_last_longer_than_anybody_looks(layout: GatewaySettings) -> None:
    world = moving(layout)
    world.run(BEGIN_S[1] + max(DARK_S) + STOP_S)
    there = np.array(places(world))
    world.run(STILL_S)
    assert np.abs(np.array(places(world)) - there).min() > 1000.0
    assert not [event for event in world.events if event.severity is not Severity.INFO]


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
