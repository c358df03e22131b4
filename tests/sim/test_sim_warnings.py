"""A drive that is near a limit of its own warns (statusword bit 7): shown and told, and nothing stops for it."""

import pytest

from cell.messages import ReadObject, ScanBus
from drive_gateway.gateway.event_log import EventLog
from drive_gateway.gateway.watch.drive_warnings import QUIET_S, DriveWarnings
from drive_gateway.sim.axis.axis_servo import BUS_HIGH, BUS_LOW, MEAN_CURRENT_HIGH, MOTOR_WARM, STAGE_WARM
from drive_gateway.sim.axis.motor_data import MOTORS
from drive_gateway.sim.axis.protection import Protection, Seen
from tests.sim.gateway_bench import GatewayBench, axis, settings

MOTOR = MOTORS["joint-large"]
CONTINUOUS = 2.0 * MOTOR.stall_current_a**2


def seen(square: float = 0.0, dc_v: float = 560.0, powered: bool = True) -> Seen:
    return Seen(0.01, square, square, dc_v, 0.0, False, False, powered)


def test_a_warm_motor_is_shown_and_told_once_and_the_robot_stays_enabled() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 1, number=2)))
    world.ready()
    world.enabled()
    world.bus.nodes[1].drives[1].servo.warm()
    world.run(0.5)
    told = [event.text for event in world.events if event.code == "drive_warning"]
    assert len(told) == 1
    assert told[0].startswith("node 1 axis 2 (left J2) warns (statusword bit 7)")
    assert world.state is not None
    assert world.feedback is not None
    assert [node.warning for node in world.state.nodes] == [False, True]
    assert world.ask(ScanBus()).text.splitlines() == [
        "node 1 (left J1): Operation Enabled",
        "node 1 axis 2 (left J2): Operation Enabled, warning",
    ]
    assert world.ask(ReadObject(1, 0x2802, 0)).data == "01"
    assert world.feedback.enabled


def test_a_warning_that_comes_and_goes_is_over_when_it_stays_away() -> None:
    world = GatewayBench(settings(axis("J1", 1)))
    world.ready()
    drive, log = world.core._robots["left"].group.nodes[0], EventLog("bus", "boot")
    warnings = DriveWarnings([drive], log)
    told = []
    for now, word in ((0.0, 0x2B7), (1.0, 0x237), (5.0, 0x2B7), (6.0, 0x237), (5.1 + QUIET_S, 0x237), (30.0, 0x237)):
        drive.statusword = word
        warnings.step(now)
        told.append([effect.message.code for effect in log.take(now)])  # type: ignore[attr-defined]
    assert told == [["drive_warning"], [], [], [], ["drive_warning_over"], []]


@pytest.mark.parametrize("at_switch", [True, False])
def test_a_limit_switch_blocks_one_direction_which_is_a_warning(at_switch: bool) -> None:
    world = GatewayBench(settings(axis("J1", 1, limit_switches=(0.5 if at_switch else 0.4, 0.9))))
    world.ready()
    assert world.state is not None
    assert world.state.nodes[0].warning is at_switch


@pytest.mark.parametrize(
    ("motor_c", "stage_c", "dc_v", "powered", "warnings"),
    [
        (20.0, 20.0, 560.0, True, 0),
        (MOTOR.hot_c - 9.0, 20.0, 560.0, True, MOTOR_WARM),
        (MOTOR.hot_c - 11.0, 86.0, 560.0, True, STAGE_WARM),
        (20.0, 84.0, 750.0, True, BUS_HIGH),
        (20.0, 20.0, 415.0, True, BUS_LOW),
        (20.0, 20.0, 415.0, False, 0),
    ],
)
def test_what_is_near_its_limit_warns_before_it_trips(
    motor_c: float, stage_c: float, dc_v: float, powered: bool, warnings: int
) -> None:
    protection = Protection(MOTOR, (400.0, 780.0), 600.0)
    protection.motor_c, protection.stage_c = motor_c, stage_c
    assert protection.update(seen(dc_v=dc_v, powered=powered)) == []
    assert protection.warnings == warnings


def test_mean_current_warns_at_half_of_what_it_may_use_up_and_until_half_of_that_is_left() -> None:
    protection = Protection(MOTOR, (400.0, 780.0), 600.0)
    peak = MOTOR.peak_current**2
    used = 0.0
    while not protection.warnings:
        assert protection.update(seen(square=peak)) == []
        used += 0.01
    assert protection.warnings == MEAN_CURRENT_HIGH
    assert used == pytest.approx(0.25, abs=0.02)  # of the 0.5 s that the peak may flow
    while protection.warnings:
        protection.update(seen(square=0.0))
        used -= 0.01 * CONTINUOUS / (peak - CONTINUOUS)
    assert used == pytest.approx(0.125, abs=0.02)
