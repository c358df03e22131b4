"""Capsules as the cylinders and balls that a browser draws."""

from unittest.mock import Mock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import quaternion
from cell.view.bodies import Capsules
from cell.view.stage import CapsuleCloud, instances

coordinate = st.one_of(st.sampled_from([0.0, 1.0, -1.0]), st.floats(-2.0, 2.0, width=32))
ends = st.lists(coordinate, min_size=6, max_size=6).map(lambda each: np.array(each).reshape(2, 3))
ROOM = 4


@given(st.lists(ends, max_size=ROOM), st.floats(0.01, 0.5))
@settings(deadline=None)
def test_a_cylinder_lies_between_the_ends_of_its_capsule(each: list[np.ndarray], radius: float) -> None:
    count = len(each)
    capsules = Capsules(np.array(each).reshape(-1, 2, 3), np.full(count, radius))
    middle, turns, size, places, sizes = instances(capsules, ROOM)
    assert np.linalg.norm(turns, axis=-1) == pytest.approx(np.ones(ROOM), abs=1e-6)
    upwards = quaternion.to_matrix(np.roll(turns[:count], -1, axis=-1).astype(float))[:, :, 2]
    half = 0.5 * size[:count, 2:] * upwards
    found = np.stack([middle[:count] - half, middle[:count] + half], axis=1)
    for one, other in zip(found, capsules.points, strict=True):
        turned = other[::-1]
        nearer = min(np.abs(one - other).max(), np.abs(one - turned).max())
        assert nearer < 2e-6
    assert places[: 2 * count].reshape(-1, 2, 3) == pytest.approx(capsules.points, abs=1e-6)
    assert sizes[: 2 * count] == pytest.approx(np.full((2 * count, 3), radius))
    assert size[:count, :2] == pytest.approx(np.full((count, 2), radius))


def test_what_is_too_many_is_too_small_to_be_seen() -> None:
    _, _, size, _, sizes = instances(Capsules(np.zeros((1, 2, 3)), np.ones(1)), ROOM)
    assert size[1:].max() < 1e-5
    assert sizes[2:].max() < 1e-5


class Sent:
    """A node that counts what is sent of it."""

    count = 0

    def __setattr__(self, name: str, value: object) -> None:
        type(self).count += 1


def test_a_body_that_stands_is_not_sent_again() -> None:
    scene = Mock()
    scene.add_batched_meshes_simple = Mock(side_effect=lambda *_, **__: Sent())
    cloud, body = CapsuleCloud(scene, "/a", (1, 2, 3), None), Capsules(np.zeros((1, 2, 3)), np.ones(1))
    cloud.show(body, (1, 2, 3))
    sent = Sent.count
    assert sent > 0
    cloud.show(body, (1, 2, 3))
    assert Sent.count == sent
    cloud.show(body, (9, 9, 9))
    assert Sent.count > sent
