"""Distances of segments and capsules against the whole of what can be nearest, and against python-fcl."""

from fractions import Fraction
from itertools import product

import fcl
import numpy as np
import pytest

from cell.geometry import WrongShape, capsule_distance, segment_distance
from tests.unit.cell.geometry.exact_segments import by_all_that_can_be_nearest

EXACT_M = 1e-12


def in_fractions(first: list[list[Fraction]], second: list[list[Fraction]]) -> Fraction:
    """The same squared, without any rounding."""

    def dot(a: list[Fraction], b: list[Fraction]) -> Fraction:
        return sum((x * y for x, y in zip(a, b, strict=True)), Fraction(0))

    def less(a: list[Fraction], b: list[Fraction], share: Fraction = Fraction(1)) -> list[Fraction]:
        return [x - share * y for x, y in zip(a, b, strict=True)]

    def from_point(point: list[Fraction], segment: list[list[Fraction]]) -> Fraction:
        way, to = less(segment[1], segment[0]), less(point, segment[0])
        whole = dot(way, way)
        share = min(max(dot(to, way) / whole, Fraction(0)), Fraction(1)) if whole else Fraction(0)
        away = less(to, way, share)
        return dot(away, away)

    found = [from_point(p, s) for ends, s in ((first, second), (second, first)) for p in ends]
    u, v, w = less(first[1], first[0]), less(second[1], second[0]), less(first[0], second[0])
    determinant = dot(u, u) * dot(v, v) - dot(u, v) ** 2
    if determinant:
        s = (dot(u, v) * dot(v, w) - dot(v, v) * dot(u, w)) / determinant
        t = (dot(u, u) * dot(v, w) - dot(u, v) * dot(u, w)) / determinant
        if 0 <= s <= 1 and 0 <= t <= 1:
            away = less(less(w, u, -s), v, t)
            found.append(dot(away, away))
    return min(found)


