"""Which of several solutions to take for one pose."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import compress
from math import dist
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
    """See `Model.solve`. Plain floats: for a few slots of a few joints they are faster than arrays."""
    wanted = [0.0] * model.n if near is None else model.check_one(near, "near")
    for name, value in prefer.items():
        if name not in model.joint_names:
            raise UnknownName("preferred joint", name, model.joint_names)
        wanted[model.joint_names.index(name)] = value
    solutions = model.inverse(pose, near=np.array(wanted))
    allowed = None if not branch else _allowed(model.branches, branch)
    usable = solutions.in_limits if allowed is None else solutions.in_limits & allowed
    slots, joints = np.flatnonzero(usable).tolist(), solutions.joints.tolist()
    if not slots:
        raise Unreachable(pose, model.explain(pose, solutions, allowed), branch)
    named = [name in prefer for name in model.joint_names]
    others = [not preferred for preferred in named]

    def away(slot: int) -> tuple[int, float]:
        """Preferred joints first, in steps of `TIE_RAD`; the others break ties."""
        found = joints[slot]
        if not prefer:
            return 0, dist(found, wanted)
        first = dist([*compress(found, named)], [*compress(wanted, named)])
        return round(first / TIE_RAD), dist([*compress(found, others)], [*compress(wanted, others)])

    best: Array = solutions.joints[min(slots, key=away)]
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


def _allowed(branches: tuple[str, ...], wanted: str) -> Flags:
    """Branches `(k,)` that have all parts of the wanted name."""
    parts = set(wanted.split("/"))
    allowed = np.array([parts <= set(name.split("/")) for name in branches])
    if not allowed.any():
        raise UnknownName("branch", wanted, branches)
    return allowed
