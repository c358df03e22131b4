"""Margins from a known open loop, and the measured loop against the formulas of its parts."""

from cmath import exp as cexp
from dataclasses import replace
from math import cos, exp, inf, pi, sin, sqrt
from typing import Any

import pytest

from drive_gateway.sim.axis.gains import ServoData
from drive_gateway.sim.axis.mechanics import LoadData
from drive_gateway.sim.axis.response import (
    Point,
    Step,
    frequencies,
    frequency_response,
    margins,
    step_response,
)
from tests.unit.repository import vectors
from tests.unit.sim_axis_world import AXIS

VECTORS = vectors("motor.json")
TWO_MASS = VECTORS["two_mass"]
WITHIN = 0.01
EXACT = replace(AXIS, load=LoadData(20.0))


def pi_loop(speed_hz: float, hz: float) -> complex:
    """Inertia 0.02, kT 0.5, PI with 20 ms, dead time 0.2 ms, lag 0.1 ms."""
    s = 2j * pi * hz
    gain = 2 * pi * speed_hz * 0.02 / 0.5
    return gain * (1 + 1 / (0.02 * s)) * 0.5 / (0.02 * s) * cexp(-2e-4 * s) / (1 + 1e-4 * s)


@pytest.mark.parametrize("vector", VECTORS["gain_margins"], ids=lambda vector: f"{vector['speed_hz']} Hz")
def test_gain_margin_equals_the_vectors(vector: dict[str, float]) -> None:
    found = margins([Point(hz, pi_loop(vector["speed_hz"], hz)) for hz in frequencies(5.0, 2000.0, 200)])
    assert found.gain == pytest.approx(vector["margin"], rel=WITHIN)
    assert found.gain_hz == pytest.approx(852, rel=WITHIN)
    turned = Point(found.gain_hz, pi_loop(vector["speed_hz"], found.gain_hz))
    assert abs(turned.closed) == pytest.approx(vector["closed"], rel=WITHIN)


def test_loop_that_never_turns_round_has_no_limit_of_its_gain() -> None:
    assert margins([Point(hz, 10.0 / (2j * pi * hz)) for hz in frequencies(0.1, 100.0, 30)]).gain == inf


@pytest.mark.parametrize("hz", [10.0, 30.0, 80.0])
def test_measured_loop_is_controller_times_inertia(hz: float) -> None:
    point = frequency_response(EXACT, [hz])[0]
    s = 2j * pi * hz
    expected = 2 * pi * EXACT.servo.speed_hz * (1 + 1 / (EXACT.servo.reset_s * s)) / s
    assert abs(point.open) == pytest.approx(abs(expected), rel=0.03)


def test_speed_loop_crosses_where_it_was_told_to() -> None:
    assert margins(frequency_response(EXACT, frequencies(20.0, 120.0, 12))).crossover_hz == pytest.approx(50, rel=0.03)


def test_measured_loop_shows_both_frequencies_of_two_masses() -> None:
    motor = replace(AXIS.motor, inertia_kg_m2=TWO_MASS["motor_kg_m2"])
    load = LoadData(TWO_MASS["load_kg_m2"], stiffness_nm_rad=TWO_MASS["stiffness_nm_rad"], damping_nm_s=0.05)
    soft = replace(EXACT, motor=motor, load=load, gear=1.0, servo=ServoData(speed_hz=10.0))

    def gains(around: float) -> list[tuple[float, float]]:
        return [(abs(p.open), p.hz) for p in frequency_response(soft, [around * (0.97 + 0.01 * k) for k in range(7)])]

    assert min(gains(TWO_MASS["antiresonance_hz"]))[1] == pytest.approx(TWO_MASS["antiresonance_hz"], rel=WITHIN)
    assert max(gains(TWO_MASS["resonance_hz"]))[1] == pytest.approx(TWO_MASS["resonance_hz"], rel=WITHIN)


@pytest.mark.parametrize("worked", VECTORS["second_order"], ids=lambda worked: f"{worked['damping']:.2f}")
def test_figures_of_a_step_are_those_of_the_worked_second_order(worked: dict[str, Any]) -> None:
    damping, natural = worked["damping"], worked["natural_rad_s"]
    damped, decay = natural * sqrt(1.0 - damping**2), natural * damping

    def answer(t: float) -> float:
        return 1.0 - exp(-decay * t) * (cos(damped * t) + decay / damped * sin(damped * t))

    times = tuple(0.001 * k for k in range(20_000))
    step = Step(times, tuple(answer(t) for t in times))
    assert step.overshoot == pytest.approx(worked["overshoot"], rel=1e-5)
    assert times[step.speed.index(max(step.speed))] == pytest.approx(worked["peak_s"], abs=1e-3)
    for time, value in worked.get("values", []):
        assert answer(time) == pytest.approx(value, abs=1e-9)
    if "settled_s" in worked:
        assert step.settled_s == pytest.approx(worked["settled_s"], abs=2e-3)


def test_step_ends_at_its_height_and_rises_with_the_bandwidth() -> None:
    step = step_response(EXACT, 0.3)
    assert step.speed[-1] == pytest.approx(1.0, rel=WITHIN)
    assert 0.15 / 50 < step.rise_s < 0.35 / 50
    assert step.settled_s < 0.1
