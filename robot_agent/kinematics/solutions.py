"""All solutions of an inverse kinematics call."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.turns import nearest_turn, within

if TYPE_CHECKING:
    from robot_agent.kinematics.model import Model


@dataclass(frozen=True, slots=True, eq=False)
class Solutions:
    """Joints for poses `(..., 4, 4)`, one slot per branch; `k` branches, `n` joints. Slots without a solution are NaN.

    Where two branches meet (a singular pose) both slots hold the same joints.
    """

    joints: Array
    """`(..., k, n)` [rad or m], each at the turn nearest to `near` that lies inside its limits."""
    valid: Flags
    """`(..., k)`: the branch has a solution."""
    in_limits: Flags
    """`(..., k)`: it lies inside all joint limits."""
    singular: Flags
    """`(..., k)`: a joint is not determined by the pose and holds its value of `near`."""
    excess_m: Array
    """`(..., k)`: how far the wrist is too far away (positive) or too near (negative) for this branch; 0 in reach."""
    branches: tuple[str, ...]
    complete: bool
    """These are all solutions that exist."""
    tilt_rad: Array
    """`(...)`: how far the orientation is from one that the robot can take; always 0 with six degrees of freedom."""


@dataclass(frozen=True, slots=True, eq=False)
class Raw:
    """Solutions of `p` poses before turns and limits; every array broadcasts to `(k, p)`."""

    joints: Sequence[Array]
    """One array per joint."""
    excess_m: Array
    singular: Flags
    tilt_rad: Array | None = None
    """`(p,)`; None: any orientation will do."""


def finished(model: Model, raw: Raw, held: Array, leading: tuple[int, ...]) -> Solutions:
    """Bring joints to their turns, check limits, and shape everything for the poses `(*leading, 4, 4)`.

    `held` `(n, 1)` or `(n, p)`: the joints to whose turns the solutions are brought.
    """
    count, slots = int(np.prod(leading, dtype=int)), len(model.branches)
    shape = (slots, count)
    tilt = np.zeros(count) if raw.tilt_rad is None else raw.tilt_rad
    valid = np.broadcast_to((raw.excess_m == 0) & (tilt == 0), shape).T
    joints, in_limits = np.empty((count, slots, model.n)), valid.copy()
    for i, values in enumerate(raw.joints):
        if model.linear[i]:
            placed, inside = values, within(values, *model.limits.position[i])
        else:
            placed, inside = nearest_turn(values, held[i], *model.limits.position[i])
        joints[..., i] = np.broadcast_to(placed, shape).T
        in_limits &= np.broadcast_to(inside, shape).T
    joints[~valid] = np.nan
    singular = np.broadcast_to(raw.singular, shape).T & valid
    excess = np.broadcast_to(raw.excess_m, shape).T
    return Solutions(
        joints=joints.reshape(*leading, slots, model.n),
        valid=valid.reshape(*leading, slots),
        in_limits=in_limits.reshape(*leading, slots),
        singular=singular.reshape(*leading, slots),
        excess_m=excess.reshape(*leading, slots),
        branches=model.branches,
        complete=True,
        tilt_rad=tilt.reshape(leading),
    )
