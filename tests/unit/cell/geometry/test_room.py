"""How far inside a union of convex bodies a capsule is, against points all over the border of the union."""

from itertools import product

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cell.geometry import Box, Convex, GeometryError, Hull, Room, pose_from
from tests.unit.cell.geometry.convex_height import height

RNG = np.random.default_rng(5)
SHARES = np.linspace(0.0, 1.0, 41)
STEP_M = 0.04


def box(low: tuple[float, float, float], high: tuple[float, float, float], turn: float = 0.0) -> Convex:
    size, middle = np.array(high) - low, (np.array(high) + low) / 2.0
    return Convex.of_box(Box(size, pose_from(middle, np.array([0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2)]))))


TENT = Convex.of_points(np.array([[0, 0, 1], [1, 0, 1], [0, 1, 1], [1, 1, 1], [0.5, 0.5, 1.6], [0.5, 0.5, 1.0]], float))
UNIONS = {
    "one": (box((0, 0, 0), (1, 1, 1)),),
    "abutting": (box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 1))),
    "a step": (box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 0.5))),
    "overlapping": (box((0, 0, 0), (1, 1, 1)), box((0.5, 0.3, 0.2), (1.7, 1.2, 1.3), 0.4)),
    "four around an edge": tuple(box((x, y, 0), (x + 1, y + 1, 1)) for x, y in product((0, 1), (0, 1))),
    "one in another": (box((0, 0, 0), (1, 1, 1)), box((0.2, 0.2, 0.2), (0.8, 0.8, 0.8))),
    "a tent on a box": (box((0, 0, 0), (1, 1, 1)), TENT),
    "apart": (box((0, 0, 0), (1, 1, 1)), box((1.01, 0, 0), (2, 1, 1))),
    "twice": (box((0, 0, 0), (1, 1, 1)), box((0, 0, 0), (1, 1, 1))),
}  # fmt: skip


def border(parts: tuple[Convex, ...]) -> np.ndarray:
    """Points on faces just outside of which nothing is covered."""
    found = []
    for part in parts:
        for face, normal in zip(part.faces, part.normals, strict=True):
            along, up = face[1] - face[0], np.cross(normal, face[1] - face[0])
            x, y = along / np.linalg.norm(along), up / np.linalg.norm(up)
            flat = np.stack([(face - face[0]) @ x, (face - face[0]) @ y], axis=-1)
            low, high = flat.min(axis=0), flat.max(axis=0)
            u, v = (np.append(np.arange(a, b, STEP_M), b) for a, b in zip(low, high, strict=True))
            grid = face[0] + u[:, None, None] * x + v[:, None] * y
            points = grid.reshape(-1, 3)
            points = points[height(part, points) < 1e-9]
            outer = points + 1e-5 * normal
            found.append(points[np.min([height(other, outer) for other in parts], axis=0) > 0.0])
    return np.concatenate(found)


BORDERS = {name: border(parts) for name, parts in UNIONS.items()}
ROUND = st.sampled_from([0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0, 1.25, 1.5, 1.75, 2.0])
NUMBER = ROUND | st.floats(-0.2, 2.2)
AXIS = st.tuples(*[NUMBER] * 6).map(lambda numbers: np.array(numbers).reshape(2, 3) * [1.0, 1.0, 0.6])


@example(name="a step", ends=np.array([[0.0, -1.2e-7, 0.0], [0.0, 0.0, 1.05]]))
@given(name=st.sampled_from(sorted(UNIONS)), ends=AXIS)
@settings(max_examples=60, deadline=None)
def test_the_clearance_in_a_union_is_that_of_its_border(name: str, ends: np.ndarray) -> None:
    parts = UNIONS[name]
    exact = float(Room(parts, (0.0,) * len(parts)).capsule_distance(ends, np.array(0.0)))
    along = ends[0] + SHARES[:, None] * (ends[1] - ends[0])
    out = np.min([height(part, along) for part in parts], axis=0)
    sampled = float(np.linalg.norm(along[:, None] - BORDERS[name], axis=-1).min())
    slack = STEP_M + np.linalg.norm(ends[1] - ends[0]) / (len(SHARES) - 1)
    if out.max() > 1e-5:
        assert exact <= 0.0
    elif exact > 0.0:
        assert exact <= sampled + 1e-5
        assert exact >= sampled - slack
    else:
        assert sampled <= slack


def test_a_body_across_the_seam_of_two_boxes_is_inside() -> None:
    across = np.array([[0.3, 0.5, 0.5], [1.7, 0.5, 0.5]])
    room = Room(UNIONS["abutting"], (0.0, 0.0))
    assert float(room.capsule_distance(across, np.array(0.2))) == pytest.approx(0.1)
    assert float(Room(UNIONS["a step"], (0.0, 0.0)).capsule_distance(across, np.array(0.2))) == pytest.approx(-0.2)
    for part in UNIONS["abutting"]:
        assert float(Room((part,), (0.0,)).capsule_distance(across, np.array(0.2))) < -0.2


