"""Motor and load: the two resonances, dry friction that holds, a brake that slips."""

from math import pi, sin

import pytest

from drive_gateway.sim.axis.load import GRAVITY_M_S2, constant, pendulum, together
from drive_gateway.sim.axis.mechanics import LoadData, Mechanics
from tests.unit.repository import vectors

TWO_MASS = vectors("motor.json")["two_mass"]
STEP_S = 1e-4
WITHIN = 0.01


def two_masses(gear: float = 1.0) -> Mechanics:
    """The load is turned a little against the motor."""
    square = gear * gear
    load = LoadData(TWO_MASS["load_kg_m2"] * square, stiffness_nm_rad=TWO_MASS["stiffness_nm_rad"] * square)
    mechanics = Mechanics(TWO_MASS["motor_kg_m2"], load, gear, 0.0, STEP_S)
    mechanics.load_angle = 0.01
    return mechanics


def frequency(mechanics: Mechanics, brake: float) -> float:
    """Of the free oscillation [Hz], from the zeros of the load's speed over one second."""
    zeros: list[float] = []
    for k in range(10_000):
        before = mechanics.load_speed
        mechanics.step(0.0, 0.0, brake)
        if before < 0.0 <= mechanics.load_speed:
            zeros.append((k + before / (before - mechanics.load_speed)) * STEP_S)
    return (len(zeros) - 1) / (zeros[-1] - zeros[0])


def test_free_masses_swing_at_the_resonance() -> None:
    assert frequency(two_masses(), 0.0) == pytest.approx(TWO_MASS["resonance_hz"], rel=WITHIN)


def test_held_motor_leaves_the_load_its_antiresonance() -> None:
    assert frequency(two_masses(), 1e6) == pytest.approx(TWO_MASS["antiresonance_hz"], rel=WITHIN)


def test_gear_counts_with_its_square() -> None:
    assert frequency(two_masses(50.0), 0.0) == pytest.approx(TWO_MASS["resonance_hz"], rel=WITHIN)


def test_behind_a_gear_the_worked_torque_of_the_motor_holds_that_of_the_joint() -> None:
    worked = vectors("encoders.json")["gear"]
    for share, turns in ((0.99, False), (1.01, True)):
        mechanics = Mechanics(0.01, LoadData(1.0, coulomb_nm=worked["joint_nm"]), worked["ratio"], 0.0, STEP_S)
        mechanics.step(share * worked["motor_nm"], 0.0, 0.0)
        assert (mechanics.speed > 0.0) is turns


def test_dry_friction_holds_what_is_weaker() -> None:
    mechanics = Mechanics(0.01, LoadData(1.0, coulomb_nm=20.0), 10.0, 0.0, STEP_S)
    for _ in range(1000):
        mechanics.step(1.9, 0.0, 0.0)
    assert mechanics.angle == 0.0
    mechanics.step(2.1, 0.0, 0.0)
    assert mechanics.speed == pytest.approx(0.1 * STEP_S / 0.02)


def test_brake_slips_above_its_torque() -> None:
    mechanics = Mechanics(0.01, LoadData(1.0), 10.0, 0.0, STEP_S)
    for _ in range(1000):
        mechanics.step(0.0, -2.5, 2.0)
    assert mechanics.speed == pytest.approx(-0.5 * 0.1 / 0.02)


def test_viscous_friction_bounds_the_speed() -> None:
    mechanics = Mechanics(0.01, LoadData(0.0, viscous_nm_s=0.5), 1.0, 0.0, STEP_S)
    for _ in range(10_000):
        mechanics.step(2.0, 0.0, 0.0)
    assert mechanics.speed == pytest.approx(4.0)


def test_pendulum_pulls_towards_where_it_hangs() -> None:
    load = together(pendulum(5.0, 0.4, -pi / 2), constant(1.0))
    assert load(-pi / 2) == pytest.approx(1.0)
    assert load(0.0) == pytest.approx(1.0 - 5.0 * 0.4 * GRAVITY_M_S2 * sin(pi / 2))
