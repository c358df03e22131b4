from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import SpaceOf, WrongShape, body_touches, transform_points
from cell.messages import ZoneGeometry
from robot_agent.workspace import Crossing, body_message, crossings, sweep, with_entry
from tests.unit.six_axis_arm import arm, with_tip
from tests.unit.six_axis_paths import BASE, CYCLE_S, joint_path

ARM, TIPPED = arm(), with_tip()
MARGIN_M = 0.03
"""More than the growth of a published body, as the agent has it."""


SHAPES = st.sampled_from([("box", (0.4, 0.5, 0.3)), ("sphere", (0.2,)), ("cylinder", (0.2, 0.4))])


def zone_at(
    centre: np.ndarray, size: tuple[float, ...] = (0.4, 0.5, 0.3), turn: float = 0.4, shape: str = "box"
) -> ZoneGeometry:
    return ZoneGeometry(
        zone="fixture",
        version=1,
        size_m=size,
        position_m=tuple(centre.tolist()),
        quaternion_xyzw=(0.0, 0.0, float(np.sin(turn / 2)), float(np.cos(turn / 2))),
        robots=("left",),
        shape=shape,
    )


def flange_zone(seed: int, tau: float, shape: tuple[str, tuple[float, ...]]) -> ZoneGeometry:
    """A zone beside where the flange is at a time of the path."""
    pose = BASE @ ARM.forward(joint_path(seed, np.array([tau])))[0]
    return zone_at(pose[:3, 3] + pose[:3, 0] * 0.35, shape[1], shape=shape[0])


def distances(q: np.ndarray, zone: ZoneGeometry) -> np.ndarray:
    points = transform_points(BASE, ARM.capsules(q))
    return np.asarray(zone.solid().capsule_distance(points, ARM.capsule_radii)).min(axis=-1)


@given(seed=st.integers(0, 10_000), where=st.floats(0, 1.6), shape=SHAPES, cycle_s=st.sampled_from([CYCLE_S, 0.02]))
@settings(max_examples=40, deadline=None)
def test_every_touch_lies_inside_a_crossing(
    seed: int, where: float, shape: tuple[str, tuple[float, ...]], cycle_s: float
) -> None:
    taus = cycle_s * np.arange(round(1.6 / cycle_s) + 1)
    zone = flange_zone(seed, where, shape)
    found = crossings(sweep(ARM, BASE, joint_path(seed, taus)), taus, zone, MARGIN_M)
    fine = np.linspace(0, taus[-1], 3001)
    touching = fine[distances(joint_path(seed, fine), zone) <= MARGIN_M]
    covered = [any(c.enter_tau <= tau <= c.leave_tau for c in found) for tau in touching]
    assert all(covered)


@given(seed=st.integers(0, 10_000), where=st.floats(0, 1.6), shape=SHAPES)
@settings(max_examples=20, deadline=None)
def test_a_robot_held_in_front_of_a_crossing_publishes_a_body_outside_the_zone(
    seed: int, where: float, shape: tuple[str, tuple[float, ...]]
) -> None:
    taus = CYCLE_S * np.arange(401)
    zone = flange_zone(seed, where, shape)
    body = sweep(ARM, BASE, joint_path(seed, taus))
    found = crossings(body, taus, zone, MARGIN_M)
    held = round(found[0].enter_tau / CYCLE_S) if found else len(taus) - 1
    if held > 0:
        message = body_message(ARM, BASE, [(body, 0, held)])
        assert not body_touches(message, zone.solid())


def tip(q: np.ndarray) -> np.ndarray:
    return np.asarray((BASE @ TIPPED.forward(q))[..., :3, 3])


