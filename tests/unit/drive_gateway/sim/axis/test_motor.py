"""The motor against what its data sheet promises: stall current, no-load speed, time constants; and its presets."""

from cmath import exp as cexp
from dataclasses import replace
from math import exp, hypot, pi, radians, sqrt
from typing import Any

import pytest

from drive_gateway.sim.axis.mechanics import LoadData, Mechanics
from drive_gateway.sim.axis.motor_data import DATA_SHEET, MOTORS, RAD_S_PER_RPM, MotorData
from drive_gateway.sim.axis.winding import Winding
from tests.unit.repository import vectors

VECTORS = vectors("motor.json")
STEP_S = 1e-4
VOLTS = 10.0
"""Amplitude of a phase."""
WITHIN = 0.01
NOTHING = LoadData(inertia_kg_m2=0.0)
EVERY = pytest.mark.parametrize("motor", MOTORS.values(), ids=list(MOTORS))


def spin(motor: MotorData, seconds: float) -> float:
    """Speed [rad/s] after `VOLTS` across the field for some time, from rest and without load."""
    winding = Winding(motor, STEP_S)
    shaft = Mechanics(motor.inertia_kg_m2, NOTHING, 1.0, 0.0, STEP_S)
    for _ in range(round(seconds / STEP_S)):
        turned = cexp(1j * motor.pole_pairs * (shaft.angle + 0.5 * STEP_S * shaft.speed))
        winding.step(1j * VOLTS * turned, shaft.angle, shaft.speed)
        current = (winding.current * cexp(-1j * motor.pole_pairs * shaft.angle)).imag
        shaft.step(motor.torque_per_ampere * current, 0.0, 0.0)
    return shaft.speed


def mechanical_s(motor: MotorData) -> float:
    return motor.inertia_kg_m2 * motor.phase_resistance / (motor.torque_per_ampere * motor.emf)


@EVERY
def test_stall_current_is_voltage_over_resistance(motor: MotorData) -> None:
    winding = Winding(motor, STEP_S)
    for _ in range(round(12 * motor.phase_inductance / motor.phase_resistance / STEP_S)):
        winding.step(VOLTS, 0.3, 0.0)
    assert abs(winding.current) == pytest.approx(VOLTS / motor.phase_resistance, rel=WITHIN)


@EVERY
def test_current_rises_with_the_electrical_time_constant(motor: MotorData) -> None:
    """The moment at which 1 - 1/e of the stall current is reached, between two steps by a straight line."""
    winding, steps = Winding(motor, STEP_S), 0
    level, before = VOLTS / motor.phase_resistance * (1 - exp(-1)), 0.0
    while abs(winding.current) < level:
        before = abs(winding.current)
        winding.step(VOLTS, 0.0, 0.0)
        steps += 1
    time_s = STEP_S * (steps - 1 + (level - before) / (abs(winding.current) - before))
    assert time_s == pytest.approx(motor.inductance_h / motor.resistance_ohm, rel=WITHIN)


@EVERY
def test_no_load_speed_is_where_the_induced_voltage_is_the_applied_one(motor: MotorData) -> None:
    rms_line_to_line = VOLTS * sqrt(3) / sqrt(2)
    expected = 1000 * rms_line_to_line / motor.voltage_constant_v_krpm * 2 * pi / 60
    assert spin(replace(motor, inertia_kg_m2=1e-4), 3.0) == pytest.approx(expected, rel=WITHIN)


@EVERY
def test_speed_rises_with_the_mechanical_time_constant(motor: MotorData) -> None:
    loaded = replace(motor, inertia_kg_m2=10 * motor.inertia_kg_m2)
    quick = replace(loaded, inductance_h=1e-3 * motor.resistance_ohm * mechanical_s(loaded))
    assert spin(quick, mechanical_s(loaded)) == pytest.approx((1 - exp(-1)) * VOLTS / motor.emf, rel=WITHIN)


def test_closed_solution_of_the_winding_equals_the_differential_equation() -> None:
    motor = MOTORS["83-300"]
    winding, speed, steps = Winding(motor, 1e-3), 200.0, 20_000
    winding.step(30 + 20j, 0.4, speed)
    current, dt = 0j, 1e-3 / steps
    for k in range(steps):
        angle = motor.pole_pairs * (0.4 + speed * (k + 0.5) * dt)
        induced = 1j * motor.emf * speed * cexp(1j * angle)
        current += (30 + 20j - motor.phase_resistance * current - induced) / motor.phase_inductance * dt
    assert abs(winding.current - current) < 1e-3 * abs(current)


@pytest.mark.parametrize("motor", DATA_SHEET, ids=lambda motor: motor.name)
def test_data_sheet_agrees_with_itself(motor: MotorData) -> None:
    assert motor.stall_torque_nm / motor.stall_current_a == pytest.approx(motor.torque_constant_nm_a, rel=WITHIN)
    kilowatts = motor.rated_torque_nm * motor.rated_speed_rpm * pi / 30e3
    assert kilowatts == pytest.approx(VECTORS["rated_kw"][motor.name], abs=0.05)


@pytest.mark.parametrize("row", VECTORS["data_sheet"]["rows"], ids=lambda row: row[0])
def test_presets_have_what_follows_from_the_columns_of_the_data_sheet(row: list[Any]) -> None:
    motor = MOTORS[row[0]]
    time_ms = 1000.0 * motor.phase_inductance / motor.phase_resistance
    volts = motor.voltage_constant_v_krpm * motor.rated_speed_rpm / 1000.0
    hertz = motor.pole_pairs * motor.rated_speed_rpm / 60.0
    assert [time_ms, volts, hertz] == [pytest.approx(row[1], abs=0.05), pytest.approx(row[2], abs=0.1), row[3]]
    assert motor.stall_torque_nm < motor.brake_torque_nm


@pytest.mark.parametrize("vector", VECTORS["induced"], ids=lambda vector: f"{vector['volts']} V")
def test_induced_voltage_is_that_of_the_speed(vector: dict[str, float]) -> None:
    motor = replace(MOTORS["83-300"], voltage_constant_v_krpm=vector["volts_per_krpm"])
    rms_line_to_line = motor.emf * vector["rpm"] * RAD_S_PER_RPM * sqrt(3) / sqrt(2)
    assert rms_line_to_line == pytest.approx(vector["volts"], rel=2e-4)


@pytest.mark.parametrize(("pole_pairs", "cycle_deg"), [(10, 36.0), (3, 120.0)])
def test_the_field_repeats_with_each_pair_of_poles(pole_pairs: int, cycle_deg: float) -> None:
    found = []
    for angle in (0.2, 0.2 + radians(cycle_deg), 0.2 + 0.5 * radians(cycle_deg)):
        winding = Winding(replace(MOTORS["83-300"], pole_pairs=pole_pairs), STEP_S)
        winding.step(0.0, angle, 50.0)
        found.append(winding.current)
    assert abs(found[1] - found[0]) < 1e-9 * abs(found[0])
    assert abs(found[2] + found[0]) < 1e-9 * abs(found[0])


@EVERY
def test_voltage_and_torque_constant_belong_to_the_same_motor(motor: MotorData) -> None:
    assert sqrt(3) * motor.voltage_constant_v_krpm / 104.72 == pytest.approx(motor.torque_constant_nm_a, rel=0.06)


def test_torque_needs_the_current_across_the_field_only() -> None:
    motor = MOTORS["83-300"]
    assert motor.torque_per_ampere * hypot(1, 1) == pytest.approx(motor.torque_constant_nm_a)
