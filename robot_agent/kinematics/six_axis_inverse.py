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
from robot_agent.kinematics.triangle import Triangle, beyond_reach, elbow_triangle

SINGULAR_SINE = 1e-10
"""Below this sine of J5 the axes 4 and 6 are one line."""
SINGULAR_RADIUS_M = 1e-10
"""A wrist this close to axis 1 leaves J1 free."""
ELBOW_SIGN = np.array([[1.0, -1.0], [-1.0, 1.0]])[..., None]
"""Sign of the elbow triangle for FRONT, BACK x UP, DOWN; UP is the elbow that lies above the line from joint 2 to the
wrist."""


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
    def rest(self) -> float:
        """Angle between the forearm's own X axis and the line from joint 3 to the wrist centre [rad]."""
        return float(np.arctan2(self.a4x + self.a5x, self.a4z))

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


@dataclass(frozen=True, slots=True, eq=False)
class Arm:
    """Joints 1 to 3 for `p` poses."""

    j1: Array
    """`(2, p)` FRONT, BACK."""
    cos1: Array
    sin1: Array
    j2: Array
    """`(2, 2, p)`, in the order of `ELBOW_SIGN`."""
    j3: Array
    cos23: Array
    """`(2, 2, p)` of J2 + J3."""
    sin23: Array
    excess: Array
    """`(2, p)` [m]: beyond the longest (positive) or shortest (negative) reach."""
    singular: Flags
    """`(p,)`: the wrist is on axis 1 and J1 is held."""


@dataclass(frozen=True, slots=True, eq=False)
class Wrist:
    """Joints 4 to 6 for `p` poses."""

    j4: Array
    """`(2, 2, p)` with POSITIVE J5; the NEGATIVE wrist is `(j4 + half_turn, -j5, j6 + half_turn)`."""
    j5: Array
    j6: Array
    half_turn: Array
    """`(1,)` or `(2, 2, p)`: pi, and 0 where both wrists are one."""
    singular: Flags
    """`(2, 2, p)`: J4 is held."""


def solve_arm(rows: Array, g: Lengths, held_j1: Array) -> Arm:
    """Joints 1 to 3. `rows` `(3, 4, p)`: upper rows of the poses; `held_j1` `(1,)` or `(p,)`."""
    wx, wy, wz = rows[:, 3] - g.a6x * rows[:, 0]
    radius = np.sqrt(wx * wx + wy * wy)
    singular = radius < SINGULAR_RADIUS_M
    divisor = radius + singular
    j1, cos1, sin1 = np.empty((3, 2, len(wx)))
    np.arctan2(wy, wx, out=j1[0])
    np.divide(wx, divisor, out=cos1[0])
    np.divide(wy, divisor, out=sin1[0])
    np.add(j1[0], np.pi, out=j1[1])
    np.negative(cos1[0], out=cos1[1])
    np.negative(sin1[0], out=sin1[1])
    if singular.any():
        # On axis 1 both keep J1 where it is.
        held = np.broadcast_to(held_j1, singular.shape)[singular]
        j1[:, singular], cos1[:, singular], sin1[:, singular] = held, np.cos(held), np.sin(held)
    along = np.stack([radius, -radius]) - g.a2x
    up = wz - (g.a1z + g.a2z)
    span = np.sqrt(along * along + up * up)
    triangle = elbow_triangle(span, g.a3z, g.forearm)
    cos23, sin23 = _forearm_direction(along, up, span, triangle, g)
    direction = (np.pi / 2 - np.arctan2(up, along))[:, None]
    return Arm(
        j1=j1,
        cos1=cos1,
        sin1=sin1,
        j2=direction - ELBOW_SIGN * triangle.at_joint[:, None],
        j3=(np.pi - g.rest) - ELBOW_SIGN * triangle.at_elbow[:, None],
        cos23=cos23,
        sin23=sin23,
        excess=beyond_reach(span, g.a3z, g.forearm),
        singular=singular,
    )


def solve_wrist(rows: Array, arm: Arm, held_j4: Array) -> Wrist:
    """Joints 4 to 6 from what rotation the arm leaves to them: Rx(J4) Ry(J5) Rx(J6) = (Rz(J1) Ry(J2 + J3))^T R."""
    ahead = arm.cos1[:, None] * rows[0, :3] + arm.sin1[:, None] * rows[1, :3]
    aside = arm.cos1[:, None] * rows[1, :3] - arm.sin1[:, None] * rows[0, :3]
    r11 = arm.cos23 * ahead[:, None, 0] - arm.sin23 * rows[2, 0]
    r21, r22, r23 = (aside[:, None, k] for k in range(3))
    r31, r32, r33 = (arm.sin23 * ahead[:, None, k] + arm.cos23 * rows[2, k] for k in range(3))
    sine = np.sqrt(r21 * r21 + r31 * r31)
    singular = sine < SINGULAR_SINE
    divisor = sine + singular
    sin4, cos4 = r21 / divisor, -r31 / divisor
    j4 = np.arctan2(r21, -r31)
    half_turn = np.array([np.pi])
    if singular.any():
        held = np.broadcast_to(held_j4, singular.shape)[singular]
        j4[singular], sin4[singular], cos4[singular] = held, np.sin(held), np.cos(held)
        half_turn = np.where(singular, 0.0, np.pi)
    # Second row of Rx(J4)^T R is (0, cos J6, -sin J6): well conditioned for every J5.
    j6 = np.arctan2(-cos4 * r23 - sin4 * r33, cos4 * r22 + sin4 * r32)
    j5 = np.arctan2(sin4 * r21 - cos4 * r31, r11)
    return Wrist(j4=j4, j5=j5, j6=j6, half_turn=half_turn, singular=singular)


def _forearm_direction(along: Array, up: Array, span: Array, triangle: Triangle, g: Lengths) -> tuple[Array, Array]:
    """Cosine and sine of J2 + J3 `(2, 2, p)`, without trigonometric functions: they cost more than all the rest.

    J2 + J3 = K - (direction + sign * turn), with direction = atan2(up, along), turn the sum of the triangle's angles at
    joint 2 and at the elbow, and K = 3/2 pi - rest.
    """
    standing = span == 0
    divisor = span + standing
    cos_a, sin_a = (along + standing) / divisor, up / divisor
    cos_t = triangle.cos_joint * triangle.cos_elbow - triangle.sin_joint * triangle.sin_elbow
    sin_t = triangle.sin_joint * triangle.cos_elbow + triangle.cos_joint * triangle.sin_elbow
    cos_k, sin_k = float(np.cos(1.5 * np.pi - g.rest)), float(np.sin(1.5 * np.pi - g.rest))
    # The direction is turned by K first, then by the triangle to either side.
    cos_d, sin_d = cos_k * cos_a + sin_k * sin_a, sin_k * cos_a - cos_k * sin_a
    cos_c, sin_s = (cos_d * cos_t)[:, None], ELBOW_SIGN * (sin_d * sin_t)[:, None]
    sin_c, cos_s = (sin_d * cos_t)[:, None], ELBOW_SIGN * (cos_d * sin_t)[:, None]
    return cos_c + sin_s, sin_c - cos_s
