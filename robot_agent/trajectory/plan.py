"""Planning: blocks of geometry become one motion within the limits, at rest between blocks."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.paths import JointMove, Sequence
from robot_agent.trajectory.errors import PlanError
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.line_timing import plan_line
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.pieces import Pieces
from robot_agent.trajectory.s_curve import s_curve

_NO_ZONE_S = 1e-12


def plan(
    model: Model, sequence: Sequence, limits: Limits, start: NDArray[np.float64], cycle_s: float = 0.004
) -> Motion:
    """The motion through all blocks of `sequence` from rest at joints `start` `(n,)`, at rest after each block.

    `cycle_s` is the period of the set points. Raises PlanError with block, program line, reason and, where they apply,
    joint, limit and pose.
    """
    q = np.array(start, dtype=np.float64)
    parts: list[Pieces] = []
    for index, block in enumerate(sequence.blocks):
        if isinstance(block, JointMove):
            part = _plan_joint_move(model, block, index, limits, q)
        else:
            part = plan_line(model, block, index, limits, q, cycle_s)
        parts.append(part)
        q = part.position(np.array(part.duration_s))
    ends = np.cumsum([part.duration_s for part in parts])
    moving = [part for part in parts if part.duration_s > 0.0] or parts[:1]
    return Motion(model, Pieces.joined(moving), ends, cycle_s)


def _plan_joint_move(model: Model, block: JointMove, index: int, limits: Limits, start: NDArray[np.float64]) -> Pieces:
    """One S-curve in the path parameter, its limits those of the joint that allows least."""
    _check_shape(model, block, index)
    travel = block.target - start
    moving = np.abs(travel) > 1e-12
    _check_range(model, block, index, moving)
    if not moving.any():
        return Pieces.standing(start)
    reach = np.abs(travel[moving])
    profile = s_curve(
        1.0,
        block.speed * float(np.min(limits.velocity[moving] / reach)),
        float(np.min(limits.acceleration[moving] / reach)),
        float(np.min(limits.jerk[moving] / reach)),
    )
    used = profile.zones > _NO_ZONE_S
    coefficients = np.zeros((int(used.sum()), 6, model.n))
    coefficients[:, :4] = (profile.states[used] / np.array([1.0, 1.0, 2.0, 6.0]))[..., None] * travel
    coefficients[:, 0] += start
    return Pieces(np.append(0.0, np.cumsum(profile.zones[used])), coefficients)


def _check_shape(model: Model, block: JointMove, index: int) -> None:
    found = np.asarray(block.target)
    if found.shape != (model.n,) or not np.isfinite(found).all():
        reason = f"the target {found.tolist()} is not {model.n} finite joint values"
        raise PlanError(index, block.line, reason, f"give one value for each of {', '.join(model.joint_names)}")


def _check_range(model: Model, block: JointMove, index: int, moving: NDArray[np.bool_]) -> None:
    """Refuse targets outside the range of a joint; one that already stands outside may stay there."""
    for joint in np.flatnonzero(moving):
        name, value, (low, high) = model.joint_names[joint], block.target[joint], model.limits.position[joint]
        if not low - 1e-9 <= value <= high + 1e-9:
            reason = f"joint {name} would go to {_shown(value)}, allowed {_shown(low)} to {_shown(high)}"
            hint = "choose a target inside the joint's range"
            raise PlanError(index, block.line, reason, hint, joint=name, limit="position")


def _shown(value: float) -> str:
    return f"{np.degrees(value):.2f} deg ({value:.4f} in SI)"
