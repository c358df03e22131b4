"""Timing along any path: as fast as the limits allow, and never faster."""

from dataclasses import replace

import numpy as np
import pytest
from toppra.algorithm import TOPPRA
from toppra.constraint import JointAccelerationConstraint, JointVelocityConstraint
from toppra.interpolator import AbstractGeometricPath

from robot_agent.model.description import PathSpeeds
from robot_agent.trajectory import Limits
from robot_agent.trajectory.timing.affine import Affine
from robot_agent.trajectory.timing.optimal.reachability import fastest_speeds
from robot_agent.trajectory.timing.optimal.time_optimal import fastest, fastest_of
from robot_agent.trajectory.timing.path_limits import Rows
from tests.unit.random_moves import MODEL
from tests.unit.smooth_joint_paths import ACCELERATION, VELOCITY, smooth_path


def limits(jerk_s: float) -> Limits:
    """The limits of the comparison; full acceleration after `jerk_s`."""
    return Limits(VELOCITY, ACCELERATION, ACCELERATION / jerk_s, PathSpeeds(*[1.0] * 6), 1.5)


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


@pytest.mark.parametrize("seed", [*range(20), *(pytest.param(seed, marks=pytest.mark.soak) for seed in range(20, 50))])
def test_duration_is_that_of_topp_ra_and_little_longer_with_a_limit_of_jerk(seed: int) -> None:
    shortest, path = by_toppra(seed), smooth_path(seed)
    for jerk_s, longest in ((2e-3, 1.02 * shortest), (0.1, 1.15 * shortest + 2 * 0.1)):
        allowed = limits(jerk_s)
        timed = fastest(MODEL, path, allowed)
        assert timed.pieces.duration_s <= longest
        peaks = timed.pieces.peaks() / np.stack([allowed.velocity, allowed.acceleration, allowed.jerk])
        assert peaks.max() <= 1.001


def test_each_direction_of_a_joint_has_its_own_limit_of_acceleration() -> None:
    weaker = replace(limits(0.1), acceleration_down=0.4 * ACCELERATION)
    timed = fastest(MODEL, smooth_path(3), weaker)
    used = timed.pieces.inside(5)[1]
    assert 0.99 <= (used / ACCELERATION).max() <= 1.001
    assert 0.99 <= (used / (-0.4 * ACCELERATION)).max() <= 1.001
    assert timed.pieces.duration_s > fastest(MODEL, smooth_path(3), limits(0.1)).pieces.duration_s


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


def test_paths_timed_together_take_as_long_as_each_by_itself() -> None:
    # the second and the last exceed a limit between places at first: they are searched again, the others not
    paths, allowed = [smooth_path(seed) for seed in (0, 13, 14, 2)], limits(0.1)
    together = [timed.pieces.duration_s for timed in fastest_of(MODEL, paths, allowed)]
    alone = [fastest(MODEL, path, allowed).pieces.duration_s for path in paths]
    np.testing.assert_allclose(together, alone, rtol=7e-3)  # the gap and the slowing down that a search may end with
