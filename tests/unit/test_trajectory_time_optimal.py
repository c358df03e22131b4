"""Timing along any path: as fast as the limits allow, and never faster."""

import json
from pathlib import Path

import numpy as np
import pytest
from random_moves import LIMITS, MODEL, START, sequence
from smooth_joint_paths import ACCELERATION, VELOCITY, smooth_path

from robot_agent.model.description import PathLimits
from robot_agent.paths.legs import FlangeMove, legs
from robot_agent.paths.pose_path import pose_paths
from robot_agent.trajectory import Limits, Motion, PlanError, plan
from robot_agent.trajectory.timing import fastest

TOPPRA = json.loads((Path(__file__).parents[1] / "vectors" / "toppra.json").read_text())["durations_s"]
DT = 0.004


def limits(jerk_s: float) -> Limits:
    """The limits of the comparison; full acceleration after `jerk_s`."""
    return Limits(VELOCITY, ACCELERATION, ACCELERATION / jerk_s, PathLimits(*[1.0] * 6), 1.5)


def assert_inside_limits(motion: Motion) -> None:
    q = motion.q(np.arange(-3, int(motion.duration_s / DT) + 6) * DT)
    allowed = np.stack([LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk])
    for order in (1, 2, 3):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) / DT**order <= 1.001 * allowed[order - 1]).all()
    assert (motion.pieces.peaks() <= 1.001 * allowed).all()
    np.testing.assert_allclose(motion.qd(motion.rests), 0.0, atol=1e-9)
    # continuous velocity: no step where pieces meet
    knots = motion.pieces.knots[1:-1]
    np.testing.assert_allclose(motion.qd(knots - 1e-9), motion.qd(knots + 1e-9), atol=1e-6)


def planned(seed: int, longest: int) -> Motion | None:
    """None where the random poses leave the arm's reach or range."""
    try:
        return plan(MODEL, sequence(seed, longest), LIMITS, start=START)
    except PlanError:
        return None


@pytest.mark.parametrize("seed", range(0, 50, 10))
def test_without_a_limit_of_jerk_the_duration_is_that_of_topp_ra(seed: int) -> None:
    timed = fastest(smooth_path(seed), limits(1e-4))
    assert timed.pieces.duration_s <= 1.02 * TOPPRA[seed]
    peaks = timed.pieces.peaks()[:2] / np.stack([VELOCITY, ACCELERATION])
    assert peaks.max() <= 1.001


@pytest.mark.parametrize("seed", range(0, 50, 5))
def test_with_a_limit_of_jerk_the_duration_is_little_longer(seed: int) -> None:
    timed = fastest(smooth_path(seed), limits(0.1))
    assert timed.pieces.duration_s <= 1.15 * TOPPRA[seed] + 2 * 0.1
    peaks = timed.pieces.peaks() / np.stack([VELOCITY, ACCELERATION, 10.0 * ACCELERATION])
    assert peaks.max() <= 1.001


@pytest.mark.parametrize("seed", range(8))
def test_random_sequences_keep_every_limit(seed: int) -> None:
    motion = planned(seed, 6)
    if motion is not None:
        assert_inside_limits(motion)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(200))
def test_long_random_sequences_keep_every_limit(seed: int) -> None:
    motion = planned(1000 + seed, 20)
    if motion is not None:
        assert_inside_limits(motion)


@pytest.mark.parametrize("seed", [3, 4, 9])
def test_flange_stays_on_the_commanded_geometry(seed: int) -> None:
    moves = sequence(seed, 4, joint_moves=False)
    motion = plan(MODEL, moves, LIMITS, start=START)
    blocks: list[tuple[int, FlangeMove]] = list(enumerate(moves.blocks))  # type: ignore[arg-type]
    paths = pose_paths(legs(blocks, MODEL.forward(START)))
    places = [path.poses(np.linspace(0, path.length_m, int(path.length_m / 2e-4)))[:, :3, 3] for path in paths]
    curve = np.concatenate(places)
    start, way = curve[:-1], np.diff(curve, axis=0)
    flange = motion.pose(np.linspace(0.0, motion.duration_s, 400))[:, :3, 3]
    share = np.einsum("ijk,jk->ij", flange[:, None] - start, way) / np.maximum((way * way).sum(axis=1), 1e-18)
    nearest = start + np.clip(share, 0.0, 1.0)[..., None] * way
    assert np.linalg.norm(flange[:, None] - nearest, axis=2).min(axis=1).max() < 10e-6
