"""What a plan is asked for, looked at before anything is worked out from it. Everything here raises PlanError."""

import numpy as np
from numpy.typing import NDArray

from cell.geometry import GeometryError, check_poses
from robot_agent.kinematics import Model
from robot_agent.kinematics.choice import joint_violation
from robot_agent.paths import Arc, JointMove, Move, Spline
from robot_agent.paths.legs import TcpMove
from robot_agent.trajectory.errors import PlanError

_FARTHEST_M = 1000.0


def check_start(model: Model, first: Move, start: NDArray[np.float64]) -> None:
    """Whether `start` is `(n,)` and finite; it may be outside the range of a joint, which can then come back."""
    if start.shape != (model.n,) or not np.isfinite(start).all():
        reason = f"the start {start.tolist()} is not {model.n} finite joint values"
        raise PlanError(0, first.line, reason, _one_for_each_joint(model))


def check_target(model: Model, index: int, move: JointMove) -> None:
    """Whether the target is `(n,)` and finite."""
    found = np.asarray(move.target)
    if found.shape != (model.n,) or not np.isfinite(found).all():
        reason = f"the target {found.tolist()} is not {model.n} finite joint values"
        raise PlanError(index, move.line, reason, _one_for_each_joint(model))


def check_range(model: Model, index: int, move: JointMove, moving: NDArray[np.bool_]) -> None:
    """Whether joints that are `moving` `(n,)` end inside their range; one that stands outside may stay there."""
    for joint in np.flatnonzero(moving):
        name, value = model.joint_names[joint], move.target[joint]
        low, high = model.limits.position[joint]
        if not low - 1e-9 <= value <= high + 1e-9:
            reason = str(joint_violation(model, int(joint), float(value)))
            hint = "choose a target inside the joint's range"
            raise PlanError(index, move.line, reason, hint, joint=name, limit="position")


def check_poses_of(index: int, move: TcpMove) -> None:
    """Whether the TCP can have each pose of a move: a finite place and a right-handed rotation."""
    if isinstance(move, Spline):
        if move.poses.ndim != 3 or len(move.poses) == 0:
            reason = f"the points of the spline have the shape {move.poses.shape}"
            raise PlanError(index, move.line, reason, "give (k, 4, 4), at least one")
        named = {"points": move.poses}
    else:
        named = {"via_pose": move.via_pose} if isinstance(move, Arc) else {}
        named["target_pose"] = move.target_pose
    for name, poses in named.items():
        try:
            check_poses(poses, name)
        except GeometryError as error:
            raise PlanError(index, move.line, "there is no such pose", str(error)) from error
        farthest_m = float(np.abs(poses[..., :3, 3]).max())
        if farthest_m > _FARTHEST_M:
            reason = f"{name} has a coordinate of {farthest_m:g} m, allowed -{_FARTHEST_M:g} to {_FARTHEST_M:g} m"
            raise PlanError(index, move.line, reason, "name a place that the robot can reach")


def _one_for_each_joint(model: Model) -> str:
    return f"give one value for each of {', '.join(model.joint_names)}"
