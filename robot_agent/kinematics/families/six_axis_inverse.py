"""Closed-form inverse of a six-axis arm with a spherical wrist, for all branches of many poses at once.

After Brandstoetter, Angerer and Hofbaur, "An analytical solution of the inverse kinematics problem of industrial serial
manipulators with an ortho-parallel basis and a spherical wrist" (2014), with two changes that keep full precision in
singular poses: both angles of the elbow triangle come from one numerator, and J6 follows from J4, so any J4 is
consistent where only the sum or the difference of both is determined.

Sines and cosines of joints that are used further are ratios of lengths: trigonometric functions would cost more than
all the rest.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.families.triangle import beyond_reach, elbow_triangle

SINGULAR_SINE = 1e-10
"""Below this sine of J5 the axes 4 and 6 are one line."""
SINGULAR_RADIUS_M = 1e-10
"""A wrist this close to axis 1 leaves J1 free."""
FOLDED_SPAN_M = 1e-12
"""A wrist closer to joint 2 counts as this far ahead of it: then nothing divides by zero."""
ROUNDING_RAD2 = 4e-14
"""Of the square of the angle by which an elbow is bent: as much is some 1e-14 m of an arm's reach."""
NEARLY_STRETCHED_RAD = ROUNDING_RAD2 / (2.0 * SINGULAR_SINE)
"""From this angle on it is known to `SINGULAR_SINE`."""
SIDE = np.array([[1.0], [-1.0]])
"""Sign of the elbow for FRONT, BACK; UP is the elbow that lies above the line from joint 2 to the wrist."""


@dataclass(frozen=True)
class Lengths:
    """Lengths of the links [m]; see `robot_agent.kinematics.families.six_axis`."""

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
    def along_forearm(self) -> tuple[float, float]:
        """Cosine and sine of `rest`, per metre of forearm [1/m]."""
        return self.a4z / self.forearm**2, (self.a4x + self.a5x) / self.forearm**2

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
    """`(p,)` of FRONT."""
    sin1: Array
    sides: Array
    """`(2, 1)` or `(2, p)`: sign of `cos1` and `sin1` for FRONT, BACK; both alike where J1 is held."""
    j23: Array
    """`(2, 2, 2, p)`: J2 and J3 for FRONT, BACK x UP, DOWN."""
    cos23: Array
    """`(2, 2, p)` of J2 + J3."""
    sin23: Array
    excess: Array
    """`(2, p)` [m]: beyond the longest (positive) or shortest (negative) reach."""
    beside: Array | None
    """`(2, 2, p)` [rad]: J2 + J3 beside that of the stretched arm where it is nearly that, elsewhere NaN; None where it
    is so nowhere."""
    singular: Flags
    """`(p,)`: the wrist is on axis 1 and J1 is held."""


@dataclass(frozen=True, slots=True, eq=False)
class Wrist:
    """Joints 4 to 6 for `p` poses."""

    j456: Array
    """`(3, 2, 2, 2, p)`: of each arm both wrists, POSITIVE and NEGATIVE J5."""
    singular: Flags
    """`(2, 2, p)`: J4 is held and both wrists are one."""


def solve_arm(rows: Array, g: Lengths, held_j1: Array) -> Arm:
    """Joints 1 to 3. `rows` `(3 or 4, 4, p)`: elements of the poses; `held_j1` `(1,)` or `(p,)`."""
    wrist = rows[:3, 3] - g.a6x * rows[:3, 0]
    radius = np.sqrt(wrist[0] * wrist[0] + wrist[1] * wrist[1])
    j1, cos1, sin1, sides, on_axis = _shoulder(wrist, radius, held_j1)
    along = np.stack([radius, -radius])
    along -= g.a2x
    up = wrist[2] - (g.a1z + g.a2z)
    squared = along * along + up * up
    folded = squared < FOLDED_SPAN_M**2
    if folded.any():
        along = np.where(folded, FOLDED_SPAN_M, along)
        squared = along * along + up * up
    triangle = elbow_triangle(squared, g.a3z, g.forearm)
    j23, (cos23, sin23) = np.empty((2, 2, 2, 2, len(up)))
    _up_down(np.pi / 2 - np.arctan2(up, along), SIDE * triangle.at_joint, out=j23[0])
    _up_down(np.pi - g.rest, SIDE * triangle.at_elbow, out=j23[1])
    # The forearm runs from the elbow to the wrist: `share` of the span along it, and `across` of the span's length
    # square to it. Turned back by `rest` and divided by its length it is the direction of J2 + J3 from the vertical.
    share = 0.5 - (0.5 * (g.a3z - g.forearm) * (g.a3z + g.forearm)) / squared
    across = (0.5 * SIDE) * triangle.area4 / squared
    cos_rest, sin_rest = g.along_forearm
    ahead, upward = cos_rest * along - sin_rest * up, cos_rest * up + sin_rest * along
    _up_down(upward * share, ahead * across, out=cos23)
    _up_down(ahead * share, -upward * across, out=sin23)
    excess = beyond_reach(np.sqrt(squared), g.a3z, g.forearm)
    bent, beside = triangle.area4 / (2.0 * g.a3z * g.forearm), None
    stretched = (bent < NEARLY_STRETCHED_RAD) & (triangle.elbow < 0)
    if stretched.any():
        beside = np.empty_like(cos23)
        _up_down(0.0, np.where(stretched, -SIDE * bent * g.a3z / (g.a3z + g.forearm), np.nan), out=beside)
    return Arm(j1, cos1, sin1, sides, j23, cos23, sin23, excess, beside, on_axis)


