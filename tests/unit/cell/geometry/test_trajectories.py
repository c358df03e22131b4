"""The least distance of bodies along trajectories, against that of all capsules at all samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import Nearest, WrongShape, capsule_distance, nearest_capsules

Bodies = list[np.ndarray]


def trajectories(seed: int, samples: int, counts: list[int], apart_m: float, step_m: float) -> tuple[Bodies, Bodies]:
    """Bodies that wander, each about a place of its own."""
    rng = np.random.default_rng(seed)
    bodies, radii = [], []
    for number, count in enumerate(counts):
        start = rng.uniform(-0.5, 0.5, (count, 2, 3)) + np.array([apart_m * number, 0.0, 0.0])
        bodies.append(start + np.cumsum(rng.normal(0.0, step_m, (samples, 1, 2, 3)), axis=0))
        radii.append(rng.uniform(0.0, 0.1, count))
    return bodies, radii


def least_of_all(bodies: Bodies, radii: Bodies) -> float:
    least = np.inf
    for one in range(len(bodies)):
        for other in range(one + 1, len(bodies)):
            away = capsule_distance(bodies[one][:, :, None], radii[one][:, None], bodies[other][:, None], radii[other])
            least = min(least, float(away.min()))
    return least


def between(bodies: Bodies, radii: Bodies, at: Nearest) -> float:
    one, other = bodies[at.body][at.sample, at.capsule], bodies[at.other_body][at.sample, at.other_capsule]
    return float(capsule_distance(one, radii[at.body][at.capsule], other, radii[at.other_body][at.other_capsule]))


@given(
    seed=st.integers(0, 10_000),
    samples=st.integers(1, 90),
    counts=st.lists(st.integers(1, 5), min_size=2, max_size=4),
    apart_m=st.sampled_from([0.0, 0.3, 1.5, 5.0]),
    step_m=st.sampled_from([0.0, 0.005, 0.3]),
)
@settings(max_examples=150, deadline=None)
def test_it_is_the_least_of_all_distances_and_is_where_it_says(
    seed: int, samples: int, counts: list[int], apart_m: float, step_m: float
) -> None:
    bodies, radii = trajectories(seed, samples, counts, apart_m, step_m)
    least, found = least_of_all(bodies, radii), nearest_capsules(bodies, radii)
    assert found is not None
    assert found.distance_m == pytest.approx(least, abs=1e-12)
    assert between(bodies, radii, found) == pytest.approx(least, abs=1e-12)
    assert found.body < found.other_body
    assert nearest_capsules(bodies, radii, least - 1e-9) is None
    again = nearest_capsules(bodies, radii, least + 1e-9)
    assert again is not None
    assert again.distance_m == pytest.approx(least, abs=1e-12)


def test_bodies_that_only_touch_for_one_sample_are_found_among_many() -> None:
    away, passing = np.zeros((500, 1, 2, 3)), np.zeros((500, 1, 2, 3))
    away[..., 1, 2] = 1.0
    passing[..., 0] = np.abs(np.arange(500) - 333)[:, None, None] + 0.2
    passing[..., 2] = 0.5
    radii = [np.array([0.1]), np.array([0.1])]
    assert nearest_capsules([away, passing], radii, 0.0) == Nearest(0.0, 333, 0, 0, 1, 0)
    assert nearest_capsules([away, passing + 0.001 * np.eye(3)[0]], radii, 0.0) is None


def test_the_thickest_capsules_count_however_bodies_lie_in_memory() -> None:
    left, right = np.zeros((50, 2, 2, 3)), np.zeros((50, 2, 2, 3))
    left[..., 1, 2] = right[..., 1, 2] = right[..., 0] = 1.0
    radii = [np.array([0.1, 0.3]), np.array([0.2, 0.1])]
    by_columns = np.asfortranarray(left), np.asfortranarray(right)
    for bodies in ([left, right], [by_columns[0], right], [*by_columns]):
        found = nearest_capsules(bodies, radii, 0.5 + 1e-9)
        assert found is not None
        assert found.distance_m == pytest.approx(0.5, abs=1e-12)
        assert (found.capsule, found.other_capsule) == (1, 0)
        assert nearest_capsules(bodies, radii, 0.5 - 1e-8) is None


def test_what_is_no_body_is_refused() -> None:
    body, radii = np.zeros((4, 3, 2, 3)), np.zeros(3)
    for bodies, mine, found in (
        ([body], [radii], "bodies"),
        ([body, body], [radii], "bodies"),
        ([body, body[:3]], [radii, radii], r"\(3, 3, 2, 3\)"),
        ([body, body], [radii, radii[:2]], r"\(4, 2, 2, 3\)"),
        ([body[:0], body[:0]], [radii, radii], "neither number 0"),
    ):
        with pytest.raises(WrongShape, match=found):
            nearest_capsules(bodies, mine)
