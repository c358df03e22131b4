"""Joints for poses by damped least squares within joint limits, for many starts at once.

Sugihara, "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method" (2011): the damping is the
squared error, so it vanishes at a solution and convergence is quadratic there. Joints at a limit that the step would
push further out are taken out of the step.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array, Flags

ITERATIONS = 60
DONE = 1e-11
"""Errors [m and rad] at which a row stops."""
GOOD = 1e-9
"""Errors up to which a row counts as solved when its iterations are used up."""
BIAS = 1e-14
"""Damping that is left at a solution; keeps redundant and singular robots solvable."""
LARGEST_STEP = 0.6
"""[rad or m] of a joint in one iteration."""


@dataclass(frozen=True, slots=True, eq=False)
class Found:
    """Where `p` starts led."""

    joints: Array
    """`(p, n)`, inside the limits."""
    away_m: Array
    """`(p,)` distance from the target."""
    away_rad: Array
    """`(p,)` angle from the target."""

    @property
    def solved(self) -> Flags:
        return np.asarray((self.away_m < GOOD) & (self.away_rad < GOOD))


def least_squares(
    pose_and_jacobian: Callable[[Array], tuple[Array, Array]],
    targets: Array,
    starts: Array,
    limits: Array,
    length_m: float,
    iterations: int = ITERATIONS,
) -> Found:
    """Joints `(p, n)` from `starts` `(p, n)` for `targets` `(p, 4, 4)`, inside `limits` `(n, 2)`.

    `pose_and_jacobian`: joints `(p, n)` -> flange `(p, 4, 4)` and `(p, 6, n)`; `length_m` makes metres and radians
    comparable.
    """
    lower, upper = limits.T
    q = np.clip(starts, lower, upper)
    away_m, away_rad = np.full(len(q), np.inf), np.full(len(q), np.inf)
    rows = np.arange(len(q))
    for _ in range(iterations):
        poses, jacobian = pose_and_jacobian(q[rows])
        error = pose_error(targets[rows], poses)
        away_m[rows], away_rad[rows] = np.linalg.norm(error[:, :3], axis=1), np.linalg.norm(error[:, 3:], axis=1)
        busy = (away_m[rows] > DONE) | (away_rad[rows] > DONE)
        rows, error, jacobian = rows[busy], error[busy], jacobian[busy]
        if not rows.size:
            break
        error[:, :3] /= length_m
        jacobian[:, :3] /= length_m
        step = _step(jacobian, error, q[rows], lower, upper)
        moved = np.clip(q[rows] + step, lower, upper)
        stuck = np.abs(moved - q[rows]).max(axis=1) < 1e-15
        q[rows] = moved
        rows = rows[~stuck]
    return Found(q, away_m, away_rad)


def pose_error(targets: Array, poses: Array) -> Array:
    """`(p, 6)`: the way [m] and the rotation vector [rad] from poses to targets, in base axes."""
    turn = targets[:, :3, :3] @ np.swapaxes(poses[:, :3, :3], -1, -2)
    skew = np.stack(
        [turn[:, 2, 1] - turn[:, 1, 2], turn[:, 0, 2] - turn[:, 2, 0], turn[:, 1, 0] - turn[:, 0, 1]], axis=-1
    )
    sine = np.linalg.norm(skew, axis=1) / 2
    angle = np.arctan2(sine, (np.trace(turn, axis1=1, axis2=2) - 1) / 2)
    half_turn = (sine < 1e-8) & (angle > 1)
    factor = np.where(sine < 1e-8, 0.5, angle / np.where(sine < 1e-8, 1.0, 2 * sine))
    vector = skew * factor[:, None]
    if half_turn.any():
        # A half turn has no skew part; its axis is any column of R + I.
        column = turn[half_turn] + np.eye(3)
        longest = np.linalg.norm(column, axis=1).argmax(axis=1)
        axis = np.take_along_axis(column, longest[:, None, None], axis=2)[..., 0]
        vector[half_turn] = np.pi * axis / np.linalg.norm(axis, axis=1, keepdims=True)
    return np.concatenate([targets[:, :3, 3] - poses[:, :3, 3], vector], axis=1)


def _step(jacobian: Array, error: Array, q: Array, lower: Array, upper: Array) -> Array:
    """Damped step `(p, n)` of the joints that may move."""
    slope = np.einsum("pij,pi->pj", jacobian, error)
    blocked = ((q >= upper) & (slope > 0)) | ((q <= lower) & (slope < 0))
    free = jacobian * ~blocked[:, None]
    damping = (error**2).sum(axis=1) / 2 + BIAS
    matrix = np.swapaxes(free, -1, -2) @ free + damping[:, None, None] * np.eye(q.shape[1])
    step = np.linalg.solve(matrix, np.where(blocked, 0.0, slope)[..., None])[..., 0]
    longest = np.abs(step).max(axis=1, keepdims=True)
    return np.asarray(step * np.minimum(1.0, LARGEST_STEP / np.maximum(longest, 1e-30)))
