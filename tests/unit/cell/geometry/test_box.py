from fractions import Fraction
from itertools import pairwise

import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.geometry import Box, GeometryError, NotAPose, capsule_box_distance, capsules_touch, point_box_distance

RNG = np.random.default_rng(5)


def random_box() -> Box:
    q = RNG.normal(size=4)
    size, position = RNG.uniform(0.1, 1.0, 3), RNG.uniform(-1, 1, 3)
    return Box.at(tuple(size), tuple(position), tuple(q / np.linalg.norm(q)))


def coal_distance(ends: np.ndarray, radius: float, box: Box) -> float:
    along = ends[1] - ends[0]
    length = float(np.linalg.norm(along))
    z = along / length
    x = np.cross(z, [1.0, 0, 0] if abs(z[0]) < 0.9 else [0, 1.0, 0])
    x /= np.linalg.norm(x)
    rotation = np.column_stack([x, np.cross(z, x), z])
    pose = box.pose_world_box
    return float(
        coal.distance(
            coal.Capsule(radius, length),
            coal.Transform3s(rotation, ends.mean(axis=0)),
            coal.Box(*box.size),
            coal.Transform3s(pose[:3, :3], pose[:3, 3]),
            coal.DistanceRequest(),
            coal.DistanceResult(),
        )
    )


def test_distance_of_separate_capsules_agrees_with_coal() -> None:
    compared = 0
    for _ in range(40):
        box = random_box()
        ends, radii = RNG.uniform(-2, 2, (10, 2, 3)), RNG.uniform(0.01, 0.2, 10)
        for distance, pair, radius in zip(capsule_box_distance(ends, radii, box), ends, radii, strict=True):
            oracle = coal_distance(pair, radius, box)
            if distance > 1e-3:
                assert distance == pytest.approx(oracle, abs=1e-6)
                compared += 1
            elif distance < -1e-3:
                assert oracle <= 0
    assert compared > 200


def test_distance_is_the_least_over_a_finely_sampled_axis() -> None:
    shares = np.linspace(0, 1, 4001)[:, None]
    for _ in range(20):
        box = random_box()
        ends = RNG.uniform(-1.5, 1.5, (2, 3))
        sampled = point_box_distance(ends[0] + shares * (ends[1] - ends[0]), box).min()
        exact = float(capsule_box_distance(ends, np.array(0.0), box))
        assert exact <= sampled + 1e-15
        assert sampled - exact < np.linalg.norm(ends[1] - ends[0]) / 8000


