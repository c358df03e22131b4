"""The full level: it follows, brakes, holds against gravity, and every protection speaks with its code."""

from math import degrees

import pytest

from drive_gateway.canopen.emcy import MOTOR_HOT, meaning_of
from drive_gateway.sim.axis import protection
from drive_gateway.sim.axis.dc_bus import DcBus, DcBusData
from drive_gateway.sim.axis.load import constant, pendulum
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.motor_data import MOTORS
from tests.unit.sim_axis_world import AXIS, COUNTS, CYCLE_S, GEAR, LAG_S, QUICK_STOP, Rig

WEIGHT = constant(-400.0)
"""[Nm], within what the brake holds."""


def test_axis_runs_behind_a_constant_speed_by_the_lag() -> None:
    rig = Rig()
    rig.enable()
    rig.accelerate(1.5)
    rig.follow(0.6, 1.5)
    assert rig.servo.error / COUNTS == pytest.approx(1.5 * LAG_S, rel=0.02)
    assert rig.servo.velocity / COUNTS == pytest.approx(1.5, rel=0.01)
    assert rig.codes == []


def test_axis_settles_on_its_target_against_a_weight() -> None:
    rig = Rig(torque=WEIGHT)
    rig.enable()
    rig.accelerate(0.5)
    rig.follow(1.0)
    assert degrees(abs(rig.servo.error) / COUNTS) < 1e-3


def test_axis_does_not_drop_when_its_stage_goes_on_or_off() -> None:
    rig = Rig(torque=pendulum(80.0, 0.5, -1.5))
    start = rig.servo.position
    rig.enable()
    rig.follow(0.4)
    assert abs(rig.servo.position - start) < 0.001 * COUNTS
    rig.rest(1.0)
    assert abs(rig.servo.position - start) < 0.001 * COUNTS
    assert rig.servo.machine.winding.current == 0


def test_braking_needs_the_distance_of_its_deceleration() -> None:
    rig = Rig()
    rig.enable()
    rig.accelerate(1.5)
    start = rig.servo.position
    rig.brake(0.4)
    assert rig.servo.standing
    assert (rig.servo.position - start) / COUNTS == pytest.approx(1.5**2 / (2 * QUICK_STOP / COUNTS), rel=0.1)


def test_open_bridge_in_motion_leaves_the_holding_brake() -> None:
    rig = Rig()
    rig.enable()
    rig.accelerate(1.5)
    rig.rest(0.4)
    assert rig.servo.standing
    assert rig.servo.machine.brake_closed


def test_braking_charges_the_shared_bus_and_the_chopper_bounds_it() -> None:
    rig = Rig(load=LoadData(200.0))
    rig.enable()
    rig.accelerate(2.0)
    highest = 0.0
    for _ in range(100):
        rig.brake(CYCLE_S)
        highest = max(highest, rig.bus.voltage)
    assert rig.bus.data.supply_v + 50 < highest < rig.bus.data.high_v


def overload(rig: Rig) -> None:
    rig.servo.block(True)


def lose_mains(rig: Rig) -> None:
    rig.bus.switch_supply(False)
    rig.bus.advance(1.0, 1000.0)


def fail_encoder(rig: Rig) -> None:
    rig.servo.machine.encoder.failed = True


@pytest.mark.parametrize(
    ("fault", "code"),
    [
        (lambda rig: rig.servo.heat(True), MOTOR_HOT),
        (lambda rig: rig.servo.jump(1_000_000), protection.ENCODER),
        (fail_encoder, protection.ENCODER),
        (lose_mains, protection.UNDER_VOLTAGE),
        (lambda rig: rig.bus.advance(0.001, -600.0), protection.OVER_VOLTAGE),
        (overload, protection.BLOCKED),
    ],
)  # fmt: skip
def test_each_fault_has_its_code(fault: object, code: int) -> None:
    rig = Rig()
    rig.enable()
    rig.accelerate(1.0)
    assert callable(fault)
    fault(rig)
    rig.follow(0.6, 1.0)
    assert rig.codes[0] == code
    assert "not in the table" not in meaning_of(code)[0]


def test_stuck_brake_is_a_blocked_axis() -> None:
    rig = Rig(motor=MOTORS["83-300"])
    rig.servo.stick_brake(True)
    rig.enable()
    rig.accelerate(1.0)
    rig.follow(1.0, 1.0)
    assert set(rig.codes) & {protection.BLOCKED, protection.MEAN_CURRENT}


def test_too_much_current_for_too_long_is_named() -> None:
    rig = Rig(torque=constant(0.0), load=LoadData(20.0, coulomb_nm=1800.0))
    rig.enable()
    rig.accelerate(0.5)
    rig.follow(6.0, 0.5)
    assert rig.codes[0] == protection.MEAN_CURRENT


def test_runaway_is_an_overspeed() -> None:
    rig = Rig()
    rig.servo.machine.mechanics.speed = 1.5 * AXIS.top_speed
    rig.rest(0.004)
    assert rig.codes[0] == protection.OVER_SPEED


def test_open_bridge_of_a_hard_fault_stops_by_the_brake_and_returns_after_its_cause() -> None:
    rig = Rig()
    rig.enable()
    rig.accelerate(1.0)
    fail_encoder(rig)
    rig.brake(0.4)
    assert rig.servo.machine.winding.current == 0
    assert rig.servo.persists(protection.ENCODER)
    rig.servo.machine.encoder.failed = False
    rig.rest(0.1)
    assert not rig.servo.persists(protection.ENCODER)
    rig.target = rig.servo.position
    rig.enable()
    assert not rig.servo.machine.brake_closed


def test_hot_motor_must_cool_down_before_it_may_go_on() -> None:
    rig = Rig()
    rig.servo.heat(True)
    rig.rest(0.1)
    assert rig.servo.persists(MOTOR_HOT)
    rig.servo.heat(False)
    rig.rest(0.1)
    assert not rig.servo.persists(MOTOR_HOT)


def test_two_axes_share_one_bus() -> None:
    bus = DcBus(DcBusData())
    heavy = LoadData(200.0)
    rigs = [Rig(bus, load=heavy), Rig(bus, load=heavy)]
    for rig in rigs:
        rig.enable()
    for rig in rigs:
        rig.accelerate(1.0)
    before = bus.voltage
    rigs[0].brake(0.1)
    assert bus.voltage > before
    assert rigs[1].servo.machine.mechanics.speed == pytest.approx(GEAR * 1.0, rel=0.1)


def test_two_masses_ring_when_they_are_pushed_and_come_to_rest() -> None:
    rig = Rig(load=LoadData(20.0, stiffness_nm_rad=2e5, damping_nm_s=200.0))
    rig.enable()
    rig.accelerate(1.0, 0.05)
    mechanics = rig.servo.machine.mechanics
    assert mechanics.angle != mechanics.load_angle
    rig.brake(1.0)
    assert abs(mechanics.load_speed) < 0.5