def pairs(kind: str, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Segments `(count, 2, 3)` twice."""
    first, second = rng.uniform(-1, 1, (2, count, 2, 3))
    way, length = first[:, 1] - first[:, 0], rng.uniform(-2, 2, (count, 1))
    match kind:
        case "round":
            first, second = rng.integers(-2, 3, (2, count, 2, 3)) / 2.0
        case "parallel":
            second[:, 1] = second[:, 0] + length * way
        case "collinear":
            second[:, 0] = first[:, 0] + rng.uniform(-3, 3, (count, 1)) * way
            second[:, 1] = second[:, 0] + length * way
        case "nearly parallel":
            turned = 10.0 ** rng.uniform(-16, -3, (count, 1)) * rng.normal(size=(count, 3))
            second[:, 0] = first[:, 0] + rng.uniform(-1, 1, (count, 1)) * way + turned
            second[:, 1] = second[:, 0] + length * way + 10.0 ** rng.uniform(-16, -3, (count, 1)) * turned
        case "points":
            first[::2, 1] = first[::2, 0]
            second[::3, 1] = second[::3, 0]
        case "tiny":
            first[:, 1] = first[:, 0] + way * 10.0 ** rng.uniform(-15, -6, (count, 1))
        case "touching":
            second[:, 0] = first[:, 0] + rng.uniform(0, 1, (count, 1)) * way
        case "crossing":
            second[:, 1] = 2.0 * (first[:, 0] + rng.uniform(0, 1, (count, 1)) * way) - second[:, 0]
    return first, second


KINDS = ("plain", "round", "parallel", "collinear", "nearly parallel", "points", "tiny", "touching", "crossing")


@pytest.mark.parametrize("kind", KINDS)
def test_a_hundred_thousand_distances_are_the_least_there_are(kind: str) -> None:
    first, second = pairs(kind, 12_000, np.random.default_rng(3))
    exact = by_all_that_can_be_nearest(first, second)
    for a, b in ((first, second), (second, first), (first[:, ::-1], second)):
        assert np.abs(segment_distance(a, b) - exact).max() < EXACT_M


@pytest.mark.parametrize("kind", KINDS)
def test_a_few_of_them_agree_with_fractions(kind: str) -> None:
    first, second = pairs(kind, 60, np.random.default_rng(4))
    for a, b, found in zip(first, second, segment_distance(first, second).tolist(), strict=True):
        one, other = ([[Fraction(x) for x in point] for point in each.tolist()] for each in (a, b))
        assert found == pytest.approx(float(in_fractions(one, other)) ** 0.5, abs=EXACT_M)


def test_every_pair_of_round_segments_in_a_small_grid_has_its_exact_distance() -> None:
    grid = [np.array(point, dtype=float) for point in product((0, 1, 2), repeat=2)]
    segments = np.array([[[*a, 0.0], [*b, 0.0]] for a in grid for b in grid])
    found = segment_distance(segments[:, None], segments)
    shape = found.shape
    first, second = (np.broadcast_to(each, (*shape, 2, 3)).reshape(-1, 2, 3) for each in (segments[:, None], segments))
    assert np.abs(found.reshape(-1) - by_all_that_can_be_nearest(first, second)).max() < 1e-15


def fcl_capsule(segment: np.ndarray, radius: float) -> fcl.CollisionObject:
    way = segment[1] - segment[0]
    length = float(np.linalg.norm(way))
    z = way / length
    x = np.cross(np.eye(3)[int(np.argmin(abs(z)))], z)
    x /= np.linalg.norm(x)
    pose = fcl.Transform(np.stack([x, np.cross(z, x), z], axis=-1), segment.mean(axis=0))
    return fcl.CollisionObject(fcl.Capsule(radius, length), pose)


@pytest.mark.parametrize("count", [1500, pytest.param(21_000, marks=pytest.mark.soak)])
@pytest.mark.parametrize("kind", ["plain", "round", "parallel", "nearly parallel", "crossing"])
def test_capsules_are_as_far_apart_as_fcl_says_with_the_sign_that_it_says(kind: str, count: int) -> None:
    rng = np.random.default_rng(5)
    first, second = pairs(kind, count, rng)
    long = (np.linalg.norm(first[:, 1] - first[:, 0], axis=-1) > 0) & (
        np.linalg.norm(second[:, 1] - second[:, 0], axis=-1) > 0
    )
    first, second = first[long], second[long]
    radii = rng.uniform(0.01, 0.3, (2, len(first)))
    found = capsule_distance(first, radii[0], second, radii[1])
    for a, b, r, s, distance in zip(first, second, *radii, found.tolist(), strict=True):
        request, result = fcl.DistanceRequest(), fcl.DistanceResult()
        expected = float(fcl.distance(fcl_capsule(a, r), fcl_capsule(b, s), request, result))
        if distance > EXACT_M:
            assert distance == pytest.approx(expected, rel=0.0, abs=EXACT_M)
        elif distance < -EXACT_M:
            assert expected <= 0


def closest_line_places(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    u, v, w = first[1] - first[0], second[1] - second[0], first[0] - second[0]
    determinant = u @ u * (v @ v) - (u @ v) ** 2
    if determinant == 0.0:
        return np.float64(0.0), np.float64((v @ w) / (v @ v))
    return ((u @ v) * (v @ w) - (v @ v) * (u @ w)) / determinant, ((u @ u) * (v @ w) - (u @ v) * (u @ w)) / determinant


def places_brought_in_apart(first: np.ndarray, second: np.ndarray) -> float:
    """A form that is often printed: both places on the lines are brought into their segments, each by itself."""
    s, t = (np.clip(each, 0, 1) for each in closest_line_places(first, second))
    return float(np.linalg.norm(first[0] + s * (first[1] - first[0]) - second[0] - t * (second[1] - second[0])))


def test_bringing_both_places_in_apart_would_be_too_long_in_half_of_all_cases() -> None:
    first, second = pairs("plain", 2000, np.random.default_rng(6))
    naive = np.array([places_brought_in_apart(a, b) for a, b in zip(first, second, strict=True)])
    wrong = naive > segment_distance(first, second) + 1e-9
    assert 0.3 < wrong.mean() < 0.7


X_AXIS = [[0, 0, 0], [1000, 0, 0]]


@pytest.mark.parametrize(
    ("first", "second", "distance"),
    [
        (X_AXIS, [[500, -500, 300], [500, 500, 300]], 300.0),
        (X_AXIS, [[0, 400, 0], [1000, 400, 0]], 400.0),
        (X_AXIS, [[2000, 0, 0], [3000, 0, 0]], 1000.0),  # left at the start of the first: 2000
        (X_AXIS, [[1300, 400, 0], [1300, 1400, 0]], 500.0),
        (X_AXIS, [[1300, 400, 0], [2300, 1400, 500]], 500.0),
        (X_AXIS, [[400, 300, 0], [1400, 300, 0]], 300.0),
        (X_AXIS, [[1500, 300, 0], [400, 300, 0]], 300.0),
        (X_AXIS, [[500, 0, 0], [500, 0, 0]], 0.0),
        ([[0, 0, 0], [0, 0, 1000]], [[300, -500, 1200], [300, 500, 1200]], 360.5551275463989),
        ([[0, 0, 0], [1, 0, 0]], [[2, 1, 0], [2, -1, 1]], 1.0954451150103321),
        ([[0, 0, 0], [1, 0, 0]], [[0.5, -1, 0], [0.5, 1, 0]], 0.0),
        ([[0, 0, 0], [0, 0, 0]], [[3, 4, 0], [3, 4, 0]], 5.0),
    ],
)
def test_crossing_collinear_parallel_touching_and_point_segments(first: list, second: list, distance: float) -> None:
    assert segment_distance(np.array(first), np.array(second)) == pytest.approx(distance, rel=1e-15)
    assert segment_distance(np.array(second), np.array(first)) == pytest.approx(distance, rel=1e-15)


def test_segments_of_the_smallest_numbers_are_points() -> None:
    tiny = np.array([[0.0, 0.0, 0.0], [5e-324, 1e-200, 0.0]])
    assert segment_distance(tiny, tiny + np.array([3.0, 4.0, 0.0])) == pytest.approx(5.0, abs=1e-15)


def test_all_pairs_come_from_broadcasting() -> None:
    rng = np.random.default_rng(2)
    first, second = rng.uniform(-1, 1, (60, 2, 3)), rng.uniform(-1, 1, (50, 2, 3))
    found = segment_distance(first[:, None], second)
    assert found.shape == (60, 50)
    np.testing.assert_allclose(found[7], segment_distance(first[7], second), atol=1e-15)
    capsules = capsule_distance(first[:, None], np.full((60, 1), 0.1), second, np.full(50, 0.2))
    np.testing.assert_allclose(capsules, found - 0.3, atol=1e-15)
    with pytest.raises(WrongShape, match="second segments"):
        segment_distance(first, np.zeros(3))
