"""The axis: lag, bounded speed, braking, against formulas and a fine numeric integration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drive_gateway.sim.axis.servo import Servo

LAG_S = 0.01
PERIOD_S = 0.004


def follow(servo: Servo, targets: list[float], step_s: float = PERIOD_S) -> None:
    for target in targets:
        servo.interpolate(target, PERIOD_S)
        for _ in range(round(PERIOD_S / step_s)):
            servo.follow(step_s)


def test_axis_runs_behind_a_constant_speed_by_the_lag() -> None:
    servo = Servo(0.0, LAG_S, 1e6)
    follow(servo, [1000.0 * PERIOD_S * k for k in range(1, 100)])
    assert servo.error / 1000.0 == pytest.approx(LAG_S, rel=1e-6)


def test_axis_settles_on_its_target() -> None:
    servo = Servo(0.0, LAG_S, 1e6)
    follow(servo, [100.0] * 100)
    assert servo.position == pytest.approx(100.0, abs=1e-6)


def test_length_of_the_step_does_not_matter() -> None:
    coarse, fine = Servo(0.0, LAG_S, 1e6), Servo(0.0, LAG_S, 1e6)
    targets = [5.0, 20.0, 10.0, 60.0]
    follow(coarse, targets)
    follow(fine, targets, PERIOD_S / 16)
    assert coarse.position == pytest.approx(fine.position, abs=1e-9)


def test_closed_solution_equals_the_differential_equation() -> None:
    servo = Servo(3.0, LAG_S, 1e9)
    servo.velocity = 500.0
    servo.interpolate(40.0, PERIOD_S)
    servo.follow(PERIOD_S)
    rate, w, steps = (40.0 - 3.0) / PERIOD_S, 1.0 / LAG_S, 40_000
    x, v, dt = 3.0, 500.0, PERIOD_S / steps
    for u in 3.0 + rate * np.arange(steps) * dt:
        x, v = x + v * dt, v + (w * w * (u - x) + 2.0 * w * (0.5 * rate - v)) * dt
    assert servo.position == pytest.approx(x, rel=1e-4)
    assert servo.velocity == pytest.approx(v, rel=1e-4)


def test_brake_needs_the_distance_of_its_deceleration() -> None:
    servo = Servo(0.0, LAG_S, 1e6)
    servo.velocity = -1000.0
    while not servo.standing:
        servo.brake(0.0037, 5000.0)
    assert servo.position == pytest.approx(-(1000.0**2) / (2 * 5000.0))


@settings(max_examples=100)
@given(st.lists(st.tuples(st.floats(-1e9, 1e9), st.floats(1e-6, 0.1), st.booleans()), max_size=20))
def test_axis_never_passes_its_top_speed(moves: list[tuple[float, float, bool]]) -> None:
    servo = Servo(0.0, LAG_S, 30_000.0)
    for target, step_s, brake in moves:
        before = servo.position
        if brake:
            servo.brake(step_s, 1e5)
        else:
            servo.interpolate(target, PERIOD_S)
            servo.follow(step_s)
        assert abs(servo.position - before) <= 30_000.0 * step_s * (1 + 1e-9) + 1e-9 * abs(before)
