from dataclasses import replace

import numpy as np

from cell.geometry import from_xyz_abc, inverse, to_xyz_abc
from robot_agent.kinematics import model_of
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
POSE_WORLD_BASE = pose_of(CASE["base_mm_deg"])
Q = np.radians(CASE["joints_deg"])


def test_zero_frame_and_tool_reproduce_the_textbooks_ceiling_mount() -> None:
    tcp = POSE_WORLD_BASE @ WITH_TOOL.forward(Q)
    x, y, z, *abc = to_xyz_abc(tcp)
    np.testing.assert_allclose([1000 * x, 1000 * y, 1000 * z, *np.degrees(abc)], CASE["tcp_mm_deg"], atol=1e-5)
    here = inverse(POSE_WORLD_BASE) @ tcp
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
