import fcl
import numpy as np
import pytest

from cell.geometry import WrongShape, segment_distance

RNG = np.random.default_rng(2)


def by_fcl(first: np.ndarray, second: np.ndarray, radius: float) -> float:
    """Distance of two capsules around the segments, from python-fcl."""

    def capsule(segment: np.ndarray) -> fcl.CollisionObject:
        way = segment[1] - segment[0]
        length = float(np.linalg.norm(way))
        z = way / length
        x = np.cross(np.eye(3)[int(np.argmin(abs(z)))], z)
        x /= np.linalg.norm(x)
        pose = fcl.Transform(np.stack([x, np.cross(z, x), z], axis=-1), segment.mean(axis=0))
        return fcl.CollisionObject(fcl.Capsule(radius, length), pose)

    request, result = fcl.DistanceRequest(), fcl.DistanceResult()
    return float(fcl.distance(capsule(first), capsule(second), request, result))


def test_the_distance_is_fcls() -> None:
    first, second = RNG.uniform(-1, 1, (2, 300, 2, 3))
    found = segment_distance(first, second)
    for a, b, distance in zip(first, second, found, strict=True):
        if distance > 0.05:
            assert distance - 0.02 == pytest.approx(by_fcl(a, b, 0.01), abs=1e-4)


def test_no_pair_of_points_is_nearer_and_some_pair_is_as_near() -> None:
    first, second = RNG.uniform(-1, 1, (2, 500, 2, 3))
    share = np.linspace(0, 1, 41)[:, None]
    a = first[:, None, 0] + share * (first[:, None, 1] - first[:, None, 0])
    b = second[:, None, 0] + share * (second[:, None, 1] - second[:, None, 0])
    sampled = np.linalg.norm(a[:, :, None] - b[:, None], axis=-1).min(axis=(1, 2))
    found = segment_distance(first, second)
    assert (found <= sampled + 1e-12).all()
    assert (found >= sampled - 0.09).all()


@pytest.mark.parametrize(
    ("first", "second", "distance"),
    [
        ([[0, 0, 0], [1, 0, 0]], [[0.5, -1, 0.3], [0.5, 1, 0.3]], 0.3),
        ([[0, 0, 0], [1, 0, 0]], [[2, 0, 0], [3, 0, 0]], 1.0),
        ([[0, 0, 0], [1, 0, 0]], [[0.2, 0.4, 0], [0.8, 0.4, 0]], 0.4),
        ([[0, 0, 0], [1, 0, 0]], [[0.5, -1, 0], [0.5, 1, 0]], 0.0),
        ([[0, 0, 0], [0, 0, 0]], [[3, 4, 0], [3, 4, 0]], 5.0),
        ([[0, 0, 0], [1, 0, 0]], [[1.3, 0.4, 0], [2, 3, 0]], 0.5),
    ],
)
def test_crossing_collinear_parallel_touching_and_point_segments(first: list, second: list, distance: float) -> None:
    assert segment_distance(np.array(first), np.array(second)) == pytest.approx(distance, abs=1e-15)
    assert segment_distance(np.array(second), np.array(first)) == pytest.approx(distance, abs=1e-15)


def test_all_pairs_come_from_broadcasting() -> None:
    first, second = RNG.uniform(-1, 1, (5, 2, 3)), RNG.uniform(-1, 1, (4, 2, 3))
    assert segment_distance(first[:, None], second).shape == (5, 4)
    with pytest.raises(WrongShape, match="second segments"):
        segment_distance(first, np.zeros(3))
