from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import (
    MEASURED,
    Box,
    GeometryError,
    HalfSpace,
    Hull,
    Solid,
    SpaceOf,
    body_touches,
    capsules_touch,
    measured_solid,
    pose_from,
)
from cell.messages import Body
from tests.unit.plain_body import Capsule, plain_body

BOX = Box.at((1.0, 1.0, 1.0), (2.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
FAR = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
NEAR = (1.39, 0.0, 0.0, 1.39, 0.0, 0.3)


def body(*poses: Capsule, growth: float = 0.0) -> Body:
    return plain_body((0.1,), tuple((pose,) for pose in poses), tuple(growth for _ in poses), reach_m=5.0)


def test_a_body_clear_of_the_box_does_not_touch_it() -> None:
    assert not body_touches(body(FAR, NEAR), BOX)


def test_one_pose_on_the_way_is_enough() -> None:
    assert body_touches(body(FAR, (1.45, 0.0, 0.0, 1.45, 0.0, 0.3), FAR), BOX)


def test_the_growth_of_a_pose_counts() -> None:
    assert body_touches(body(FAR, NEAR, growth=0.02), BOX)


def test_an_unknown_body_counts_as_its_whole_reach() -> None:
    assert body_touches(Body(known=False, base=(0.0, 0.0, 0.0), reach_m=1.5), BOX)
    assert not body_touches(Body(known=False, base=(0.0, 0.0, 0.0), reach_m=1.49), BOX)


def test_a_body_without_poses_counts_as_its_whole_reach() -> None:
    assert body_touches(body(), BOX)
    assert body_touches(body(), BOX, SpaceOf.TCP)


@pytest.mark.parametrize(("x", "growth", "inside"), [(1.5, 0.0, True), (1.499, 0.0, False), (1.4375, 0.0625, True)])
def test_of_the_tcp_alone_a_ball_of_the_growth_counts(x: float, growth: float, inside: bool) -> None:
    arm = replace(body(FAR, NEAR, growth=growth), tcp_m=np.float32([[0.0, 0.0, 0.0], [x, 0.0, 0.0]]))
    assert body_touches(arm, BOX, SpaceOf.TCP) is inside


def test_an_arm_that_reaches_through_a_box_is_not_in_it_with_its_tcp() -> None:
    through = body((1.0, 0.0, 0.0, 3.0, 0.0, 0.0))
    assert body_touches(through, BOX)
    assert not body_touches(through, BOX, SpaceOf.TCP)


def test_who_does_not_say_where_its_tcp_is_or_does_not_know_has_it_anywhere_in_its_reach() -> None:
    silent = replace(body(FAR), tcp_m=np.empty((0, 3), np.float32))
    unknown = Body(known=False, base=(0.0, 0.0, 0.0), reach_m=1.5)
    assert body_touches(silent, BOX, SpaceOf.TCP)
    assert body_touches(unknown, BOX, SpaceOf.TCP)


TURNED = pose_from(np.array([0.3, -0.2, 0.5]), np.array([0.2, 0.4, 0.4, 0.8]))
LENGTHS = {"box": (0.9, 0.5, 1.2), "sphere": (0.5,), "cylinder": (0.4, 1.1)}
SOLIDS: list[Solid] = [
    *(measured_solid(word, LENGTHS[word], TURNED) for word in MEASURED),
    HalfSpace(TURNED),
    Hull(np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]), TURNED),
]


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)
def test_touching_agrees_with_the_distance(solid: Solid) -> None:
    rng = np.random.default_rng(3)
    ends, radii = rng.uniform(-1.5, 1.5, (40, 12, 2, 3)), rng.uniform(0.01, 0.1, 12)
    expected = np.asarray(solid.capsule_distance(ends, radii)) <= 0.0
    assert {False, True} == set(expected.ravel().tolist())
    np.testing.assert_array_equal(capsules_touch(ends, radii, solid), expected)


@pytest.mark.parametrize("solid", SOLIDS, ids=lambda solid: type(solid).__name__)
@given(seed=st.integers(0, 10_000))
@settings(max_examples=30, deadline=None)
def test_a_body_touches_a_solid_where_one_of_its_capsules_does(solid: Solid, seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses = np.float32(rng.uniform(-1.2, 1.2, (3, 2, 2, 3)))
    radii, growth = np.float32(rng.uniform(0.01, 0.1, 2)), np.float32(rng.uniform(0.0, 0.1, 3))
    grown = radii.astype(float) + growth[:, None].astype(float)
    expected = bool((np.asarray(solid.capsule_distance(poses.astype(float), grown)) <= 0.0).any())
    occupied = Body(True, (0.0, 0.0, 0.0), 5.0, radii, poses, growth)
    assert body_touches(occupied, solid) is expected


@pytest.mark.parametrize(
    ("word", "lengths", "says"),
    [
        ("cone", (1.0,), "found 'cone', allowed one of box, sphere, cylinder"),
        ("sphere", (1.0, 2.0), "sphere: found 2 lengths, allowed radius"),
        ("cylinder", (1.0, 0.0), "length of a cylinder: found 0 m, allowed is a length above zero"),
        ("box", (1.0, -1.0, 1.0), "allowed are three lengths above zero"),
    ],
)
def test_lengths_that_give_no_solid_are_refused(word: str, lengths: tuple[float, ...], says: str) -> None:
    with pytest.raises(GeometryError, match=says):
        measured_solid(word, lengths, TURNED)
