"""Space vectors: duty cycles by sector, what the bridge makes of them, and the way back from three phases."""

from cmath import phase, rect
from math import cos, pi, radians, sin, sqrt

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drive_gateway.sim.axis.commutation import bridged, clarke, phases, space_vector
from tests.unit.repository import vectors

DUTIES = vectors("motor.json")["duties"]
DC_V = 560.0


def by_sectors(m: float, angle: float) -> tuple[float, float, float]:
    """The textbook's way: which of six sectors, its two vectors, their times."""
    sector = int(angle // (pi / 3)) % 6
    first, second = m * sin(pi / 3 * (sector + 1) - angle), m * sin(angle - pi / 3 * sector)
    both = first + second
    return (
        (both, second, 0.0),
        (first, both, 0.0),
        (0.0, both, second),
        (0.0, first, both),
        (second, 0.0, both),
        (both, 0.0, first),
    )[sector]


@pytest.mark.parametrize("vector", DUTIES, ids=lambda vector: f"{vector['angle_deg']} deg")
def test_duties_equal_the_vectors(vector: dict[str, float]) -> None:
    duties = space_vector(rect(vector["m"] * DC_V / sqrt(3), radians(vector["angle_deg"])), DC_V)
    assert duties == pytest.approx(vector["duty"], rel=0.01, abs=1e-6)


def test_six_vectors_of_the_bridge_are_two_thirds_of_the_bus_60_degrees_apart() -> None:
    for k, legs in enumerate([(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (0, 0, 1), (1, 0, 1)]):
        assert abs(clarke(*map(float, legs)) - rect(2 / 3, k * pi / 3)) < 1e-12
    assert phases(1.0 + 0j) == pytest.approx((1.0, -0.5, -0.5))


def test_the_longest_voltage_in_all_directions_is_the_bus_over_root_3() -> None:
    assert max(space_vector(rect(DC_V / sqrt(3), radians(30)), DC_V)) == pytest.approx(1.0)
    assert abs(clarke(*space_vector(rect(0.8 * DC_V / sqrt(3), radians(45)), DC_V))) == pytest.approx(0.46188, abs=1e-5)


@given(st.floats(0.0, 1.0), st.floats(0.0, 2 * pi - 1e-9))
def test_duties_equal_the_sectors_everywhere(m: float, angle: float) -> None:
    assert space_vector(rect(m * DC_V / sqrt(3), angle), DC_V) == pytest.approx(by_sectors(m, angle), abs=1e-9)


@given(st.floats(0.0, DC_V / sqrt(3)), st.floats(-pi, pi))
def test_bridge_makes_the_wanted_voltage(size: float, angle: float) -> None:
    u, v, w = space_vector(rect(size, angle), DC_V)
    assert abs(DC_V * clarke(u, v, w) - rect(size, angle)) < 1e-9 * DC_V


@given(st.floats(0.0, 3 * DC_V), st.floats(-pi, pi))
def test_terminals_get_what_the_duty_cycles_make(size: float, angle: float) -> None:
    wanted = rect(size, angle)
    assert abs(bridged(wanted, DC_V) - DC_V * clarke(*space_vector(wanted, DC_V))) < 1e-9 * DC_V


@given(st.floats(DC_V, 10 * DC_V), st.floats(-pi, pi))
def test_too_long_a_vector_keeps_its_angle(size: float, angle: float) -> None:
    u, v, w = space_vector(rect(size, angle), DC_V)
    assert max(u, v, w) == pytest.approx(1.0)
    assert abs(phase(clarke(u, v, w) * rect(1.0, -angle))) < 1e-9


def test_currents_of_three_phases_give_torque_only_across_the_field() -> None:
    for electric in (0.0, 0.5, 2.0, 4.0):
        u, v, w = (cos(electric + pi / 2 - shift) for shift in (0.0, 2 * pi / 3, 4 * pi / 3))
        current = clarke(u, v, w) * rect(1.0, -electric)
        assert (current.real, current.imag) == pytest.approx((0.0, 1.0), abs=1e-12)


def test_phases_add_up_to_nothing() -> None:
    assert sum(phases(3 - 4j)) == pytest.approx(0.0, abs=1e-12)
