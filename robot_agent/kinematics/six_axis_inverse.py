"""Closed-form inverse of a six-axis arm with a spherical wrist, for all branches of many poses at once.

After Brandstoetter, Angerer and Hofbaur, "An analytical solution of the inverse kinematics problem of industrial serial
manipulators with an ortho-parallel basis and a spherical wrist" (2014), with two changes that keep full precision in
singular poses: the elbow triangle is solved by Heron's formula and one angle from the other, and J6 follows from J4, so
any J4 is consistent where only the sum or the difference of both is determined.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.triangle import beyond_reach, elbow_triangle

SINGULAR_SINE = 1e-10
"""Below this sine of J5 the axes 4 and 6 are one line."""
SINGULAR_RADIUS_M = 1e-10
"""A wrist this close to axis 1 leaves J1 free."""
ELBOW_SIGN = np.array([1.0, -1.0, -1.0, 1.0])[:, None]
"""Sign of the elbow triangle for FRONT/UP, FRONT/DOWN, BACK/UP, BACK/DOWN; UP is the elbow that lies above the line
from joint 2 to the wrist."""


@dataclass(frozen=True)
class Lengths:
    """Lengths of the links [m]; see `robot_agent.kinematics.six_axis`."""

    a1z: float
    a2x: float
    a2z: float
    a3z: float
    a4x: float
    a4z: float
    a5x: float
    a6x: float

    @cached_property
    def forearm(self) -> float:
        """From joint 3 to the wrist centre [m]."""
        return float(np.hypot(self.a4z, self.a4x + self.a5x))

    @cached_property
    def offsets(self) -> tuple[tuple[float, float], ...]:
        """Origin of each joint's frame in the frame before, along X and Z [m]."""
        return (
            (0.0, self.a1z),
            (self.a2x, self.a2z),
            (0.0, self.a3z),
            (self.a4x, self.a4z),
            (self.a5x, 0.0),
            (self.a6x, 0.0),
        )


@dataclass(frozen=True, slots=True)
class Arm:
    """Joints 1 to 3 for `p` poses."""

    j1: Array
    """`(2, p)` FRONT, BACK."""
    cos1: Array
    sin1: Array
    j2: Array
    """`(4, p)`, in the order of `ELBOW_SIGN`."""
    j3: Array
    excess: Array
    """`(2, p)` [m]: beyond the longest (positive) or shortest (negative) reach."""
    singular: Flags
    """`(p,)`: the wrist is on axis 1 and J1 is held."""


@dataclass(frozen=True, slots=True)
class Wrist:
    """Joints 4 to 6 for `p` poses."""

    angles: tuple[Array, Array, Array]
    """J4, J5, J6, each `(4, 2, p)`: slots of the arm x POSITIVE, NEGATIVE."""
    singular: Flags
    """`(4, p)`: J4 is held."""


def solve_arm(rows: Array, g: Lengths, held_j1: Array) -> Arm:
    """Joints 1 to 3. `rows` `(3, 4, p)`: upper rows of the poses; `held_j1` `(1,)` or `(p,)`."""
    wx, wy, wz = rows[:, 3] - g.a6x * rows[:, 0]
    radius = np.hypot(wx, wy)
    singular = radius < SINGULAR_RADIUS_M
    divisor = np.where(singular, 1.0, radius)
    front = np.where(singular, held_j1, np.arctan2(wy, wx))
    cos1 = np.where(singular, np.cos(held_j1), wx / divisor)
    sin1 = np.where(singular, np.sin(held_j1), wy / divisor)
    # On axis 1 both keep J1 where it is; elsewhere BACK looks the other way.
    mirror = np.where(singular, 1.0, -1.0)
    along = np.stack([radius, -radius]) - g.a2x
    up = wz - (g.a1z + g.a2z)
    span = np.hypot(along, up)
    beta, gamma = elbow_triangle(span, g.a3z, g.forearm)
    direction = np.arctan2(up, along)
    rest = np.arctan2(g.a4x + g.a5x, g.a4z)
    return Arm(
        j1=np.stack([front, np.where(singular, front, front + np.pi)]),
        cos1=np.stack([cos1, mirror * cos1]),
        sin1=np.stack([sin1, mirror * sin1]),
        j2=np.pi / 2 - _twice(direction) - ELBOW_SIGN * _twice(beta),
        j3=np.pi - rest - ELBOW_SIGN * _twice(gamma),
        excess=beyond_reach(span, g.a3z, g.forearm),
        singular=singular,
    )


def solve_wrist(rows: Array, arm: Arm, held_j4: Array) -> Wrist:
    """Joints 4 to 6 from what rotation the arm leaves to them: Rx(J4) Ry(J5) Rx(J6) = (Rz(J1) Ry(J2 + J3))^T R."""
    j23 = arm.j2 + arm.j3
    cos23, sin23 = np.cos(j23), np.sin(j23)
    forward = _twice(arm.cos1[:, None] * rows[0, :3] + arm.sin1[:, None] * rows[1, :3])
    aside = _twice(arm.cos1[:, None] * rows[1, :3] - arm.sin1[:, None] * rows[0, :3])
    r11 = cos23 * forward[:, 0] - sin23 * rows[2, 0]
    r2 = aside
    r3 = sin23[:, None] * forward + cos23[:, None] * rows[2, :3]
    sine = np.hypot(r2[:, 0], r3[:, 0])
    singular = sine < SINGULAR_SINE
    divisor = np.where(singular, 1.0, sine)
    sin4 = np.where(singular, np.sin(held_j4), r2[:, 0] / divisor)
    cos4 = np.where(singular, np.cos(held_j4), -r3[:, 0] / divisor)
    j4 = np.where(singular, held_j4, np.arctan2(r2[:, 0], -r3[:, 0]))
    # Second row of Rx(J4)^T R is (0, cos J6, -sin J6): well conditioned for every J5.
    j6 = np.arctan2(-cos4 * r2[:, 2] - sin4 * r3[:, 2], cos4 * r2[:, 1] + sin4 * r3[:, 1])
    j5 = np.arctan2(sin4 * r2[:, 0] - cos4 * r3[:, 0], r11)
    half_turn = np.where(singular, 0.0, np.pi)
    return Wrist(
        angles=(
            np.stack([j4, j4 + half_turn], axis=1),
            np.stack([j5, np.where(singular, j5, -j5)], axis=1),
            np.stack([j6, j6 + half_turn], axis=1),
        ),
        singular=singular,
    )


def _twice(values: Array) -> Array:
    """`(2, ...)` FRONT, BACK -> `(4, ...)`: each for both elbows."""
    return np.repeat(values, 2, axis=0)
