"""Joints along a path that may change the branch where two branches meet."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model, Reason, TrackError
from robot_agent.kinematics.choice import reach_violation
from robot_agent.kinematics.errors import Violation
from robot_agent.trajectory.joints.joint_path import Numbers

_LARGEST_STEP_RAD = 0.5
_NEARLY_SINGULAR = 1e7
"""Condition of the Jacobian: from there on both branches are at the same place, as far as a path is followed."""


def any_branch(model: Model, poses: Numbers, start: Numbers) -> tuple[Numbers, NDArray[np.bool_]]:
    """Joints `(k, n)` at `poses` `(k, 4, 4)`: from pose to pose the solution that goes on best, of whatever branch.

    At a singular pose of the wrist J5 passes through 0 and changes its sign while J4 and J6 go on. What J4 and J6 are
    in that pose itself says nothing, so it is left out between its neighbours: beside the joints is which poses
    `(k,)` count. Raises TrackError.
    """
    joints, counts, before = np.empty((len(poses), model.n)), np.ones(len(poses), dtype=np.bool_), start
    for index, pose in enumerate(poses):
        solutions = model.inverse(pose, near=before)
        usable = solutions.valid & solutions.in_limits
        if not usable.any():
            least = int(np.argmin(np.abs(solutions.excess_m)))
            violation = reach_violation(float(solutions.excess_m[least]))
            raise TrackError(index, pose, violation, model.branches[least])
        away = np.where(usable[:, None], np.abs(solutions.joints - before), np.inf).max(axis=1)
        branch = int(np.argmin(away))
        joints[index] = solutions.joints[branch]
        inside = 0 < index < len(poses) - 1
        if inside and np.linalg.cond(model.flange_jacobian(joints[index])) > _NEARLY_SINGULAR:
            counts[index] = False
            continue
        moved = joints[index] - before
        if index and np.abs(moved).max() > _LARGEST_STEP_RAD:
            joint = int(np.argmax(np.abs(moved)))
            violation = Violation(Reason.BRANCH_CHANGE, model.joint_names[joint], float(moved[joint]))
            raise TrackError(index, pose, violation, model.branches[branch])
        before = joints[index]
    return joints, counts
