"""Which way an exact half turn goes: the same whatever rounding makes of its ends, and back as it came."""

import contextlib

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import from_xyz_abc, to_xyz_abc
from robot_agent.kinematics import load_model
from robot_agent.paths import Line, Sequence
from robot_agent.paths.orientation import turn_between, turned
from robot_agent.trajectory import Limits, PlanError, plan
from tests.unit.config_world import CONFIGS

NOISE_RAD = [1e-12, 1e-10, 1e-9]
ROUND = st.sampled_from([0.0, 30.0, 45.0, 60.0, 90.0, 120.0, 135.0, 180.0, -30.0, -45.0, -60.0, -90.0, -135.0])
AXIS = st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, -1), (1, 0, -1), (1, 1, 1), (-1, 2, 0)])


def rotation(a: float, b: float, c: float) -> np.ndarray:
    """`(3, 3)` of A, B, C [deg]."""
    return np.asarray(from_xyz_abc(np.append(np.zeros(3), np.radians([a, b, c])))[:3, :3])


def shaken(rng: np.random.Generator, orientation: np.ndarray, size_rad: float) -> np.ndarray:
    """The same, turned by about so much about any axis."""
    return from_xyz_abc(np.append(np.zeros(3), rng.uniform(-size_rad, size_rad, 3)))[:3, :3] @ orientation


def c_on_the_way(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """C [deg] at five places of the way, not unwrapped."""
    axis, angle = turn_between(before, after)
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, :3, :3] = turned(axis, angle * np.linspace(0.0, 1.0, 5)) @ before
    return np.degrees(to_xyz_abc(poses)[:, 5])


@pytest.mark.parametrize(("a", "b"), [(0, 0), (180, 0), (0, 90), (0, -90)], ids=str)
@pytest.mark.parametrize(
    ("before", "after", "half_way"),
    [(0, 180, 90), (180, 0, 90), (0, -180, 90), (90, -90, 0), (-90, 90, 0), (30, 210, -60)],
)
def test_c_goes_as_its_numbers_between_minus_180_and_180_say(
    a: float, b: float, before: float, after: float, half_way: float
) -> None:
    way = c_on_the_way(rotation(a, b, before), rotation(a, b, after))
    assert way[2] == pytest.approx(half_way, abs=1e-6)


@settings(max_examples=150, deadline=None)
@given(ROUND, ROUND, ROUND, AXIS, st.sampled_from(NOISE_RAD), st.integers(0, 2**32 - 1))
def test_rounding_of_both_ends_changes_nothing_of_the_way_and_the_way_back_is_the_same(
    a: float, b: float, c: float, axis: tuple[int, int, int], size_rad: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    before = rotation(a, b, c)
    after = turned(np.array(axis) / np.linalg.norm(axis), np.array(np.pi)) @ before
    known, angle = turn_between(before, after)
    assert angle == pytest.approx(np.pi)
    for _ in range(5):
        ends = shaken(rng, before, size_rad), shaken(rng, after, size_rad)
        found, angle = turn_between(*ends)
        np.testing.assert_allclose(found, known, atol=1e-6)
        np.testing.assert_allclose(turned(found, np.array(angle)) @ ends[0], ends[1], atol=1e-12)
        np.testing.assert_allclose(turn_between(*ends[::-1])[0], -known, atol=1e-6)


@pytest.mark.parametrize("name", ["six_axis", "scara", "gantry", "palletizer", "delta", "cobot", "painter"])
def test_rounding_of_start_and_target_changes_nothing_of_the_way_of_the_joints(name: str) -> None:
    model, rng = load_model(CONFIGS / "models" / f"{name}.yaml"), np.random.default_rng(1)
    turns = []
    for first_deg in (-90.0, 0.0, 90.0):
        start = model.home + np.where(model.linear, 0.0, 0.05)
        start[-1] = np.radians(first_deg)
        end = start.copy()
        end[-1] += np.pi
        ways = []
        for size in [0.0, *NOISE_RAD, *NOISE_RAD]:
            q, near = start + rng.uniform(-size, size, model.n), end + rng.uniform(-size, size, model.n)
            line = Line(model.forward(near), None, 1)
            with contextlib.suppress(PlanError):  # one of both ways may be longer than the joint's range
                motion = plan(model, Sequence([line]), Limits.of(model.description), start=q)
                ways.append(motion.q(np.array(motion.duration_s)) - q)
        assert len(ways) in (0, 1 + 2 * len(NOISE_RAD))
        np.testing.assert_allclose(ways, ways[:1] * len(ways), atol=1e-5)
        turns += ways[:1]
    assert turns
    np.testing.assert_allclose(np.abs(turns)[:, -1], np.pi, atol=1e-5)


def test_a_loop_with_half_turns_ends_each_round_with_the_same_joints() -> None:
    model = load_model(CONFIGS / "models" / "scara.yaml")
    places = [
        from_xyz_abc(np.array([0.3, y, model.forward(model.home)[2, 3], 0.0, 0.0, c]))
        for y, c in ((0.1, 0.0), (-0.1, np.pi))
    ]
    lines = [Line(pose, None, 1, round_m=0.0) for pose in places * 5]
    start = np.radians([20.0, 40.0, 0.0, -60.0])
    motion = plan(model, Sequence(lines), Limits.of(model.description), start=start)
    rounds = motion.q(motion.ends).reshape(5, 2, model.n)
    np.testing.assert_allclose(rounds, np.tile(rounds[0], (5, 1, 1)), atol=1e-5)
