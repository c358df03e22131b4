"""All solutions of an inverse kinematics call."""

from dataclasses import dataclass

from cell.geometry.arrays import Array, Flags


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
