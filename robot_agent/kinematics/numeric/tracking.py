"""Joints along a path of poses for a robot without a closed form: from each piece of the path to the next."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.choice import joint_violation
from robot_agent.kinematics.errors import Reason, TrackError, Unreachable, Violation
from robot_agent.kinematics.numeric.least_squares import ITERATIONS, Found
from robot_agent.kinematics.tracking import LARGEST_STEP_RAD

if TYPE_CHECKING:
    from robot_agent.kinematics.numeric.numeric_model import NumericModel

NEARBY = 15
"""Iterations for poses next to known joints: those that have a solution take fewer than ten."""
PIECE = 32
"""Poses that are solved at once, all from the joints at the end of the piece before."""
_STRIDE = 128
"""From pose to pose that many further on a long path is gone along first; the others begin between these."""
_HERE = 1e-6
"""[rad or m] no solution is nearer to known joints than one that is so near."""
BRANCH = "nearest"
"""Name of the only branch that a numeric solver follows."""


def track(model: NumericModel, poses: Array, start: Array) -> Array:
    """See `Model.track`; the path begins with the solution nearest to `start`."""
    found = model.iterate(poses[:1], start[None], None, NEARBY)
    first = found.joints[0]
    if not found.solved[0] or np.abs(first - start).max() > _HERE:
        try:
            first = model.solve(poses[0], near=start)
        except Unreachable as error:
            raise TrackError(0, poses[0], error.violation, BRANCH) from error
    joints = _at_once(model, poses, first)
    return _onward(model, poses, joints, _why, ITERATIONS)


def follow(model: NumericModel, poses: Array, start: Array) -> Array:
    """As `track` for poses that begin next to where the joints `start` are; never a search for other solutions.

    It costs little, also where the path cannot be followed: for loops that have to answer in time.
    """
    return _onward(model, poses, start[None], _why_from, NEARBY, 1)[1:]


def _at_once(model: NumericModel, poses: Array, first: Array) -> Array:
    """Joints `(k, n)` for the first `k` of poses `(m, 4, 4)`, of which the first ones are known: as many as go easily.

    Some of the poses are solved one after the other, all that lie between them together: each begins near its solution.
    """
    some = np.append(np.arange(0, len(poses) - 1, _STRIDE), len(poses) - 1)
    known = [first]
    for number in some[1:].tolist():
        ahead = known[-1] if len(known) == 1 else 2.0 * known[-1] - known[-2]
        found = model.iterate(poses[number : number + 1], ahead[None], None, NEARBY)
        if not found.solved[0]:
            break
        known.append(found.joints[0])
    count = int(some[len(known) - 1]) + 1
    at = np.arange(count)
    starts = np.column_stack([np.interp(at, some[: len(known)], each) for each in np.array(known).T])
    found = model.iterate(poses[:count], starts, None, NEARBY)
    good = _good(found, first[None])
    good[0] = True
    joints = found.joints[: count if good.all() else int(np.argmin(good))]
    joints[0] = first
    return joints


def _onward(
    model: NumericModel,
    poses: Array,
    known: Array,
    why: Callable[[NumericModel, Array, Array], Violation],
    iterations: int,
    before: int = 0,
) -> Array:
    """Joints `(before + m, n)` for poses `(m, 4, 4)`; the first rows are `known`, `before` of them before all poses."""
    joints = np.empty((before + len(poses), model.n))
    joints[: len(known)] = known
    count = len(known)
    while count < len(joints):
        targets = poses[count - before :][:PIECE]
        found = model.iterate(targets, np.tile(joints[count - 1], (len(targets), 1)), None, iterations)
        good = _good(found, joints[count - 1 : count])
        solved = len(targets) if good.all() else int(np.argmin(good))
        if solved == 0:
            raise TrackError(count - before, targets[0], why(model, targets[0], joints[count - 1]), BRANCH)
        joints[count : count + solved] = found.joints[:solved]
        count += solved
    return joints


def _good(found: Found, before: Array) -> Flags:
    """Which poses `(p,)` are solved without a jump from the one before, the first from joints `before` `(1, n)`."""
    steps = np.abs(np.diff(np.concatenate([before, found.joints]), axis=0)).max(axis=1)
    return np.asarray(found.solved & (steps <= LARGEST_STEP_RAD))


def _why(model: NumericModel, pose: Array, before: Array) -> Violation:
    """What ends the path at a pose, after the joints `before` `(n,)`."""
    solutions = model.inverse(pose, near=before)
    if not solutions.valid.any():
        return model.explain(pose, solutions)
    found = _without_limits(model, pose, before, ITERATIONS)
    return _change(model, before, found.joints[0] if found.solved[0] else solutions.joints[0])


def _why_from(model: NumericModel, pose: Array, before: Array) -> Violation:
    """The same by what is found from there alone."""
    found = _without_limits(model, pose, before, NEARBY)
    if found.solved[0]:
        return _change(model, before, found.joints[0])
    lower, upper = model.limits.position.T
    nearest = model.iterate(pose[None], before[None], None, NEARBY).joints[0]
    if (held := (nearest <= lower) | (nearest >= upper)).any():
        joint = int(np.argmax(held))
        return joint_violation(model, joint, float(nearest[joint]))
    return Violation(Reason.NOT_FOUND, excess_m=float(found.away_m[0]), tilt_rad=float(found.away_rad[0]))


def _without_limits(model: NumericModel, pose: Array, before: Array, iterations: int) -> Found:
    """What is found from joints `before` `(n,)` if they had no limits."""
    return model.iterate(pose[None], before[None], np.stack([before - np.pi, before + np.pi], axis=-1), iterations)


def _change(model: NumericModel, before: Array, joints: Array) -> Violation:
    """Why the robot does not go from joints `before` `(n,)` to others: a jump, or a limit."""
    step = joints - before
    joint = int(np.argmax(np.abs(step)))
    if np.abs(step[joint]) <= LARGEST_STEP_RAD:
        return model.limit_on_the_way(joints)
    return Violation(
        Reason.BRANCH_CHANGE, model.joint_names[joint], float(step[joint]), linear=bool(model.linear[joint])
    )
