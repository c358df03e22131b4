"""Lines within a tolerance: how far the curves are from them, and what stays a corner."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from robot_agent.paths import Arc, Line
from robot_agent.paths.caps import Tolerance
from robot_agent.paths.pose_path import PosePath
from robot_agent.paths.smoothing import Entry, smoothed
from tests.unit.robot_agent.paths.cam_lines import KINDS, CamLines, away, cam_lines

TOLERANCE = Tolerance(5e-5, np.radians(0.5))


def paths_of(lines: CamLines, tolerance: Tolerance = TOLERANCE) -> list[PosePath]:
    moves = list(enumerate(lines.lines(tolerance)))
    return smoothed(moves, lines.poses[0], lines.poses[0], None, [], 1e-4)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 2**32 - 1), tolerance_m=st.sampled_from([2e-5, 5e-5, 1e-3]))
@settings(max_examples=3, deadline=None)
def test_curves_and_lines_are_nowhere_farther_apart_than_told(kind: str, seed: int, tolerance_m: float) -> None:
    lines = cam_lines(kind, np.random.default_rng(seed))
    tolerance = Tolerance(tolerance_m, TOLERANCE.angle_rad)
    paths = paths_of(lines, tolerance)
    assert away(lines, paths, tolerance) <= 1.006
    told = [each for path in paths for each in path.transitions]
    assert all(each.deviation_m <= tolerance.distance_m for each in told)


def of_places(*places_mm: tuple[float, float, float]) -> CamLines:
    places = 1e-3 * np.array(places_mm)
    return CamLines(places, Rotation.identity(len(places)))


def curves(paths: list[PosePath]) -> int:
    return sum(len(path.chain.curves) for path in paths)


def test_ten_thousand_lines_of_a_circle_are_one_path_of_few_curves_whose_curvature_does_not_jump() -> None:
    turn = np.arange(1001) * 5e-4 / 0.05
    places = 0.05 * np.stack([np.sin(turn), 1.0 - np.cos(turn), 0.0 * turn], axis=1)
    (path,) = paths_of(CamLines(places, Rotation.identity(1001)))
    assert curves([path]) < 50
    assert len(path.move_ends_m) == 1000
    at = np.linspace(0.0, path.length_m, 20_001)
    bend = np.linalg.norm(path.chain.at(at)[2], axis=1)
    assert np.abs(np.diff(bend)).max() < 0.2
    assert bend[1000:-1000] == pytest.approx(20.0, rel=0.05)


def test_noise_of_a_micrometre_does_not_become_curves_of_its_own() -> None:
    noise = 1e-6 * np.random.default_rng(3).standard_normal((1001, 3))
    places = np.arange(1001)[:, None] * [1e-4, 0.0, 0.0] + noise
    assert curves(paths_of(CamLines(places, Rotation.identity(1001)))) < 50


def test_corners_of_a_square_stay_whether_its_sides_are_long_or_short_lines() -> None:
    corners = np.array([[0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0], [0, 0, 0]], dtype=float)
    for parts in (1, 7, 100):
        share = np.arange(4 * parts + 1) / parts
        places = np.stack([np.interp(share, np.arange(5.0), each) for each in corners.T], axis=1)
        paths = paths_of(CamLines(1e-3 * places, Rotation.identity(len(places))))
        ends = np.array([path.poses(np.array([path.length_m]))[0, :3, 3] for path in paths])
        assert ends == pytest.approx(1e-3 * corners[1:], abs=1e-12)


@pytest.mark.parametrize("deg", [5.0, 20.0, 29.0])
def test_a_vertex_that_turns_little_is_passed_and_one_that_turns_more_is_a_corner(deg: float) -> None:
    for turn, paths in ((deg, 1), (61.0 - deg, 2)):
        x, y = 10.0 + 10.0 * np.cos(np.radians(turn)), 10.0 * np.sin(np.radians(turn))
        assert len(paths_of(of_places((0, 0, 0), (10, 0, 0), (x, y, 0)))) == paths


@pytest.mark.parametrize("deg", [1.0, 10.0, 29.0])
@pytest.mark.parametrize("short_mm", [0.2, 2.0])
def test_a_long_line_between_short_ones_needs_no_corners_to_be_passed_within_the_tolerance(
    deg: float, short_mm: float
) -> None:
    turns = np.radians(deg) * np.repeat([0.0, 1.0, 2.0], [20, 1, 20])
    steps = np.where(np.arange(41) == 20, 300.0, short_mm)
    places = np.concatenate([[0.0], np.cumsum(steps * np.exp(1j * turns))])
    lines = CamLines(1e-3 * np.stack([places.real, places.imag, 0.0 * places.real], axis=1), Rotation.identity(42))
    paths = paths_of(lines)
    assert len(paths) == 1
    assert away(lines, paths, TOLERANCE) <= 1.006


def test_a_bend_of_many_short_lines_has_no_corner_however_far_it_turns() -> None:
    turn = np.arange(64) * np.radians(15.0)
    places = 3e-4 * np.stack([np.sin(turn), 1.0 - np.cos(turn), 0.0 * turn], axis=1)
    assert len(paths_of(CamLines(places, Rotation.identity(64)))) == 1


def test_a_line_that_goes_back_the_way_it_came_ends_exactly_where_it_turns() -> None:
    there, back = paths_of(of_places((0, 0, 0), (3, 0, 0), (6, 0, 0), (3, 0, 0), (0, 0, 0)))
    assert there.poses(np.array([there.length_m]))[0, :3, 3] == pytest.approx([0.006, 0.0, 0.0], abs=1e-12)
    assert back.length_m == pytest.approx(0.006)


def test_a_turn_on_the_spot_between_short_lines_is_made_on_the_spot() -> None:
    places = np.array([[0.0, 0, 0], [0.001, 0, 0], [0.001, 0, 0], [0.002, 0, 0]])
    turned = Rotation.from_rotvec(np.outer(np.radians([0.0, 0.0, 40.0, 40.0]), [0.0, 0.0, 1.0]))
    lines = CamLines(places, turned)
    before, spot, behind = paths_of(lines)
    assert (before.moves, spot.moves, behind.moves) == ((0,), (1,), (2,))
    assert spot.length_m == pytest.approx(np.radians(40.0))


def test_one_short_line_is_passed_as_it_is_and_those_without_any_way_are_none() -> None:
    assert paths_of(of_places((0, 0, 0), (5e-5, 0, 0))) == []
    assert len(paths_of(of_places((0, 0, 0), (2e-3, 0, 0)))) == 1
    (path,) = paths_of(of_places((0, 0, 0), (0, 0, 0), (1, 0, 0), (1, 0, 0)))
    assert path.length_m == pytest.approx(0.001)
    assert path.moves == (0, 1, 2)


@pytest.mark.parametrize("number", [15, 246, 477])
def test_lines_much_shorter_than_the_tolerance_are_one_way_without_gaps(number: int) -> None:
    lines = cam_lines("corners", np.random.default_rng([number, 18]))
    paths = paths_of(lines, Tolerance(1e-3, np.radians(0.5)))
    assert len(paths) > 1
    for before, after in pairwise(paths):
        end, begin = before.poses(np.array([before.length_m]))[0], after.poses(np.zeros(1))[0]
        np.testing.assert_allclose(begin, end, atol=1e-9)


@pytest.mark.parametrize("cut", [20, 50, 77])
def test_a_path_that_ends_before_the_lines_do_goes_on_in_place_direction_and_curvature(cut: int) -> None:
    turn = np.arange(121) * 0.05
    places = 0.01 * np.stack([np.sin(turn), 1.0 - np.cos(turn), 0.3 * turn**2], axis=1)
    lines = CamLines(places, Rotation.from_rotvec(np.outer(turn, [0.01, 0.0, 0.03])))
    moves = lines.lines(TOLERANCE)
    start = lines.poses[0]
    first = smoothed(list(enumerate(moves[:cut])), start, start, None, moves[cut:], 1e-4)[-1]
    end = np.array([first.length_m])
    _, tangent, curvature = first.chain.at(end)[:, 0]
    _, spin, change = (each[0] for each in first.orientation.states(end))
    entry = Entry(tangent, curvature, spin, change)
    pose = first.poses(end)[0]
    onward = smoothed(list(enumerate(moves[cut:])), lines.poses[cut], pose, entry, [], 1e-4)
    assert len(onward) == 1
    states = [
        np.concatenate([*path.chain.at(at)[:, 0], *(each[0] for each in path.orientation.states(at)[1:])])
        for path, at in ((first, end), (onward[0], np.zeros(1)))
    ]
    assert states[1] == pytest.approx(states[0], abs=1e-6, rel=1e-6)
    assert away(lines, [first, *onward], TOLERANCE) <= 1.006
    assert np.linalg.norm(onward[0].chain.at(np.linspace(0.0, onward[0].length_m, 999))[2], axis=1).max() < 150.0


def test_arcs_and_lines_between_them_are_one_path_within_the_tolerance() -> None:
    start = np.eye(4)

    def at(x: float, y: float) -> np.ndarray:
        pose = np.eye(4)
        pose[:2, 3] = x, y
        return pose

    moves = [
        Line(at(0.01, 0.0), 0.1, 1, tolerance=TOLERANCE),
        Arc(at(0.01 + 0.005 * np.sin(0.5), 0.005 * (1 - np.cos(0.5))), at(0.015, 0.005), 2, tolerance=TOLERANCE),
        Line(at(0.015, 0.01), 0.1, 3, tolerance=TOLERANCE),
    ]
    (path,) = smoothed(list(enumerate(moves)), start, start, None, [], 1e-4)
    x, y, _ = path.chain.at(np.linspace(0.0, path.length_m, 5000))[0].T
    inside = (x > 0.01) & (y < 0.005)
    assert np.abs(np.hypot(x - 0.01, y - 0.005)[inside] - 0.005).max() < TOLERANCE.distance_m
    assert path.move_ends_m == pytest.approx([0.01, 0.01 + 0.0025 * np.pi, 0.015 + 0.0025 * np.pi], abs=1e-4)


def test_the_turn_along_a_fitted_curve_and_its_change_are_its_derivatives() -> None:
    (path,) = paths_of(cam_lines("turning", np.random.default_rng(4)))
    at, step = np.linspace(0.1, 0.9, 50) * path.length_m, 1e-7
    rotation, spin, change = path.orientation.states(at)
    behind, ahead = (path.orientation.states(at + each) for each in (-step, step))
    turned = (Rotation.from_matrix(ahead[0]) * Rotation.from_matrix(behind[0]).inv()).as_rotvec() / (2.0 * step)
    assert turned == pytest.approx(spin, abs=1e-4 * np.abs(spin).max())
    assert (ahead[1] - behind[1]) / (2.0 * step) == pytest.approx(change, abs=1e-3 * np.abs(change).max())
    assert path.orientation.at(at) == pytest.approx(rotation, abs=1e-14)