@given(seed=st.integers(0, 10_000), where=st.floats(0, 1.6), cycle_s=st.sampled_from([CYCLE_S, 0.02]))
@settings(max_examples=40, deadline=None)
def test_a_zone_of_the_tcp_is_crossed_where_the_point_of_the_tool_is_within_the_margin_and_held_in_front_it_is_outside(
    seed: int, where: float, cycle_s: float
) -> None:
    taus = cycle_s * np.arange(round(1.6 / cycle_s) + 1)
    centre = tip(joint_path(seed, np.array([where])))[0] + [0.1, -0.05, 0.1]
    ball = replace(zone_at(centre, (0.2,), shape="sphere"), of=SpaceOf.TCP)
    body = sweep(TIPPED, BASE, joint_path(seed, taus))
    found = crossings(body, taus, ball, MARGIN_M)
    fine = np.linspace(0, taus[-1], 3001)
    away = np.linalg.norm(tip(joint_path(seed, fine)) - centre, axis=-1) - 0.2
    for tau in fine[away <= MARGIN_M]:
        assert any(c.enter_tau <= tau <= c.leave_tau for c in found)
    for crossing in found:
        there = (fine >= crossing.enter_tau) & (fine <= crossing.leave_tau)
        assert away[there].min() <= MARGIN_M + 0.1
    held = round(found[0].enter_tau / cycle_s) if found else len(taus) - 1
    if held > 0:
        assert not body_touches(body_message(TIPPED, BASE, [(body, 0, held)]), ball.solid(), SpaceOf.TCP)


def test_an_elbow_may_go_through_a_zone_of_the_tcp() -> None:
    taus = CYCLE_S * np.arange(401)
    q = np.zeros((401, 6))
    q[:, 0] = np.linspace(-0.8, 0.8, 401)
    elbow = transform_points(BASE, ARM.capsules(np.zeros(6)))[3, 0]
    through = zone_at(elbow, (0.2,), shape="sphere")
    path = sweep(ARM, BASE, q)
    assert len(crossings(path, taus, through, MARGIN_M)) == 1
    assert crossings(path, taus, replace(through, of=SpaceOf.TCP), MARGIN_M) == []


def test_a_crossing_is_not_much_longer_than_the_touch() -> None:
    taus = CYCLE_S * np.arange(401)
    q = np.zeros((401, 6))
    q[:, 0] = np.linspace(-0.8, 0.8, 401)
    zone = zone_at((BASE @ ARM.forward(np.zeros(6)))[:3, 3])
    (crossing,) = crossings(sweep(ARM, BASE, q), taus, zone, MARGIN_M)
    touching = taus[distances(q, zone) <= MARGIN_M]
    assert 0 < touching[0] - crossing.enter_tau < 5 * CYCLE_S
    assert 0 < crossing.leave_tau - touching[-1] < 5 * CYCLE_S


def test_a_path_that_passes_twice_has_two_crossings() -> None:
    taus = CYCLE_S * np.arange(801)
    q = np.zeros((801, 6))
    q[:, 0] = 0.8 * np.cos(np.linspace(0, 2 * np.pi, 801))
    zone = zone_at((BASE @ ARM.forward(np.zeros(6)))[:3, 3], size=(0.1, 0.1, 0.1))
    first, second = crossings(sweep(ARM, BASE, q), taus, zone, MARGIN_M)
    assert first.leave_tau < taus[400] < second.enter_tau


def test_a_path_inside_the_zone_crosses_it_from_end_to_end() -> None:
    taus = CYCLE_S * np.arange(50)
    zone = zone_at((BASE @ ARM.forward(np.zeros(6)))[:3, 3])
    (crossing,) = crossings(sweep(ARM, BASE, np.zeros((50, 6))), taus, zone, MARGIN_M)
    assert (crossing.enter_tau, crossing.leave_tau) == (0.0, taus[-1])
    assert crossing.zone == "fixture"


def test_a_path_far_from_the_zone_does_not_cross_it() -> None:
    taus = CYCLE_S * np.arange(50)
    zone = zone_at(BASE[:3, 3] + [0, 0, ARM.reach_m + 1])
    assert crossings(sweep(ARM, BASE, joint_path(1, taus)), taus, zone, MARGIN_M) == []


def test_there_is_one_time_per_sample() -> None:
    with pytest.raises(WrongShape, match=r"\(50,\)"):
        crossings(sweep(ARM, BASE, np.zeros((50, 6))), np.zeros(49), zone_at(np.zeros(3)), MARGIN_M)


def test_zones_that_overlap_on_the_path_have_the_entry_of_the_first_in_common() -> None:
    paths = [Crossing("c", 5.0, 6.0), Crossing("b", 2.0, 4.0), Crossing("a", 1.0, 3.0), Crossing("a", 4.0, 4.5)]
    found = [(crossing.zone, crossing.enter_tau, entry) for crossing, entry in with_entry(paths)]
    assert found == [("a", 1.0, 1.0), ("b", 2.0, 1.0), ("a", 4.0, 1.0), ("c", 5.0, 5.0)]
