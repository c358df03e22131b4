"""Which bodies are in a zone, and when a zone is another one."""

from dataclasses import replace

import numpy as np
import pytest

from cell.geometry import SpaceOf
from cell.manager.occupancy import ZoneSpace
from tests.unit.manager_world import ball, settings

ZONE = settings().zones["middle"]


@pytest.mark.parametrize(("x", "inside"), [(0.0, True), (0.299, True), (0.301, False)])
def test_a_body_is_inside_as_soon_as_it_touches(x: float, inside: bool) -> None:
    assert ZoneSpace(ZONE).touched_by("left", ball(x)) is inside


def test_the_newest_body_counts() -> None:
    space = ZoneSpace(ZONE)
    assert space.touched_by("left", ball(0.0))
    assert not space.touched_by("left", ball(1.0))
    assert space.touched_by("right", ball(0.0))


def test_a_pose_to_come_counts_with_its_growth() -> None:
    far = ball(1.0)
    poses = np.concatenate([far.poses, ball(0.35).poses])
    near, away = (replace(far, poses=poses, growth_m=np.float32([0.0, growth])) for growth in (0.06, 0.04))
    assert ZoneSpace(ZONE).touched_by("left", near)
    assert not ZoneSpace(ZONE).touched_by("left", away)


def test_in_a_zone_of_the_tcp_nothing_else_of_the_body_counts() -> None:
    space, through = ZoneSpace(replace(ZONE, of=SpaceOf.TCP)), ball(0.0)
    assert space.touched_by("left", through)
    assert not space.touched_by("left", replace(through, tcp_m=np.float32([[0.0, 0.0, 1.0]])))


def test_the_version_is_that_of_the_geometry() -> None:
    assert ZoneSpace(ZONE).geometry.version == ZoneSpace(replace(ZONE)).geometry.version
    others = [
        replace(ZONE, size_m=(0.4, 0.4, 0.5)),
        replace(ZONE, shape="sphere", size_m=(0.4,)),
        replace(ZONE, shape="cylinder", size_m=(0.4, 0.4)),
        replace(ZONE, of=SpaceOf.TCP),
    ]
    versions = {ZoneSpace(zone).geometry.version for zone in (ZONE, *others)}
    assert len(versions) == 5
    assert ZoneSpace(replace(ZONE, priority={"left": 3})).geometry == ZoneSpace(ZONE).geometry


@pytest.mark.parametrize(
    ("shape", "size_m", "reaches_m"),
    [("sphere", (0.5,), 0.5), ("cylinder", (0.3, 2.0), 0.3), ("box", (0.4, 1, 1), 0.2)],
)
def test_a_zone_of_each_shape_ends_at_its_border(shape: str, size_m: tuple[float, ...], reaches_m: float) -> None:
    space = ZoneSpace(replace(ZONE, shape=shape, size_m=size_m))
    assert space.touched_by("left", ball(reaches_m + 0.1 - 1e-6))
    assert not space.touched_by("left", ball(reaches_m + 0.1 + 1e-6))
