"""Timing along any path: as fast as the limits allow, and never faster."""

from dataclasses import replace

import numpy as np
import pytest
from random_moves import LIMITS, MODEL, START, sequence
from smooth_joint_paths import ACCELERATION, VELOCITY, smooth_path
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
from toppra.interpolator import AbstractGeometricPath

from robot_agent.model.description import PathLimits
from robot_agent.paths import Sequence
from robot_agent.paths.legs import FlangeMove, legs
from robot_agent.paths.pose_path import PosePath, pose_paths
from robot_agent.trajectory import Limits, Motion, PlanError, plan
from robot_agent.trajectory.affine import Affine
from robot_agent.trajectory.path_limits import Rows
from robot_agent.trajectory.reachable import fastest_speeds
from robot_agent.trajectory.timing import fastest

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


def by_toppra(seed: int) -> float:
    """Duration [s] that TOPP-RA finds along the same path, without a limit of jerk."""
    path = smooth_path(seed)
    grid = np.linspace(0.0, 1.0, 501)

    class Curve(AbstractGeometricPath):
        dof, path_interval, waypoints = 6, (0.0, 1.0), None

        def __call__(self, at: np.ndarray, order: int = 0) -> np.ndarray:
            return path.pieces.shape(np.asarray(at, dtype=float))[order, ..., :6]

    constraints = [
        JointVelocityConstraint(np.stack([-VELOCITY, VELOCITY], axis=1)),
        JointAccelerationConstraint(np.stack([-ACCELERATION, ACCELERATION], axis=1)),
    ]
    found = TOPPRA(constraints, Curve(), gridpoints=grid, solver_wrapper="seidel").compute_parameterization(0.0, 0.0)
    speed = np.asarray(found[1]).ravel()
    return float((2.0 * np.diff(grid) / (speed[1:] + speed[:-1])).sum())


@pytest.mark.parametrize("seed", range(50))
def test_duration_is_that_of_topp_ra_and_little_longer_with_a_limit_of_jerk(seed: int) -> None:
    shortest, path = by_toppra(seed), smooth_path(seed)
    for jerk_s, longest in ((2e-3, 1.02 * shortest), (0.1, 1.15 * shortest + 2 * 0.1)):
        allowed = limits(jerk_s)
        timed = fastest(path, allowed)
        assert timed.pieces.duration_s <= longest
        peaks = timed.pieces.peaks() / np.stack([allowed.velocity, allowed.acceleration, allowed.jerk])
        assert peaks.max() <= 1.001


def test_each_direction_of_a_joint_has_its_own_limit_of_acceleration() -> None:
    weaker = replace(limits(0.1), acceleration_down=0.4 * ACCELERATION)
    timed = fastest(smooth_path(3), weaker)
    used = timed.pieces.inside(5)[1]
    assert 0.99 <= (used / ACCELERATION).max() <= 1.001
    assert 0.99 <= (used / (-0.4 * ACCELERATION)).max() <= 1.001
    assert timed.pieces.duration_s > fastest(smooth_path(3), limits(0.1)).pieces.duration_s


def test_what_gravity_takes_of_a_limit_is_missing_on_one_side_only() -> None:
    at = np.linspace(0.0, 1.0, 401)
    ones, none = np.ones((401, 1)), np.zeros((401, 1))
    rows = Affine(ones, none, 0.5 * ones, -ones, ones).scaled()  # -1.5 <= s_ddot <= 0.5
    squared = fastest_speeds(at, Rows(rows, none, none, none, np.full(401, np.inf)))
    # up with 0.5, down with 1.5: the top is reached at three quarters of the way
    np.testing.assert_allclose(squared, np.minimum(2 * 0.5 * at, 2 * 1.5 * (1.0 - at)), atol=1e-9)


def test_limit_that_forbids_standing_still_is_refused() -> None:
    one = np.ones((1, 1))
    with pytest.raises(ValueError, match="standing still"):
        Affine(one, one, 2.0 * one, -one, one).scaled()


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


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(200))
def test_flange_stays_on_the_commanded_geometry_of_any_sequence(seed: int) -> None:
    moves = sequence(1000 + seed, 8, joint_moves=False)
    try:
        motion = plan(MODEL, moves, LIMITS, start=START)
    except PlanError:
        return
    # a corner between two paths that is rounded by the joints alone has no curve of the flange to compare with
    if len(motion.rests) == len(flange_paths(moves)) + 1:
        assert_on_its_geometry(moves, motion)


@pytest.mark.parametrize("seed", [3, 4, 9])
def test_flange_stays_on_the_commanded_geometry(seed: int) -> None:
    moves = sequence(seed, 4, joint_moves=False)
    assert_on_its_geometry(moves, plan(MODEL, moves, LIMITS, start=START))


def flange_paths(moves: Sequence) -> list[PosePath]:
    blocks: list[tuple[int, FlangeMove]] = list(enumerate(moves.blocks))  # type: ignore[arg-type]
    return pose_paths(legs(blocks, MODEL.forward(START)))


def assert_on_its_geometry(moves: Sequence, motion: Motion) -> None:
    paths = flange_paths(moves)
    # chords of 50 um leave a bend of 1 mm radius by less than 1 um
    places = [path.poses(np.linspace(0, path.length_m, int(path.length_m / 5e-5)))[:, :3, 3] for path in paths]
    curve = np.concatenate(places)
    for flange in motion.pose(np.linspace(0.0, motion.duration_s, 400))[:, :3, 3]:
        middle = int(np.square(curve - flange).sum(axis=1).argmin())
        near = curve[max(middle - 2, 0) : middle + 3]
        start, way = near[:-1], np.diff(near, axis=0)
        share = ((flange - start) * way).sum(axis=1) / np.maximum((way * way).sum(axis=1), 1e-18)
        nearest = start + np.clip(share, 0.0, 1.0)[:, None] * way
        assert np.linalg.norm(flange - nearest, axis=1).min() < 10e-6
