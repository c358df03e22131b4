"""Curves against worked examples: places, lengths, curvature, and the arc-length map."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.paths.arc import CircleGeometry
from robot_agent.paths.curves import Circle, Trimmed, bezier, joining
from robot_agent.paths.spline import control_points, turns_back

COORDINATE = st.floats(-1.0, 1.0) | st.sampled_from([0.0, 0.1, -0.1, 0.2, -0.2, 1.0, -1.0])
"""People type round numbers: exact zeros, repeated and mirrored points."""
POINT = st.tuples(COORDINATE, COORDINATE, COORDINATE).map(np.array)


def corner(turn_rad: float, cut: float) -> tuple[np.ndarray, np.ndarray]:
    """States on two straight lines, so far before and after a corner at the origin."""
    first, last = np.array([1.0, 0.0, 0.0]), np.array([np.cos(turn_rad), np.sin(turn_rad), 0.0])
    still = np.zeros(3)
    return np.stack([-cut * first, first, still]), np.stack([cut * last, last, still])


def test_circle_through_three_points_has_the_worked_centre_radius_and_axes() -> None:
    points = np.array([[1500, 0, 1500], [1600, 200, 1500], [1500, 400, 1500.0]])
    geometry = CircleGeometry.through(*points)
    assert geometry is not None
    circle = geometry.circle
    np.testing.assert_allclose(circle.centre, [1350, 200, 1500])
    np.testing.assert_allclose([circle.u, circle.v], [[0.6, -0.8, 0], [0.8, 0.6, 0]], atol=1e-12)
    assert circle.radius_m == pytest.approx(250)
    assert np.degrees(geometry.target_rad) == pytest.approx(106.2602, abs=1e-4)
    assert circle.length_m == pytest.approx(463.6476, abs=1e-4)
    np.testing.assert_allclose(circle.at(np.array(circle.length_m / 2))[0], points[1])


def test_circle_of_three_quarters_is_not_taken_for_a_quarter() -> None:
    geometry = CircleGeometry.through(*np.array([[100, 0, 0], [0, 100, 0], [0, -100, 0.0]]))
    assert geometry is not None
    assert geometry.target_rad == pytest.approx(1.5 * np.pi)
    assert geometry.via_rad == pytest.approx(0.5 * np.pi)


@pytest.mark.parametrize("target", [(200.0, 0.0, 0.0), (0.0, 0.0, 0.0), (200.0, 1e-6, 0.0)], ids=str)
def test_points_on_a_line_or_in_one_place_make_no_circle(target: tuple[float, ...]) -> None:
    assert CircleGeometry.through(np.zeros(3), np.array([100.0, 0, 0]), np.array(target)) is None


def test_a_via_point_that_is_the_start_but_for_rounding_makes_no_circle() -> None:
    assert CircleGeometry.through(np.zeros(3), np.array([0.0, 0.0, 3.7e-160]), np.array([0.0, 1.0, 1.0])) is None


@settings(max_examples=50, deadline=None)
@given(st.floats(1e-4, 1.0), st.floats(-30.0, 30.0).filter(lambda each: abs(each) > 1e-2), st.floats(-1.0, 1.0))
def test_a_helix_climbs_evenly_and_its_tangent_and_curvature_are_the_derivatives(
    radius_m: float, angle_rad: float, lift_m: float
) -> None:
    helix = Circle(np.zeros(3), np.array([1.0, 0, 0]), np.array([0, 1.0, 0]), radius_m, angle_rad, lift_m)
    assert helix.length_m == pytest.approx(np.hypot(radius_m * angle_rad, lift_m))
    share = np.linspace(0.0, 1.0, 9)
    place, tangent, curvature = helix.at(share * helix.length_m)
    wanted = [radius_m * np.cos(share * angle_rad), radius_m * np.sin(share * angle_rad), share * lift_m]
    np.testing.assert_allclose(place.T, wanted, atol=1e-12)
    step = 1e-5 * helix.length_m
    later, earlier = (helix.at(share * helix.length_m + each)[0] for each in (step, -step))
    np.testing.assert_allclose(tangent, (later - earlier) / (2.0 * step), atol=1e-6)
    step = 1e-3 * helix.length_m  # a closer second difference is the rounding of the places
    later, earlier = (helix.at(share * helix.length_m + each)[0] for each in (step, -step))
    np.testing.assert_allclose(curvature, (later - 2.0 * place + earlier) / step**2, rtol=1e-3, atol=1e-3 / radius_m)


@settings(max_examples=150, deadline=None)
@given(POINT, POINT, POINT)
def test_circle_passes_its_three_points_in_their_order(first: np.ndarray, via: np.ndarray, target: np.ndarray) -> None:
    geometry = CircleGeometry.through(first, via, target)
    if geometry is None or geometry.circle.radius_m > 100.0:
        return
    assert 0.0 < geometry.via_rad < geometry.target_rad
    distances = geometry.circle.radius_m * np.array([0.0, geometry.via_rad, geometry.target_rad])
    np.testing.assert_allclose(geometry.circle.at(distances)[0], [first, via, target], atol=1e-7)


def test_bezier_has_the_worked_length_and_arc_length_map() -> None:
    curve = bezier(np.array([[0, 0, 0], [100, 0, 0], [200, 100, 0], [300, 100, 0.0]]))
    assert curve.length_m == pytest.approx(319.13566, abs=1e-5)
    np.testing.assert_allclose(curve.derivative(np.array(0.7), 0), [210, 78.4, 0])
    shares = curve.length_m * np.array([0.1, 0.25, 0.5])
    np.testing.assert_allclose(curve.parameter(shares), [0.105714, 0.258596, 0.5], atol=1e-6)


@settings(max_examples=60, deadline=None)
@given(st.lists(POINT, min_size=4, max_size=4))
def test_equal_steps_of_the_parameter_are_equal_distances(points: list[np.ndarray]) -> None:
    curve = bezier(np.array(points))
    if np.linalg.norm(curve.derivative(np.linspace(0, 1, 200), 1), axis=1).min() < 0.2:
        return  # nearly a cusp, where differences say nothing
    places, h = np.linspace(0.1, 0.9, 9) * curve.length_m, 1e-5
    ahead, here, behind = (curve.at(places + step) for step in (h, 0.0, -h))
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), here[1], atol=1e-5)
    np.testing.assert_allclose(
        (ahead[1] - behind[1]) / (2 * h), here[2], atol=1e-3 * (1.0 + np.abs(here[2]).max() ** 3)
    )
    np.testing.assert_allclose(np.linalg.norm(here[1], axis=1), 1.0)


def test_spline_has_the_worked_control_points_and_curvature() -> None:
    sections = control_points(np.array([[0, 0, 0], [300, 300, 0], [600, 0, 0.0]]), None, None)
    np.testing.assert_allclose(sections[0, 1:3, :2], [[100, 100], [158.5786, 300]], atol=1e-4)
    np.testing.assert_allclose(sections[1, 1:3, :2], [[441.4214, 300], [500, 100]], atol=1e-4)
    curve = bezier(sections[0])
    assert curve.length_m == pytest.approx(439.5480, abs=1e-4)
    assert np.linalg.norm(curve.at(np.array(curve.length_m))[2]) == pytest.approx(0.0066667, abs=1e-7)


def test_spline_of_unequal_sections_is_tangential_but_its_curvature_steps() -> None:
    before, after = (
        bezier(points) for points in control_points(np.array([[0, 0, 0], [300, 300, 0], [900, 0, 0.0]]), None, None)
    )
    assert after.length_m == pytest.approx(679.9866, abs=1e-4)
    end, start = before.at(np.array(before.length_m)), after.at(np.zeros(()))
    np.testing.assert_allclose(end[1], start[1], atol=1e-12)
    np.testing.assert_allclose([np.linalg.norm(each[2]) for each in (end, start)], [0.0066667, 0.0026667], atol=1e-7)


def test_round_edge_between_lines_is_the_quartic_of_the_book() -> None:
    edge = joining(*corner(np.pi / 2, 10.0), 20.0)
    np.testing.assert_allclose(edge.derivative(np.array(0.25), 0), [-5.273438, 0.273438, 0], atol=1e-6)
    np.testing.assert_allclose(edge.derivative(np.array(0.5), 0), [-1.875, 1.875, 0], atol=1e-12)
    np.testing.assert_allclose(edge.coefficients[5], 0.0, atol=1e-12)
    assert edge.length_m == pytest.approx(17.114398, abs=1e-6)
    assert edge.parameter(np.array(0.1 * edge.length_m)) == pytest.approx(0.086181, abs=1e-6)
    rates = np.linalg.norm(edge.derivative(np.array([0.0, 0.5, 1.0]), 1), axis=1)
    np.testing.assert_allclose(rates, [20.0, 14.142136, 20.0], atol=1e-6)
    assert 1.0 / np.linalg.norm(edge.at(np.array(edge.length_m / 2))[2]) == pytest.approx(4.714045, abs=1e-6)


@pytest.mark.parametrize(
    ("turn_deg", "deviation", "radius"),
    [
        (30, 9.7057, 240.326),
        (60, 18.75, 100.0),
        (90, 26.5165, 47.1405),
        (120, 32.4760, 19.2450),
        (150, 36.2222, 4.6234),
    ],
)
def test_round_edge_leaves_the_corner_and_bends_as_worked(turn_deg: float, deviation: float, radius: float) -> None:
    edge = joining(*corner(np.radians(turn_deg), 100.0), 200.0)
    middle = edge.at(np.array(edge.length_m / 2))
    assert np.linalg.norm(middle[0]) == pytest.approx(deviation, abs=1e-4)
    assert 1.0 / np.linalg.norm(middle[2]) == pytest.approx(radius, rel=1e-4)


def test_joining_keeps_place_tangent_and_curvature_of_curved_neighbours() -> None:
    geometry = CircleGeometry.through(np.array([0.1, 0, 0]), np.array([0, 0.1, 0]), np.array([-0.1, 0, 0]))
    assert geometry is not None
    first, last = geometry.circle.at(np.array([0.05, 0.25])).swapaxes(0, 1)
    edge = joining(first, last, 0.1)
    np.testing.assert_allclose(edge.at(np.array([0.0, edge.length_m])).swapaxes(0, 1), [first, last], atol=1e-9)


def test_trimmed_curve_is_the_same_curve_elsewhere() -> None:
    curve = bezier(np.array([[0, 0, 0], [1, 0, 0], [2, 1, 0], [3, 1, 0.0]]))
    part = Trimmed(curve, 0.5, 2.0)
    assert part.length_m == 1.5
    np.testing.assert_allclose(part.at(np.array([0.0, 1.5])), curve.at(np.array([0.5, 2.0])))


@settings(max_examples=60, deadline=None)
@given(st.lists(POINT, min_size=3, max_size=6))
def test_spline_passes_its_points_along_the_chords_of_their_neighbours(points: list[np.ndarray]) -> None:
    places = np.array(points)
    if min(np.linalg.norm(np.diff(places, axis=0), axis=1).min(), _closest_second(places)) < 0.05:
        return
    sections = [bezier(controls) for controls in control_points(places, None, None)]
    for section, first, last in zip(sections, places, places[1:], strict=False):
        np.testing.assert_allclose(section.derivative(np.array([0.0, 1.0]), 0), [first, last], atol=1e-12)
    for number in range(1, len(places) - 1):
        chord = places[number + 1] - places[number - 1]
        before = sections[number - 1].at(np.array(sections[number - 1].length_m))[1]
        after = sections[number].at(np.zeros(()))[1]
        np.testing.assert_allclose([before, after], [chord / np.linalg.norm(chord)] * 2, atol=1e-9)


def _closest_second(places: np.ndarray) -> float:
    return float(np.linalg.norm(places[2:] - places[:-2], axis=1).min())


@settings(max_examples=60, deadline=None)
@given(st.floats(5.0, 150.0), st.floats(1e-3, 1.0))
def test_round_edge_stays_inside_its_corner_and_is_as_tight_as_its_angle_says(turn_deg: float, cut: float) -> None:
    turn = np.radians(turn_deg)
    edge = joining(*corner(turn, cut), 2.0 * cut)
    _, tangents, bends = edge.at(np.linspace(0.0, edge.length_m, 201))
    curvature = np.linalg.norm(bends, axis=1)
    np.testing.assert_allclose(curvature[[0, -1]], 0.0, atol=1e-6 / cut)
    tightest = 1.5 * np.sin(turn / 2.0) / (cut * np.cos(turn / 2.0) ** 2)
    assert curvature.max() == pytest.approx(tightest, rel=2e-3)
    assert curvature.max() <= tightest * (1.0 + 1e-9)
    headings = np.arctan2(tangents[:, 1], tangents[:, 0])
    assert (np.diff(headings) > -1e-9).all()
    assert (headings[0], headings[-1]) == pytest.approx((0.0, turn), abs=1e-6)
    middle = edge.at(np.array(edge.length_m / 2.0))[0]
    assert np.linalg.norm(middle) == pytest.approx(0.375 * cut * np.sin(turn / 2.0), rel=1e-6)


def test_a_cubic_that_turns_back_on_itself_is_told_from_one_that_only_bends() -> None:
    """Cusps are made by a derivative that vanishes inside; what only bends is looked at in many places."""
    rng = np.random.default_rng(0)
    u = np.linspace(0.0, 1.0, 2001)[:, None]
    for _ in range(40):
        first, middle = rng.uniform(-0.1, 0.1, (2, 3))
        at = rng.uniform(0.1, 0.9)
        last = -(first * (1.0 - at) ** 2 + 2.0 * middle * at * (1.0 - at)) / at**2
        assert turns_back(np.cumsum([np.zeros(3), first, middle, last], axis=0) / 3.0)
        last = rng.uniform(-0.1, 0.1, 3)
        way = first * (1.0 - u) ** 2 + 2.0 * middle * u * (1.0 - u) + last * u**2
        bend = 2.0 * ((middle - first) * (1.0 - u) + (last - middle) * u)
        radius = np.linalg.norm(way, axis=1) ** 3 / np.linalg.norm(np.cross(way, bend), axis=1)
        assert radius.min() > 2e-5
        assert not turns_back(np.cumsum([np.zeros(3), first, middle, last], axis=0) / 3.0)
    there_and_back = np.array([[0.0, 0.0, 0.0], [-0.04, 0.0, 0.0], [0.05, 0.0, 0.0], [0.1, 0.0, 0.0]])
    assert turns_back(there_and_back)
    assert not turns_back(np.abs(there_and_back))


@pytest.mark.parametrize("up", np.concatenate([np.eye(3), -np.eye(3)]).tolist(), ids=str)
@pytest.mark.parametrize("width", [0.05, 0.2])
def test_a_symmetric_u_turn_has_no_cusp(up: list[float], width: float) -> None:
    tangent = np.array(up)
    (controls,) = control_points(np.array([np.zeros(3), width * np.roll(tangent, 1)]), tangent, -tangent)
    assert not turns_back(controls)
