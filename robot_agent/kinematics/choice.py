"""Which of several solutions to take for one pose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.errors import Reason, UnknownName, Unreachable, Violation
from robot_agent.kinematics.solutions import Solutions

if TYPE_CHECKING:
    from robot_agent.kinematics.model import Model

TIE_RAD = 1e-6
"""Preferred joints that differ by less are equally good."""


def solve(model: Model, pose: Array, near: Array | None, branch: str | None, prefer: Mapping[str, float]) -> Array:
    """See `Model.solve`."""
    wanted = np.zeros(model.n) if near is None else model.check_joints(near, "near").copy()
    named = np.zeros(model.n, dtype=bool)
    for name, value in prefer.items():
        if name not in model.joint_names:
            raise UnknownName("preferred joint", name, model.joint_names)
        named[model.joint_names.index(name)] = True
        wanted[model.joint_names.index(name)] = value
    solutions = model.inverse(pose, near=wanted)
    allowed = _allowed(model.branches, branch)
    usable = allowed & solutions.valid & solutions.in_limits
    if not usable.any():
        raise Unreachable(pose, model.explain(pose, solutions, allowed), branch)
    away = np.where(usable[:, None], np.abs(solutions.joints - wanted), np.inf)
    first = np.rint(np.sqrt((away[:, named] ** 2).sum(axis=-1)) / TIE_RAD)
    rest = (away[:, ~named] ** 2).sum(axis=-1)
    best: Array = solutions.joints[np.lexsort((rest, first))[0]]
    return best


def why(model: Model, solutions: Solutions, allowed: Flags | None = None) -> Violation:
    """What rules out every allowed branch `(k,)` of one pose: a joint limit where one is in reach, else the reach."""
    if solutions.tilt_rad > 0:
        return Violation(Reason.TILTED, tilt_rad=float(solutions.tilt_rad))
    slots = np.ones(len(solutions.branches), dtype=bool) if allowed is None else allowed
    in_reach = np.flatnonzero(slots & solutions.valid)
    if in_reach.size:
        lower, upper = model.limits.position.T
        joints = solutions.joints[in_reach]
        beyond = np.maximum(np.maximum(lower - joints, joints - upper), 0).sum(axis=-1)
        violation = limit_violation(model, joints[int(np.argmin(beyond))])
        if violation is not None:
            return violation
    excess = solutions.excess_m[slots]
    least = float(excess[np.argmin(np.abs(excess))])
    return reach_violation(least)


def limit_violation(model: Model, joints: Array) -> Violation | None:
    """The joint of `(n,)` that is farthest outside its limits, if any is."""
    lower, upper = model.limits.position.T
    beyond = np.maximum(lower - joints, joints - upper)
    worst = int(np.argmax(beyond))
    return joint_violation(model, worst, float(joints[worst])) if beyond[worst] > 0 else None


def joint_violation(model: Model, joint: int, value: float) -> Violation:
    """A joint that would be at a value [rad or m] outside its limits."""
    lower, upper = model.limits.position[joint].tolist()
    linear = bool(model.linear[joint])
    return Violation(Reason.JOINT_LIMIT, model.joint_names[joint], value, (lower, upper), linear=linear)


def reach_violation(excess_m: float) -> Violation:
    """A pose whose wrist is outside the reach by `excess_m`: positive too far, negative too near."""
    return Violation(Reason.TOO_FAR if excess_m > 0 else Reason.TOO_NEAR, excess_m=abs(excess_m))


def _allowed(branches: tuple[str, ...], wanted: str | None) -> Flags:
    """Branches `(k,)` that have all parts of the wanted name."""
    parts = set(wanted.split("/")) if wanted else set()
    allowed = np.array([parts <= set(name.split("/")) for name in branches])
    if wanted is not None and not allowed.any():
        raise UnknownName("branch", wanted, branches)
    return allowed
