"""Joints along a path of poses: one branch, continuous, and a clear word where that ends."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cell.geometry.arrays import Array
from robot_agent.kinematics.choice import joint_violation, reach_violation
from robot_agent.kinematics.errors import Reason, TrackError, Violation
from robot_agent.kinematics.solutions import Solutions
from robot_agent.kinematics.turns import LIMIT_TOLERANCE_RAD

if TYPE_CHECKING:
    from robot_agent.kinematics.model import Model

LARGEST_STEP_RAD = 0.5
"""More than this [rad or m] from one pose to the next is a jump. Paths are sampled far denser than that."""
TIE_RAD = 1e-6
"""Branches whose first solutions differ by less meet in the first pose: each may turn out to be the continuous one."""


def track(model: Model, poses: Array, start: Array) -> Array:
    """See `Model.track`."""
    solutions = model.inverse(poses, near=start)
    away = np.where(solutions.valid[0, :, None], np.abs(solutions.joints[0] - start), np.inf).max(axis=-1)
    nearest = away.min()
    if np.isinf(nearest):
        least = int(np.argmin(np.abs(solutions.excess_m[0])))
        raise TrackError(0, poses[0], _gap(solutions, 0, least), model.branches[least])
    failures = []
    for branch in np.flatnonzero(away <= nearest + TIE_RAD):
        try:
            return _follow(model, poses, start, solutions, int(branch))
        except TrackError as failure:
            failures.append(failure)
    raise max(failures, key=lambda failure: failure.index)


def _follow(model: Model, poses: Array, start: Array, solutions: Solutions, branch: int) -> Array:
    """One branch as far as it is valid; raises at the first pose where it is not, jumps, or leaves the limits."""
    valid = solutions.valid[:, branch]
    end = len(poses) if valid.all() else int(np.argmin(valid))
    joints = _hold_free_joints(model, poses[:end], start, solutions, branch)
    joints = model.continuous(joints)
    _check_steps_and_limits(model, poses, joints, branch)
    if end < len(poses):
        raise TrackError(end, poses[end], _gap(solutions, end, branch), model.branches[branch])
    return joints


def _gap(solutions: Solutions, index: int, branch: int) -> Violation:
    """Why a branch has no solution for one pose of the path."""
    if solutions.tilt_rad[index] > 0:
        return Violation(Reason.TILTED, tilt_rad=float(solutions.tilt_rad[index]))
    return reach_violation(float(solutions.excess_m[index, branch]))


def _hold_free_joints(model: Model, poses: Array, start: Array, solutions: Solutions, branch: int) -> Array:
    """Joints of one branch; in singular poses the free joint keeps its value of the last pose that determined it."""
    joints = solutions.joints[: len(poses), branch]
    singular = solutions.singular[: len(poses), branch]
    if not singular.any():
        return joints
    last = np.maximum.accumulate(np.where(singular, -1, np.arange(len(poses))))
    held = np.where((last >= 0)[:, None], joints[last], start)[singular]
    joints = joints.copy()
    joints[singular] = model.inverse(poses[singular], near=held).joints[:, branch]
    return joints


def _check_steps_and_limits(model: Model, poses: Array, joints: Array, branch: int) -> None:
    """Raise at the first jump or limit along continuous joints `(m, n)` of a branch."""
    violation = path_violation(model, joints)
    if violation is not None:
        index, found = violation
        raise TrackError(index, poses[index], found, model.branches[branch])


def path_violation(model: Model, joints: Array) -> tuple[int, Violation] | None:
    """The first jump, or limit that is left, along continuous joints `(m, n)`, with its index."""
    steps = np.diff(joints, axis=0)
    jumps = np.zeros(joints.shape, dtype=bool)
    jumps[1:] = np.abs(steps) > LARGEST_STEP_RAD
    lower, upper = model.limits.position.T
    outside = (joints < lower - LIMIT_TOLERANCE_RAD) | (joints > upper + LIMIT_TOLERANCE_RAD)
    failed = np.argwhere(jumps | outside)
    if failed.size == 0:
        return None
    index, joint = int(failed[0, 0]), int(failed[0, 1])
    if not jumps[index].any():
        return index, joint_violation(model, joint, float(joints[index, joint]))
    joint = int(np.argmax(np.abs(steps[index - 1])))
    step, linear = float(steps[index - 1, joint]), bool(model.linear[joint])
    return index, Violation(Reason.BRANCH_CHANGE, model.joint_names[joint], step, linear=linear)
