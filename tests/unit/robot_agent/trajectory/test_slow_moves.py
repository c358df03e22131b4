"""Slow moves in a chain: they take no precision, and so no time, from the fast ones beside them."""

import numpy as np
import pytest

from robot_agent.paths import Line, Sequence
from robot_agent.trajectory import Limits, Motion, plan
from tests.unit.six_axis_arm import arm

ARM = arm()
LIMITS = Limits.of(ARM.description)
START = np.radians([0.0, -20.0, 30.0, 0.0, 60.0, 0.0])
FAST_M_S = 0.8
PLACES_M = [(-0.1, -0.3 + 0.05 * (k // 2), -0.1 if k % 4 in (1, 2) else 0.0) for k in range(16)]


def chain(speeds_m_s: list[float]) -> Motion:
    """Up and down beside where the arm stands, its corners rounded."""
    moves = []
    for number, (place, speed_m_s) in enumerate(zip(PLACES_M, speeds_m_s, strict=True), 1):
        pose = ARM.forward(START)
        pose[:3, 3] += place
        moves.append(Line(pose, speed_m_s, number, round_m=0.005))
    return plan(ARM, Sequence(moves), LIMITS, START)


def durations(motion: Motion) -> np.ndarray:
    return np.diff(motion.ends, prepend=0.0)


@pytest.mark.parametrize("slow", [0, 7, 15])
def test_slow_move_does_not_slow_the_others_of_its_chain(slow: int) -> None:
    alone = durations(chain([FAST_M_S] * len(PLACES_M)))
    speeds = [FAST_M_S] * len(PLACES_M)
    speeds[slow] = 0.001
    mixed = durations(chain(speeds))
    others = np.arange(len(PLACES_M)) != slow
    beside = others & (np.abs(np.arange(len(PLACES_M)) - slow) > 1)  # the next ones begin or end at its speed
    assert mixed[slow] > 40.0
    assert mixed[beside].sum() < 1.02 * alone[beside].sum()
    assert mixed[others].sum() < 1.06 * alone[others].sum()


def test_fast_and_slow_moves_in_one_chain_keep_all_limits() -> None:
    motion = chain([FAST_M_S, 0.02, 0.1, 0.005] * 4)
    used = motion.pieces.peaks() / [LIMITS.velocity, LIMITS.both_ways, LIMITS.jerk]
    assert used.max() < 1.001
    places = np.linspace(0.0, 1.0, 5)
    t = (motion.pieces.knots[:-1, None] + np.diff(motion.pieces.knots)[:, None] * places).ravel()
    allowed = np.array([FAST_M_S, 0.02, 0.1, 0.005] * 4)[motion.move_at(t)]
    assert (motion.tcp_speed(t) < 1.01 * allowed).all()


def test_duration_of_a_slow_chain_is_that_of_its_way_at_its_speed() -> None:
    motion = chain([0.005] * len(PLACES_M))
    t = motion.pieces.knots
    way = np.linalg.norm(np.diff(motion.pose(t)[:, :3, 3], axis=0), axis=1).sum()
    assert motion.duration_s < 1.003 * way / 0.005
