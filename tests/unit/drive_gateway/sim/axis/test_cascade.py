"""The servo loop: no wind-up, no lag with feed-forward, current across the field only."""

from cmath import exp as cexp
from dataclasses import replace

import pytest

from drive_gateway.sim.axis.gains import STEP_S, ServoData
from drive_gateway.sim.axis.load import constant
from drive_gateway.sim.axis.regulator import Regulator
from tests.unit.sim_axis_world import AXIS, GEAR, Rig


def test_integral_stops_at_the_limit_and_leaves_it_at_once() -> None:
    regulator = Regulator(1.0, 100.0, 0.01)
    for _ in range(1000):
        assert regulator.step(5.0, 0.0, 8.0) <= 8.0
    assert regulator.limited
    assert regulator.step(-1.0, 0.0, 8.0) < 8.0


def test_without_integral_a_weight_makes_the_axis_sag() -> None:
    """Position P and speed P: the axis sags by torque / (kT Kv Kp)."""
    weight = constant(-300.0)
    stiff = Rig(torque=weight)
    soft = Rig(torque=weight, servo=ServoData(reset_s=1e9))
    for rig in (stiff, soft):
        rig.follow(1.5)
    gains = replace(AXIS, servo=ServoData()).gains
    sag = 300.0 / GEAR / (AXIS.motor.torque_per_ampere * gains.speed * gains.position)
    assert soft.servo.error / AXIS.counts_per_rad == pytest.approx(sag, rel=0.01)
    assert abs(stiff.servo.error / AXIS.counts_per_rad) < 0.05 * sag


def test_field_gets_no_current() -> None:
    rig = Rig()
    rig.enable()
    rig.accelerate(1.5)
    machine = rig.servo.machine
    turned = machine.winding.current * cexp(-1j * AXIS.motor.pole_pairs * machine.mechanics.angle)
    assert abs(turned.real) < 0.1 * abs(turned.imag)
    assert machine.torque == pytest.approx(AXIS.motor.torque_per_ampere * turned.imag, rel=1e-6)


def test_current_loop_settles_within_few_periods() -> None:
    rig = Rig()
    rig.enable()
    rig.servo.cascade.injected = 2.0
    rig.servo.interpolate(rig.target, 0.004)
    rig.servo.follow(20 * STEP_S)
    turned = rig.servo.machine.winding.current * cexp(-1j * AXIS.motor.pole_pairs * rig.servo.machine.mechanics.angle)
    assert turned.imag == pytest.approx(rig.servo.cascade.set_current, abs=0.3)
