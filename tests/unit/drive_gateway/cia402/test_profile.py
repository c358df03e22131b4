"""Trapezoids: numbers for a six-axis gantry, worked out by hand, and what must always hold."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_gateway.cia402.profile import together, trapezoid


@pytest.mark.parametrize(
    ("distance", "speed", "ramp", "duration_s", "stop_s", "peak"),
    [
        (250, 100, 200, 3.0, 2.5, 100),
        (250, 200, 400, 1.75, 1.25, 200),
        (400, 100, 200, 4.5, 4.0, 100),
        (-400, 100, 200, 4.5, 4.0, -100),
        (400, 200, 400, 2.5, 2.0, 200),
        (90, 60, 120, 2.0, 1.5, 60),
        (10, 100, 200, 0.447214, 0.223607, 44.721360),
    ],
)
def test_one_axis(distance: float, speed: float, ramp: float, duration_s: float, stop_s: float, peak: float) -> None:
    motion = trapezoid(distance, speed, ramp)
    assert (motion.duration_s, motion.stop_s, motion.velocity) == pytest.approx((duration_s, stop_s, peak), abs=1e-6)


def test_six_axes_arrive_together() -> None:
    motions = together((400, 250, 120, 90, 60, -45), (200, 200, 150, 90, 90, 180), (400, 400, 300, 180, 180, 360))
    speeds = [200, 112.701665, 51.542120, 39.460247, 25.437980, -18.375163]
    stops = [2.0, 2.218246, 2.328193, 2.280776, 2.358679, 2.448958]
    assert [motion.velocity for motion in motions] == pytest.approx(speeds, abs=1e-6)
    assert [motion.stop_s for motion in motions] == pytest.approx(stops, abs=2e-6)
    assert {round(motion.duration_s, 9) for motion in motions} == {2.5}


NUMBER = st.floats(0.01, 100.0)


@given(st.lists(st.tuples(st.floats(-100.0, 100.0), NUMBER, NUMBER), min_size=1, max_size=6))
def test_each_axis_travels_its_distance_within_its_speed(axes: list[tuple[float, float, float]]) -> None:
    for motion, (distance, speed, ramp) in zip(together(*zip(*axes, strict=True)), axes, strict=True):
        ramp_s = abs(motion.velocity) / ramp
        assert motion.velocity * (motion.duration_s - ramp_s) == pytest.approx(distance, rel=1e-5, abs=1e-6)
        assert abs(motion.velocity) <= speed * (1 + 1e-6)