UNIT = Box.at((2.0, 2.0, 2.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("ends", "distance"),
    [
        ([(2, 0, 0), (3, 0, 0)], 1.0),  # end on
        ([(2, -5, 0), (2, 5, 0)], 1.0),  # parallel to a face
        ([(2, 2, -5), (2, 2, 5)], np.sqrt(2)),  # parallel to an edge
        ([(2, 2, 2), (3, 3, 3)], np.sqrt(3)),  # corner
        ([(0, 3, 3), (0, 0, 3)], 2.0),  # towards a face
        ([(3, 0, 0), (0, 3, 0)], np.sqrt(2) / 2),  # across an edge
        ([(-5, 0, 0), (5, 0, 0)], 0.0),  # straight through
        ([(0.1, 0.2, 0.3), (0.2, 0.2, 0.3)], 0.0),  # inside
        ([(4, 0, 0), (4, 0, 0)], 3.0),  # a sphere
        ([(1, 1, 1), (2, 2, 2)], 0.0),  # touches a corner
    ],
)
def test_distance_of_known_segments(ends: list[tuple[float, ...]], distance: float) -> None:
    found = capsule_box_distance(np.array(ends, dtype=float), np.array(0.25), UNIT)
    assert found == pytest.approx(distance - 0.25, abs=1e-15)


def exact_square(start: list[Fraction], end: list[Fraction]) -> Fraction:
    """The least squared distance of a segment from `UNIT`, without rounding: at a break of it, or between two."""
    way = [b - a for a, b in zip(start, end, strict=True)]
    breaks = {(side - a) / w for a, w in zip(start, way, strict=True) if w for side in (1, -1)}
    shares = sorted({Fraction(0), Fraction(1), *(each for each in breaks if 0 < each < 1)})

    def square(share: Fraction) -> Fraction:
        at = [a + share * w for a, w in zip(start, way, strict=True)]
        return sum((max(abs(x) - 1, Fraction(0)) ** 2 for x in at), Fraction(0))

    found = [square(share) for share in shares]
    for low, high in pairwise(shares):
        middle = [a + (low + high) / 2 * w for a, w in zip(start, way, strict=True)]
        beside = [(a - (1 if x > 0 else -1), w) for a, x, w in zip(start, middle, way, strict=True) if abs(x) > 1]
        if whole := sum(w * w for _, w in beside):
            found.append(square(min(max(-sum(a * w for a, w in beside) / whole, low), high)))
    return min(found)


@pytest.mark.parametrize("kind", ["plain", "round", "past an edge", "past a corner", "nearly along a face"])
def test_the_distance_is_exact_to_rounding(kind: str) -> None:
    count, rng = 200, np.random.default_rng(7)
    ends = rng.integers(-4, 5, (count, 2, 3)) / 2.0 if kind == "round" else rng.uniform(-3, 3, (count, 2, 3))
    if kind.startswith("past"):
        way, at = rng.normal(size=(count, 3)), np.ones((count, 3))
        at[:, 2] = rng.uniform(-1, 1, count) if kind == "past an edge" else 1.0
        way[:, 1] = -np.sign(way[:, 0]) * abs(way[:, 1])
        ends = at[:, None] + way[:, None] * rng.uniform(0, 1, (count, 2, 1)) * [[[-1], [1]]]
    if kind == "nearly along a face":
        ends[:, 1, 1:] = ends[:, 0, 1:] + 10.0 ** rng.uniform(-17, -6, (count, 1)) * rng.normal(size=(count, 2))
    exact = [float(exact_square(*([Fraction(x) for x in end] for end in pair))) ** 0.5 for pair in ends.tolist()]
    np.testing.assert_allclose(capsule_box_distance(ends, np.array(0.0), UNIT), exact, atol=1e-12, rtol=0)


def crossed_by_the_ends_alone(start: np.ndarray, end: np.ndarray) -> bool:
    """A form that is often printed: a way crosses a box if the places where it meets the near and the far sides, the
    near ones being those closer to its start, lie inside it in this order; one of them between its ends."""
    way = end - start
    moving = way != 0
    sides = np.stack([(-1 - start[moving]) / way[moving], (1 - start[moving]) / way[moving]])
    closer = np.argmin(np.abs(np.stack([-1 - start[moving], 1 - start[moving]])), axis=0)
    near = sides[closer, np.arange(sides.shape[1])].max()
    far = sides[1 - closer, np.arange(sides.shape[1])].min()
    return bool((np.abs(start[~moving]) <= 1).all() and near <= far and (0 <= near <= 1 or 0 <= far <= 1))


@pytest.mark.parametrize(
    ("start", "end", "hit", "by_the_ends"),
    [
        ((-0.5, 0, 0), (0.5, 0, 0), True, False),  # wholly inside
        ((-0.5, 0, 0), (-3, 0.1, 0), True, False),  # from the inside
        ((-0.5, -1.5, 0), (-3, 3.5, 0), True, False),  # begins outside, between two sides
        ((-3, 0, 0), (3, 0, 0), True, True),
        ((-3, 2, 0), (3, 2, 0), False, False),
        ((-3, 0, 0), (-2, 0, 0), False, False),  # its line would
        ((-3, 1, 0), (3, 1, 0), True, True),  # along a side
    ],
)
def test_a_way_that_crosses_the_box_is_found_wherever_it_begins(
    start: tuple[float, ...], end: tuple[float, ...], hit: bool, by_the_ends: bool
) -> None:
    way = np.array([start, end], dtype=float)
    assert bool(capsules_touch(way, np.array(0.0), UNIT)) == hit
    assert (capsule_box_distance(way, np.array(0.0), UNIT) <= 0) == hit
    assert crossed_by_the_ends_alone(*way) == by_the_ends


coordinate = st.one_of(st.sampled_from([-1.0, 0.0, 1.0, 1 + 1e-12]), st.floats(-3, 3))


@given(ends=st.lists(coordinate, min_size=6, max_size=6))
def test_distance_never_depends_on_the_order_of_the_ends(ends: list[float]) -> None:
    pair = np.array(ends).reshape(2, 3)
    there, back = (float(capsule_box_distance(p, np.array(0.0), UNIT)) for p in (pair, pair[::-1]))
    assert there == pytest.approx(back, abs=1e-9)
    assert there <= point_box_distance(pair, UNIT).min() + 1e-12


@pytest.mark.parametrize("size", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.inf)])
def test_a_box_without_volume_is_refused(size: tuple[float, ...]) -> None:
    with pytest.raises(GeometryError, match="above zero"):
        Box(np.array(size), np.eye(4))


def test_a_box_with_a_mirrored_frame_is_refused() -> None:
    with pytest.raises(NotAPose, match="left-handed"):
        Box(np.ones(3), np.diag([1.0, 1.0, -1.0, 1.0]))
