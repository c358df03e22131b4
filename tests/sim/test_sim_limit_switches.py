"""Limit switches with real frames: an axis stops at them by name, leaves them in one direction, and homes on them."""

import numpy as np
import pytest

from cell.messages import AxisStatus, Claim, EnableDrives, Event, Home, MoveAxes, ResetDrives, SetpointBlock
from drive_gateway.canopen.sdo import Sdo
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, homing, settings

ENDS = (0.1, 0.9)
COUNTS = 100_000.0
AXES = settings(axis("J1", 1), axis("J2", 1, number=2, limit_switches=ENDS), axis("J3", 4))
REVERSED = settings(axis("J1", 1), axis("J2", 1, number=2, limit_switches=ENDS, counts_per_unit=-COUNTS), axis("J3", 4))
MOVE_S = 1.0


def place(world: GatewayBench) -> float:
    """Where axis J2 really is [rad]."""
    second = world.settings.robots["left"].axes[1]
    return float(world.bus.nodes[1].drives[1].position / second.counts_per_unit + second.offset)


def sent_beyond(layout: object, distance: float) -> GatewayBench:
    """All axes are sent so far by one block; J2 starts at 0.5."""
    world = GatewayBench(layout)
    world.ready()
    owner = world.enabled()
    s = np.arange(0.0, MOVE_S + CYCLE_S / 2, CYCLE_S) / MOVE_S
    way = np.array([0.2, distance, -0.2])
    position = world.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), way)
    velocity = np.outer(30 * s**2 * (1 - s) ** 2 / MOVE_S, way)
    world.tell(SetpointBlock("left", owner, 1, 0, world.feedback.tick + 5, CYCLE_S, len(s), position, velocity))
    return world


def alarms(world: GatewayBench) -> list[Event]:
    return [event for event in world.events if event.severity.name == "ALARM"]


def reset(world: GatewayBench) -> str:
    """Answers why it cannot be enabled then."""
    owner = world.ask(Claim("left", "after", "d")).claim.owner
    assert world.ask(ResetDrives("left", owner)).ok
    world.run(0.2)
    reply = world.ask(EnableDrives("left", owner))
    return "" if reply.ok else reply.text


@pytest.mark.parametrize(
    ("layout", "distance", "side", "bit", "sign"),
    [
        (AXES, -0.6, "negative", 0, ""),
        (AXES, 0.6, "positive", 1, "-"),
        (REVERSED, -0.6, "positive", 1, ""),
        (REVERSED, 0.6, "negative", 0, "-"),
    ],
)
def test_an_axis_that_runs_into_its_limit_switch_stops_the_robot_and_only_goes_away_from_it(
    layout: object, distance: float, side: str, bit: int, sign: str
) -> None:
    world = sent_beyond(layout, distance)
    world.until(lambda: "limit_switch" in world.codes(), within_s=2.0)
    world.run(0.5)
    end = ENDS[distance > 0.0]
    assert abs(place(world) - end) < 0.03
    assert (place(world) - end) * distance >= 0.0
    assert set(world.feedback.axes) == {AxisStatus.QUICK_STOP_ACTIVE}
    named = f"node 1 axis 2 (left J2) is at its {side} limit switch (60FDh bit {bit})"
    remedy = f"move it off: cell move left J2={sign}DISTANCE --by"
    assert [(event.code, event.text) for event in alarms(world)] == [("limit_switch", f"left: {named}")]
    assert alarms(world)[0].remedy == f"cell reset left; {remedy}"

    assert reset(world) == f"left stays off: {named}, {remedy}"
    further = world.ask(MoveAxes("left", {"J1": 0.1, "J2": np.sign(distance) * 0.05}, True, 1.0, False))
    assert not further.ok
    assert further.text == f"{named}; {remedy}"
    assert world.set_up(MoveAxes("left", {"J2": -np.sign(distance) * 0.1}, True, 1.0, False)) == "done"
    assert reset(world) == ""


@pytest.mark.parametrize("by_velocity", [False, True])
def test_a_set_up_motion_ends_at_a_limit_switch(by_velocity: bool) -> None:
    world = GatewayBench(AXES)
    world.ready()
    assert world.set_up(MoveAxes("left", {"J1": -0.3, "J2": 0.6}, True, 1.0, by_velocity)) == "stopped"
    assert world.said[0] == "stopped: node 1 axis 2 (left J2) is at its positive limit switch (60FDh bit 1)"
    assert 0.9 <= place(world) < 0.93
    assert set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}
    assert world.set_up(MoveAxes("left", {"J2": -0.1}, True, 1.0, by_velocity)) == "done"


def test_the_gateway_stops_the_robot_at_a_switch_that_its_drive_only_shows() -> None:
    world = sent_beyond(AXES, 0.2)
    world.run(0.3)
    world.bus.nodes[1].set_input(0, True, axis=2)
    world.run(0.5)
    assert set(world.feedback.axes) == {AxisStatus.QUICK_STOP_ACTIVE}
    assert [event.code for event in alarms(world)] == ["limit_switch"]
    assert 0.5 < place(world) < 0.69


def test_limit_switches_that_nobody_hears_stop_the_robot_and_forbid_every_way() -> None:
    world = sent_beyond(AXES, 0.2)
    world.run(0.3)
    world.lost = lambda frame: frame.id == 0x282
    world.run(0.6)
    assert [event.text for event in alarms(world)] == [
        "left: node 1 axis 2 (left J2): its limit switches (60FDh) are not heard"
    ]
    assert "are not heard, check the drive's PDOs and wiring" in reset(world)
    for distance in (-0.05, 0.05):
        assert not world.ask(MoveAxes("left", {"J2": distance}, True, 1.0, False)).ok


@pytest.mark.parametrize(
    ("method", "home", "shown"), [(17, 0.1, 1), (18, 0.9, 2), (1, 0.2, 1), (2, 0.8, 2), (23, 0.7, 4), (27, 0.3, 4)]
)
def test_homing_runs_onto_the_switches_that_the_drive_shows_and_nobody_stops_it(
    method: int, home: float, shown: int
) -> None:
    homed = axis(
        "J1",
        1,
        incremental=True,
        homing=homing(method, home),
        limit_switches=ENDS,
        index_counts=20_000,
        limits=(0.15, 0.85),
    )
    world = GatewayBench(settings(homed))
    world.ready()
    seen = 0
    assert world.ask(Home("left", ())).ok
    world.holder, world.said = "left", ("", "moving")
    while world.said[1] == "moving":
        world.cycle()
        word = world.bus.sdo(Sdo("60FD", 1, 0x60FD, 0, None), world.now).data
        seen |= int.from_bytes(word, "little") & 7
    assert world.said[1] == "done", world.said
    assert not alarms(world)
    assert seen == shown
    drive = world.bus.nodes[1].drives[0]
    assert world.feedback.position[0] == pytest.approx(drive.position / COUNTS + 0.25, abs=1e-4)
