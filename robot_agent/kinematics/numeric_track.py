"""Joints along a path of poses for a robot without a closed form: from each piece of the path to the next."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cell.geometry.arrays import Array
from robot_agent.kinematics.errors import Reason, TrackError, Unreachable, Violation
from robot_agent.kinematics.tracking import LARGEST_STEP_RAD

if TYPE_CHECKING:
    from robot_agent.kinematics.numeric import NumericModel

PIECE = 32
"""Poses that are solved at once, all from the joints at the end of the piece before."""
BRANCH = "nearest"
"""Name of the only branch that a numeric solver follows."""


def track(model: NumericModel, poses: Array, start: Array) -> Array:
    """See `Model.track`; the path begins with the solution nearest to `start`."""
    try:
        first = model.solve(poses[0], near=start)
    except Unreachable as error:
        raise TrackError(0, poses[0], error.violation, BRANCH) from error
    joints = np.empty((len(poses), model.n))
    joints[0] = first
    known = 1
    while known < len(poses):
        piece = poses[known : known + PIECE]
        found = model.iterate(piece, np.tile(joints[known - 1], (len(piece), 1)))
        steps = np.abs(np.diff(np.concatenate([joints[known - 1 : known], found.joints]), axis=0)).max(axis=1)
        good = found.solved & (steps <= LARGEST_STEP_RAD)
        count = len(piece) if good.all() else int(np.argmin(good))
        if count == 0:
            raise TrackError(known, poses[known], _why(model, poses[known], joints[known - 1]), BRANCH)
        joints[known : known + count] = found.joints[:count]
        known += count
    return joints


def _why(model: NumericModel, pose: Array, before: Array) -> Violation:
    """What ends the path at a pose, behind the joints `before` `(n,)`."""
    solutions = model.inverse(pose, near=before)
    if not solutions.valid.any():
        return model.explain(pose, solutions)
    free = np.stack([before - np.pi, before + np.pi], axis=-1)
    found = model.iterate(pose[None], before[None], free)
    step = (found.joints[0] if found.solved[0] else solutions.joints[0]) - before
    joint = int(np.argmax(np.abs(step)))
    if found.solved[0] and np.abs(step).max() <= LARGEST_STEP_RAD:
        return model.limit_on_the_way(found.joints[0])
    return Violation(
        Reason.BRANCH_CHANGE, model.joint_names[joint], float(step[joint]), linear=bool(model.linear[joint])
    )