def with_j4_held(rows: Array, arm: Arm, g: Lengths, held_j4: Array) -> Arm:
    """The arm with its stretched elbow turned, by no more than a pose leaves open, so that J4 has the value held.

    Only half the digits of such an elbow are known. Where J5 is as good as straight the others would decide over J4.
    `rows` and `held_j4` as in `solve_arm` and `solve_wrist`.
    """
    if arm.beside is None:
        return arm
    x, y, z = rows[0, 0], rows[1, 0], rows[2, 0]
    ahead = (arm.sides * (arm.cos1 * x + arm.sin1 * y))[:, None]
    r21 = (arm.sides * (arm.cos1 * y - arm.sin1 * x))[:, None]
    r11, r31 = arm.cos23 * ahead - arm.sin23 * z, arm.sin23 * ahead + arm.cos23 * z
    with np.errstate(divide="ignore", invalid="ignore"):
        turn, straight = (-r21 * np.cos(held_j4) / np.sin(held_j4) - r31) / r11, -r31 / r11
        free = ROUNDING_RAD2 * (g.a3z / (g.a3z + g.forearm)) ** 2
        turn = np.where((np.abs(r21) >= SINGULAR_SINE) | _within(arm.beside, turn, free), turn, straight)
        turn = np.where(_within(arm.beside, turn, free), turn, 0.0)
    # The wrist stays where it is: the upper arm turns the other way.
    share = g.forearm / g.a3z
    cosine, sine = np.cos(turn), np.sin(turn)
    return replace(
        arm,
        j23=arm.j23 + np.stack([-share * turn, (1.0 + share) * turn]),
        cos23=arm.cos23 * cosine - arm.sin23 * sine,
        sin23=arm.sin23 * cosine + arm.cos23 * sine,
    )


def solve_wrist(rows: Array, arm: Arm, held_j4: Array) -> Wrist:
    """Joints 4 to 6 from what rotation the arm leaves to them: Rx(J4) Ry(J5) Rx(J6) = (Rz(J1) Ry(J2 + J3))^T R."""
    x, y, z = rows[0, :3], rows[1, :3], rows[2, :3, None, None]
    # Of the plane of the arm: `(column, side, 1, p)`.
    ahead = (arm.sides * (arm.cos1 * x + arm.sin1 * y)[:, None])[:, :, None]
    aside = (arm.sides * (arm.cos1 * y - arm.sin1 * x)[:, None])[:, :, None]
    r11 = arm.cos23 * ahead[0] - arm.sin23 * z[0]
    r21, r22, r23 = aside
    r31, r32, r33 = arm.sin23 * ahead + arm.cos23 * z
    # Sine and cosine of J4 times that of J5, which cancels in J6.
    sin4, cos4 = r21, -r31
    sin5 = np.sqrt(r21 * r21 + r31 * r31)
    singular = sin5 < SINGULAR_SINE
    j456 = np.empty((3, 2, 2, 2, rows.shape[-1]))
    (j4, j5, j6), negative = j456[:, :, :, 0], j456[:, :, :, 1]
    np.arctan2(sin4, cos4, out=j4)
    if singular.any():
        np.copyto(j4, held_j4, where=singular)
        sin4, cos4 = np.where(singular, np.sin(j4), sin4), np.where(singular, np.cos(j4), cos4)
        sin5 = np.where(singular, sin4 * r21 - cos4 * r31, sin5)
    np.arctan2(sin5, r11, out=j5)
    # Second row of Rx(J4)^T R is (0, cos J6, -sin J6): well conditioned for every J5.
    np.arctan2(-cos4 * r23 - sin4 * r33, cos4 * r22 + sin4 * r32, out=j6)
    np.add(j4, np.pi, out=negative[0])
    np.negative(j5, out=negative[1])
    np.add(j6, np.pi, out=negative[2])
    if singular.any():
        np.copyto(negative, j456[:, :, :, 0], where=singular)
    return Wrist(j456, singular)


def _within(beside: Array, turn: Array, free: float) -> Flags:
    """Whether the square of an angle `beside` is changed by less than `free` where it is turned."""
    return np.abs((2.0 * beside + turn) * turn) < free


def _shoulder(wrist: Array, radius: Array, held_j1: Array) -> tuple[Array, Array, Array, Array, Flags]:
    """The first fields of `Arm`, and where the wrist is on axis 1: there both sides keep J1 where it is."""
    on_axis, sides = radius < SINGULAR_RADIUS_M, SIDE
    j1 = np.empty((2, len(radius)))
    np.arctan2(wrist[1], wrist[0], out=j1[0])
    np.add(j1[0], np.pi, out=j1[1])
    cos1, sin1 = wrist[:2] / (radius + on_axis)
    if on_axis.any():
        np.copyto(j1, held_j1, where=on_axis)
        cos1, sin1 = np.where(on_axis, np.cos(j1[0]), cos1), np.where(on_axis, np.sin(j1[0]), sin1)
        sides = np.where(on_axis, 1.0, SIDE)
    return j1, cos1, sin1, sides, on_axis


def _up_down(middle: Array | float, aside: Array, out: Array) -> None:
    """Elbow UP before the middle, DOWN after it: two `(2, p)` -> `(2, 2, p)`."""
    np.subtract(middle, aside, out=out[:, 0])
    np.add(middle, aside, out=out[:, 1])
