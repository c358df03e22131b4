import coal
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cell.geometry import Box, GeometryError, NotAPose, capsule_box_distance, capsules_touch_box, point_box_distance
from cell.geometry.box import any_capsule_touches_box

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


coordinate = st.one_of(st.sampled_from([-1.0, 0.0, 1.0, 1 + 1e-12]), st.floats(-3, 3))


@given(ends=st.lists(coordinate, min_size=6, max_size=6))
def test_distance_never_depends_on_the_order_of_the_ends(ends: list[float]) -> None:
    pair = np.array(ends).reshape(2, 3)
    there, back = (float(capsule_box_distance(p, np.array(0.0), UNIT)) for p in (pair, pair[::-1]))
    assert there == pytest.approx(back, abs=1e-9)
    assert there <= point_box_distance(pair, UNIT).min() + 1e-12


def test_touching_agrees_with_the_distance() -> None:
    box = random_box()
    ends = RNG.uniform(-1.5, 1.5, (40, 50, 2, 3))
    radii = RNG.uniform(0.01, 0.2, 50)
    expected = capsule_box_distance(ends, radii, box) <= 0
    assert expected.any()
    assert not expected.all()
    np.testing.assert_array_equal(capsules_touch_box(ends, radii, box), expected)
    few = [any_capsule_touches_box(one[:3], radii[:3], box) for one in ends]
    assert few == expected[:, :3].any(axis=1).tolist()
    assert {False, True} == set(few)


@pytest.mark.parametrize("size", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, np.inf)])
def test_a_box_without_volume_is_refused(size: tuple[float, ...]) -> None:
    with pytest.raises(GeometryError, match="above zero"):
        Box(np.array(size), np.eye(4))


def test_a_box_with_a_mirrored_frame_is_refused() -> None:
    with pytest.raises(NotAPose, match="left-handed"):
        Box(np.ones(3), np.diag([1.0, 1.0, -1.0, 1.0]))
