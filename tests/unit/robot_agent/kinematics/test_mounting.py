from dataclasses import replace

import numpy as np
import pytest

from cell.geometry import NotAPose, from_xyz_abc, to_xyz_abc
from robot_agent.kinematics import BadInput, model_of
from robot_agent.kinematics.mounting import Fixed, LinearTrack, Turntable, tcp_in_base, tcp_in_world
from robot_agent.model import Tool
from robot_agent.model.description import Capsule, Mounted
from tests.unit.six_axis_arm import CAPSULES, VECTORS, arm, description

RNG = np.random.default_rng(8)
(CASE,) = VECTORS["frames"]


def pose_of(mm_deg: list[float]) -> np.ndarray:
    return from_xyz_abc(np.append(np.array(mm_deg[:3]) / 1000, np.radians(mm_deg[3:])))


TOOL = Tool(
    name="torch",
    pose_flange_tcp=pose_of(CASE["tool_mm_deg"]),
    mass_kg=4.0,
    centre_m=(0.05, 0.0, 0.0),
    inertia_kg_m2=np.eye(3) * 0.02,
    capsules=(Capsule((0.0, 0.0, 0.0), (0.2, 0.0, 0.1), 0.04),),
)
WITH_TOOL = model_of(replace(description(), tools={"torch": TOOL}, mounted=Mounted(("torch",))))
CEILING = Fixed(pose_of(CASE["base_mm_deg"]))
Q = np.radians(CASE["joints_deg"])


def test_zero_frame_and_tool_reproduce_the_textbooks_ceiling_mount() -> None:
    tcp = tcp_in_world(WITH_TOOL, CEILING, Q, np.array(0.0))
    x, y, z, *abc = to_xyz_abc(tcp)
    np.testing.assert_allclose([1000 * x, 1000 * y, 1000 * z, *np.degrees(abc)], CASE["tcp_mm_deg"], atol=1e-5)
    here = tcp_in_base(CEILING, tcp, np.array(0.0))
    np.testing.assert_allclose(WITH_TOOL.solve(here, near=Q), Q, atol=1e-9)


def test_the_tcp_is_the_flange_without_a_tool() -> None:
    np.testing.assert_array_equal(arm().forward(Q), arm().links(Q)[-1])
    np.testing.assert_array_equal(arm().flange_at(arm().forward(Q)), arm().forward(Q))


def test_the_flange_for_a_tcp_brings_the_tcp_there() -> None:
    q = RNG.uniform(-1, 1, (20, 6))
    np.testing.assert_allclose(WITH_TOOL.flange_at(WITH_TOOL.forward(q)), WITH_TOOL.links(q)[:, -1], atol=1e-12)


def test_the_body_of_the_tool_moves_with_the_flange() -> None:
    points = WITH_TOOL.capsules(Q)
    assert points.shape == (len(CAPSULES) + 1, 2, 3)
    assert WITH_TOOL.capsule_radii[-1] == 0.04
    end = WITH_TOOL.links(Q)[-1] @ [0.2, 0.0, 0.1, 1.0]
    np.testing.assert_allclose(points[-1, 1], end[:3], atol=1e-12)


def test_the_reach_covers_the_tool_too() -> None:
    long = replace(TOOL, capsules=(Capsule((0.0, 0.0, 0.0), (2.0, 0.0, 0.0), 0.04),))
    model = model_of(replace(description(), tools={"torch": long}, mounted=Mounted(("torch",))))
    q = RNG.uniform(-3, 3, (3000, 6))
    assert (np.linalg.norm(model.capsules(q), axis=-1).max(axis=-1) + model.capsule_radii).max() <= model.reach_m
    assert model.reach_m > arm().reach_m


def test_a_track_carries_the_base_along_its_own_x_axis() -> None:
    track = LinearTrack(pose_of([1000, 0, 0, 0, 0, 90]), pose_of([0, 0, 400, 0, 0, 180]))
    poses = track.base_of(np.array([0.0, 1.5]))
    np.testing.assert_allclose(poses[0], pose_of([1000, 0, 400, 0, 0, 270]), atol=1e-12)
    np.testing.assert_allclose(poses[1], pose_of([1000, 1500, 400, 0, 0, 270]), atol=1e-12)


def test_a_turntable_carries_the_base_around_its_own_z_axis() -> None:
    table = Turntable(pose_of([0, 0, 300, 0, 0, 0]), pose_of([500, 0, 0, 0, 0, 0]))
    poses = table.base_of(np.radians([[0.0, 90.0], [180.0, -90.0]]))
    assert poses.shape == (2, 2, 4, 4)
    np.testing.assert_allclose(poses[0, 1], pose_of([0, 500, 300, 0, 0, 90]), atol=1e-12)
    np.testing.assert_allclose(poses[1, 0], pose_of([-500, 0, 300, 0, 0, 180]), atol=1e-12)


def test_a_carried_robot_reaches_a_world_pose_from_several_places() -> None:
    track = LinearTrack(np.eye(4), np.eye(4))
    target = tcp_in_world(WITH_TOOL, track, Q, np.array(0.3))
    external = np.array([0.2, 0.3, 0.4])
    for at, here in zip(external, tcp_in_base(track, target, external), strict=True):
        q = WITH_TOOL.solve(here, near=Q)
        np.testing.assert_allclose(tcp_in_world(WITH_TOOL, track, q, at), target, atol=1e-9)


def test_what_is_no_pose_and_no_position_is_refused() -> None:
    with pytest.raises(NotAPose, match="TCP poses"):
        tcp_in_base(CEILING, np.zeros((4, 4)), np.array(0.0))
    with pytest.raises(BadInput, match="external axis"):
        Turntable(np.eye(4), np.eye(4)).base_of(np.array(np.nan))
