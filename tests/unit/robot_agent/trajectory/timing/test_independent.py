"""Joint moves out of step, and the cap on the joints' own speed on any move."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.kinematics import load_model
from robot_agent.model import ProfileKind, Shaping
from robot_agent.paths import Arc, JointMove, Line, Sequence
from robot_agent.paths.sequence import Move
from robot_agent.trajectory import Limits, Motion, plan, s_curve
from tests.unit.random_moves import LIMITS, MODEL, START
from tests.unit.repository import ROOT

TARGET = START + np.array([0.3, -0.2, 0.1, 0.6, 0.2, -0.5])


def planned(*moves: Move, limits: Limits = LIMITS) -> Motion:
    return plan(MODEL, Sequence(moves), limits, start=START)


def alone_s(way: float, joint: int, speed: float = 1.0) -> float:
    bounds = speed * LIMITS.velocity[joint], LIMITS.acceleration[joint], LIMITS.jerk[joint]
    return s_curve(way, *map(float, bounds)).duration_s


@settings(max_examples=15, deadline=None)
@given(st.tuples(*[st.floats(-0.4, 0.4)] * 6), st.floats(0.1, 1.0))
def test_each_joint_arrives_as_soon_as_it_can(ways: tuple[float, ...], speed: float) -> None:
    target = START + np.array(ways)
    motion = planned(JointMove(target, speed, 1, synchronised=False))
    arrivals = [alone_s(way, joint, speed) for joint, way in enumerate(ways)]
    assert motion.duration_s == pytest.approx(max(arrivals), rel=1e-9, abs=1e-9)
    q = motion.q(np.array(arrivals))
    np.testing.assert_allclose(np.diagonal(q), target, atol=1e-7)
    np.testing.assert_allclose(motion.q(np.array(motion.duration_s)), target, atol=1e-12)
    used = motion.pieces.peaks(33) / np.stack([speed * LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert used.max() <= 1.001


def test_all_joints_start_together_and_stop_apart() -> None:
    motion = planned(JointMove(TARGET, 1.0, 1, synchronised=False))
    assert (np.abs(motion.qd(np.array(0.02))) > 1e-3).all()
    late = motion.qd(np.array(motion.duration_s - 0.02))
    assert 0 < np.count_nonzero(np.abs(late) > 1e-6) < 6


def test_it_rests_at_both_ends_whatever_comes_before_and_behind() -> None:
    way = TARGET - START
    motion = planned(
        JointMove(START + way, 1.0, 1, round_m=0.05),
        JointMove(START + 1.5 * way, 1.0, 2, synchronised=False),
        JointMove(START + 2.0 * way, 1.0, 3),
    )
    assert len(motion.rests) == 4
    np.testing.assert_allclose(motion.q(motion.rests[1:3]), START + np.outer([1.0, 1.5], way), atol=1e-9)


@pytest.mark.parametrize("kind", ProfileKind, ids=lambda kind: kind.value)
def test_each_joint_has_the_profile_of_the_robot_file(kind: ProfileKind) -> None:
    shaping = Shaping(kind, 0.05 if kind is ProfileKind.TRAPEZOIDAL else 0.0)
    motion = planned(JointMove(TARGET, 1.0, 1, synchronised=False), limits=replace(LIMITS, shaping=shaping))
    used = motion.pieces.peaks(33) / np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    assert 0.99 <= used.max() <= 1.001
    np.testing.assert_allclose(motion.q(np.array(motion.duration_s)), TARGET, atol=1e-9)


def test_caps_slow_all_of_it_down() -> None:
    move = JointMove(TARGET, 1.0, 1, synchronised=False)
    motion = planned(replace(move, speed_m_s=0.1))
    assert motion.tcp_speed(np.linspace(0, motion.duration_s, 2000)).max() == pytest.approx(0.1, rel=1e-3)
    motion = planned(replace(move, joint_speed_rad_s=0.2))
    speeds = np.linalg.norm(motion.qd(np.linspace(0, motion.duration_s, 2000)), axis=1)
    assert speeds.max() == pytest.approx(0.2, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["scara", "delta"])
def test_caps_are_kept_on_moves_that_would_be_over_within_some_cycles(name: str, seed: int) -> None:
    """Between places 4 ms apart of such a move, as it is without the cap, the TCP was up to 5 % too fast."""
    model, rng = load_model(ROOT / "cell_configs" / "models" / f"{name}.yaml"), np.random.default_rng(seed)
    limits, way = Limits.of(model.description), 10.0 ** rng.uniform(-3.0, -1.0)
    target = model.home + way * rng.uniform(-0.3, 0.3, model.n) * np.where(model.linear, 0.2, 1.0)
    for cap in ("speed_m_s", "rotation_rad_s", "joint_speed_rad_s"):
        most = 10.0 ** rng.uniform(-3.0, -1.0)
        move = replace(JointMove(target, 1.0, 1, synchronised=False), **{cap: most})
        motion = plan(model, Sequence([move]), limits, start=model.home)
        times = np.linspace(0.0, motion.duration_s, 5000)
        q, qd = motion.q(times), motion.qd(times)
        twist = (model.jacobian(q) @ qd[..., None])[..., 0]
        rates = {"speed_m_s": twist[:, :3], "rotation_rad_s": twist[:, 3:], "joint_speed_rad_s": qd[:, ~model.linear]}
        assert np.linalg.norm(rates[cap], axis=1).max() <= 1.0005 * most


def test_a_round_edge_is_refused() -> None:
    with pytest.raises(ValueError, match="line 3: a round edge found"):
        JointMove(TARGET, 1.0, 3, synchronised=False, round_m=0.01)


def beside(y: float, z: float) -> np.ndarray:
    pose = MODEL.forward(START)
    pose[:3, 3] += 0.0, y, z
    return pose


@pytest.mark.parametrize(
    "move",
    [
        JointMove(TARGET, 1.0, 1, joint_speed_rad_s=0.2),
        Line(beside(0.4, 0.1), None, 1, joint_speed_rad_s=0.2),
        Arc(beside(0.1, 0.1), beside(0.2, 0.0), 1, joint_speed_rad_s=0.2),
    ],
    ids=["joint move", "line", "arc"],
)
def test_joint_speed_can_be_capped_on_every_move(move: Move) -> None:
    motion = planned(move)
    speeds = np.linalg.norm(motion.qd(np.linspace(0, motion.duration_s, 2000)), axis=1)
    assert speeds.max() == pytest.approx(0.2, rel=5e-3)
    assert motion.duration_s > planned(replace(move, joint_speed_rad_s=None)).duration_s


def test_worked_joint_speeds_of_a_capped_move() -> None:
    """Joint ways of 30 and 40 degrees at 10 deg/s: 6 and 8 deg/s; where joint 2 may do 5, the rest is slowed down."""
    target = START + np.radians([30.0, 40.0, 0, 0, 0, 0])
    motion = planned(JointMove(target, 1.0, 1, joint_speed_rad_s=np.radians(10.0)))
    middle = np.degrees(motion.qd(np.array(motion.duration_s / 2.0)))
    np.testing.assert_allclose(middle[:2], [6.0, 8.0], rtol=1e-9)
    velocity = LIMITS.velocity.copy()
    velocity[1] = np.radians(5.0)
    move = JointMove(target, 1.0, 1, joint_speed_rad_s=np.radians(10.0))
    slow = planned(move, limits=replace(LIMITS, velocity=velocity))
    middle = np.degrees(slow.qd(np.array(slow.duration_s / 2.0)))
    np.testing.assert_allclose(middle[:2], [0.625 * 6.0, 5.0], rtol=1e-9)