def test_a_gap_that_is_no_crack_is_no_way() -> None:
    across = np.array([[0.3, 0.5, 0.5], [1.7, 0.5, 0.5]])
    assert float(Room(UNIONS["apart"], (0.0, 0.0)).capsule_distance(across, np.array(0.1))) <= -0.1


def test_rounding_opens_no_crack() -> None:
    parts = box((0, 0, 0), (0.1 + 0.2, 1, 1)), box((0.3, 0, 0), (1, 1, 1))
    across = np.array([[0.2, 0.5, 0.5], [0.7, 0.5, 0.5]])
    assert float(Room(parts, (0.0, 0.0)).capsule_distance(across, np.array(0.0))) == pytest.approx(0.2, abs=2e-6)


def test_who_is_farther_out_is_told_so() -> None:
    for name in ("one", "abutting"):
        room = Room(UNIONS[name], (0.0,) * len(UNIONS[name]))
        ways = np.array([[[0.5, 0.5, 0.5], [0.5, 0.5, 1.0 + out]] for out in (0.0, 0.1, 0.2, 0.4)])
        np.testing.assert_allclose(room.capsule_distance(ways, np.array(0.05)), [-0.05, -0.15, -0.25, -0.45], atol=1e-9)


def test_the_border_of_each_part_has_its_own_margin() -> None:
    room = Room(UNIONS["abutting"], (0.0, 0.1))
    ends = np.array([[[0.2, 0.5, 0.5]] * 2, [[1.8, 0.5, 0.5]] * 2, [[1.0, 0.5, 0.5]] * 2])
    np.testing.assert_allclose(room.capsule_distance(ends, np.array(0.0)), [0.2, 0.1, 0.4], atol=1e-9)


_CORNERS = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@given(ends=st.tuples(*[st.floats(-2.0, 2.0) | st.sampled_from([-1.0, 0.0, 0.5, 1.0])] * 6))
@settings(max_examples=60, deadline=None)
def test_a_hull_in_the_form_of_a_box_is_that_box(ends: tuple[float, ...]) -> None:
    same = Box(np.array([1.0, 0.6, 1.4]), pose_from(np.array([0.1, 0.0, 0.2]), np.array([0.0, 0.0, 0.6, 0.8])))
    axis = np.array(ends).reshape(1, 2, 3)
    hull, exact = (
        each.capsule_distance(axis, np.array(0.1))[0]
        for each in (Hull(_CORNERS * same.size, same.pose_world_box), same)
    )
    if max(hull, exact) > -0.1 + 1e-9:
        assert hull == pytest.approx(exact, abs=1e-9)


def test_a_hull_of_random_points_holds_them_and_no_more() -> None:
    for _ in range(20):
        points = RNG.normal(size=(RNG.integers(4, 20), 3))
        hull = Convex.of_points(points)
        assert height(hull, points).max() < 1e-6
        corners = {tuple(corner) for face in hull.faces for corner in face}
        assert corners <= {tuple(point) for point in points}
        edges = sum(len(face) for face in hull.faces) / 2
        assert len(corners) - edges + len(hull.faces) == 2  # Euler: the faces close


@pytest.mark.parametrize("points", [np.zeros((3, 3)), np.eye(3)[[0, 1, 2, 0]], np.ones((5, 3)), np.zeros((40, 3))])
def test_points_without_a_hull_are_refused(points: np.ndarray) -> None:
    with pytest.raises(GeometryError, match="hull: found"):
        Convex.of_points(points)


@pytest.mark.parametrize("seed", range(12))
def test_what_is_inside_a_random_union_is_told_to_a_millimetre(seed: int) -> None:
    """Against points all around the axis: nearer than the clearance all are inside, a little farther some are not."""
    rng = np.random.default_rng(seed)
    parts = tuple(_any_part(rng) for _ in range(rng.integers(2, 5)))
    around = rng.normal(size=(1500, 3))
    around /= np.linalg.norm(around, axis=1)[:, None]
    for _ in range(6):
        start = rng.uniform(0.0, 1.5, 3)
        ends = np.stack([start, start + rng.normal(size=3) * 0.2])
        along = ends[0] + np.linspace(0.0, 1.0, 60)[:, None] * (ends[1] - ends[0])
        clearance = float(Room(parts, (0.0,) * len(parts)).capsule_distance(ends, np.array(0.0)))
        if clearance <= 0.0:
            assert not _all_in(parts, along[:, None] + 5e-3 * around[:300])
        else:
            assert _all_in(parts, along[:, None] + (clearance - 1e-5) * around)
            assert not _all_in(parts, along[:, None] + (1.03 * clearance + 1e-3) * around)


def _any_part(rng: np.random.Generator) -> Convex:
    if rng.random() < 0.3:
        return Convex.of_points(rng.uniform(0.0, 1.5, (8, 3)))
    low = rng.choice([0.0, 0.25, 0.5, 1.0], 3)
    return box(tuple(low), tuple(low + rng.choice([0.5, 0.75, 1.0], 3)), rng.choice([0.0, 0.0, 0.3]))


def _all_in(parts: tuple[Convex, ...], points: np.ndarray) -> bool:
    return bool((np.min([height(part, points) for part in parts], axis=0) <= 1e-6).all())
