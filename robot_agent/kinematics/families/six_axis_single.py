"""The inverse of a six-axis arm for one pose, in plain floats: NumPy's calls alone would take ten times as long.

The formulas are those of `six_axis_inverse`, branch by branch. What branches share is computed once, and the turns of
joints are written out: a call for each of them would take longer than all formulas.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from math import atan2, ceil, cos, nan, pi, remainder, sin, sqrt

from robot_agent.kinematics.families.six_axis_inverse import (
    FOLDED_SPAN_M,
    NEARLY_STRETCHED_RAD,
    ROUNDING_RAD2,
    SINGULAR_RADIUS_M,
    SINGULAR_SINE,
    Lengths,
)
from robot_agent.kinematics.families.triangle import REACH_TOLERANCE_M
from robot_agent.kinematics.turns import LIMIT_TOLERANCE_RAD, TURN

Row = tuple[float, float, float]
NO_JOINTS = [nan] * 24


@dataclass(slots=True)
class Slots:
    """Eight slots, in the order of the branches."""

    joints: list[float] = field(default_factory=list)
    """Six for each slot, one slot after the other."""
    valid: list[bool] = field(default_factory=list)
    in_limits: list[bool] = field(default_factory=list)
    singular: list[bool] = field(default_factory=list)
    excess_m: list[float] = field(default_factory=list)

    def add_side(self, valid: bool, excess_m: float) -> None:
        """The reach of the four slots of FRONT or BACK."""
        self.valid += (valid, valid, valid, valid)
        self.excess_m += (excess_m, excess_m, excess_m, excess_m)


class SingleInverse:
    """All branches of one arm for one pose after the other."""

    def __init__(self, g: Lengths, limits: Sequence[Sequence[float]]) -> None:
        """`limits`: lower and upper bound of each joint."""
        self._a2x, self._a6x, self._height = g.a2x, g.a6x, g.a1z + g.a2z
        self._longest, self._shortest = g.a3z + g.forearm, abs(g.a3z - g.forearm)
        # Of the elbow triangle: see `triangle.elbow_triangle`.
        self._triangle = (
            self._longest**2,
            self._shortest**2,
            (g.a3z - g.forearm) * (g.a3z + g.forearm),
            g.a3z * g.a3z + g.forearm * g.forearm,
        )
        self._forearm = pi - g.rest, *g.along_forearm
        # Of a nearly stretched arm: four times its area at most, J2 + J3 beside the stretched arm's by that area, the
        # rounding of its square, and how far the upper arm turns back where the forearm turns.
        by_area = 1.0 / (2.0 * g.forearm * self._longest)
        self._nearly_stretched = 2.0 * g.a3z * g.forearm * NEARLY_STRETCHED_RAD
        self._beside = by_area, ROUNDING_RAD2 * (g.a3z / self._longest) ** 2, g.forearm / g.a3z
        ranges = [(lower - LIMIT_TOLERANCE_RAD, upper + LIMIT_TOLERANCE_RAD) for lower, upper in limits]
        self._ranges1, self._ranges2, self._ranges3 = ranges[:3]
        self._wrist_ranges = tuple(bound for both in ranges[3:] for bound in both)

    def solve(self, pose: list[list[float]], near: Sequence[float]) -> Slots:
        """The slots for `pose`, by rows; free joints and turns as in `near`."""
        (x1, x2, x3, x), (y1, y2, y3, y), (z1, z2, z3, z), _ = pose
        wx, wy, up = x - self._a6x * x1, y - self._a6x * y1, z - self._a6x * z1 - self._height
        radius = sqrt(wx * wx + wy * wy)
        on_axis = radius < SINGULAR_RADIUS_M
        if on_axis:
            j1, c1, s1 = near[0], cos(near[0]), sin(near[0])
        else:
            j1, c1, s1 = atan2(wy, wx), wx / radius, wy / radius
        # Rows of the pose ahead in the plane of the arm, aside of it, and up.
        a1, a2, a3 = c1 * x1 + s1 * y1, c1 * x2 + s1 * y2, c1 * x3 + s1 * y3
        b1, b2, b3 = c1 * y1 - s1 * x1, c1 * y2 - s1 * x2, c1 * y3 - s1 * x3
        front = a1, a2, a3, b1, b2, b3, z1, z2, z3
        back = front if on_axis else (-a1, -a2, -a3, -b1, -b2, -b3, z1, z2, z3)
        slots = Slots()
        self._add_side(slots, 1.0, j1, radius - self._a2x, up, front, near, on_axis)
        self._add_side(slots, -1.0, j1 if on_axis else j1 + pi, -radius - self._a2x, up, back, near, on_axis)
        return slots

    def _add_side(
        self,
        slots: Slots,
        side: float,
        j1: float,
        along: float,
        up: float,
        rows: tuple[float, ...],
        near: Sequence[float],
        on_axis: bool,
    ) -> None:
        """Both elbows of FRONT (side 1) or BACK (-1); `along` and `up`: from joint 2 to the wrist centre."""
        squared = along * along + up * up
        if squared < FOLDED_SPAN_M**2:
            along, squared = FOLDED_SPAN_M, FOLDED_SPAN_M**2 + up * up
        span = sqrt(squared)
        if not self._shortest - REACH_TOLERANCE_M <= span <= self._longest + REACH_TOLERANCE_M:
            slots.add_side(False, span - (self._longest if span > self._longest else self._shortest))
            slots.joints += NO_JOINTS
            slots.in_limits += (False, False, False, False)
            slots.singular += (False, False, False, False)
            return
        slots.add_side(True, 0.0)
        longest, shortest, difference, both = self._triangle
        area = (longest - squared) * (squared - shortest)
        area4 = side * sqrt(area) if area > 0 else 0.0
        at_joint, at_elbow = atan2(area4, squared + difference), atan2(area4, both - squared)
        share, across = 0.5 - 0.5 * difference / squared, 0.5 * area4 / squared
        elbow, cos_rest, sin_rest = self._forearm
        ahead, upward = cos_rest * along - sin_rest * up, cos_rest * up + sin_rest * along
        cosine, sine, cos_off, sin_off = upward * share, ahead * share, ahead * across, upward * across
        j1, fits = _turned(j1, near[0], self._ranges1)
        direction = pi / 2 - atan2(up, along)
        arm = j1, direction - at_joint, elbow - at_elbow
        stretched = abs(area4) < self._nearly_stretched and squared > both
        forearm = cosine - cos_off, sine + sin_off
        if stretched:
            arm, forearm = self._with_j4_held(arm, forearm, area4, rows, near[3])
        self._add_wrists(slots, arm, fits, *forearm, rows, near, on_axis)
        arm = j1, direction + at_joint, elbow + at_elbow
        forearm = cosine + cos_off, sine - sin_off
        if stretched:
            arm, forearm = self._with_j4_held(arm, forearm, -area4, rows, near[3])
        self._add_wrists(slots, arm, fits, *forearm, rows, near, on_axis)

    def _with_j4_held(
        self, arm: Row, forearm: tuple[float, float], area4: float, rows: tuple[float, ...], held_j4: float
    ) -> tuple[Row, tuple[float, float]]:
        """See `six_axis_inverse.with_j4_held`: the joints of the arm, cosine and sine of J2 + J3."""
        (c23, s23), (a1, _, _, r21, _, _, z1, _, _), (j1, j2, j3) = forearm, rows, arm
        s4, r11, r31 = sin(held_j4), c23 * a1 - s23 * z1, s23 * a1 + c23 * z1
        by_area, free, back = self._beside
        beside = area4 * by_area
        for want in (0.0 if s4 == 0.0 else -r21 * cos(held_j4) / s4, 0.0):
            turn = (want - r31) / r11 if r11 else 1.0
            fits = abs((2.0 * beside + turn) * turn) < free
            if fits or abs(r21) >= SINGULAR_SINE:
                break
        if not fits or (s4 == 0.0 and abs(r21) >= SINGULAR_SINE):
            return arm, forearm
        c, s = cos(turn), sin(turn)
        return (j1, j2 - back * turn, j3 + (1.0 + back) * turn), (c23 * c - s23 * s, s23 * c + c23 * s)

    def _add_wrists(
        self,
        slots: Slots,
        arm: Row,
        fits: bool,
        c23: float,
        s23: float,
        rows: tuple[float, ...],
        near: Sequence[float],
        on_axis: bool,
    ) -> None:
        """Both wrists of one arm: Rx(J4) Ry(J5) Rx(J6) = (Rz(J1) Ry(J2 + J3))^T R; `fits`: J1 is inside its limits."""
        a1, a2, a3, r21, r22, r23, z1, z2, z3 = rows
        r31, r32, r33 = s23 * a1 + c23 * z1, s23 * a2 + c23 * z2, s23 * a3 + c23 * z3
        _, near2, near3, near4, near5, near6 = near
        s4, c4, s5 = r21, -r31, sqrt(r21 * r21 + r31 * r31)
        straight = s5 < SINGULAR_SINE
        if straight:
            s4, c4 = sin(near4), cos(near4)
            s5, j4 = s4 * r21 - c4 * r31, near4
        else:
            j4 = atan2(s4, c4)
        j5, j6 = atan2(s5, c23 * a1 - s23 * z1), atan2(-c4 * r23 - s4 * r33, c4 * r22 + s4 * r32)
        j1, j2, j3 = arm
        j2, fits2 = _turned(j2, near2, self._ranges2)
        j3, fits3 = _turned(j3, near3, self._ranges3)
        fits = fits and fits2 and fits3
        low4, top4, low5, top5, low6, top6 = self._wrist_ranges
        for _ in "+-":
            q4 = near4 + remainder(j4 - near4, TURN)
            if not low4 <= q4 <= top4:
                q4 = _other_turn(q4, low4, top4)
            q5 = near5 + remainder(j5 - near5, TURN)
            if not low5 <= q5 <= top5:
                q5 = _other_turn(q5, low5, top5)
            q6 = near6 + remainder(j6 - near6, TURN)
            if not low6 <= q6 <= top6:
                q6 = _other_turn(q6, low6, top6)
            slots.joints += (j1, j2, j3, q4, q5, q6)
            slots.in_limits.append(fits and low4 <= q4 <= top4 and low5 <= q5 <= top5 and low6 <= q6 <= top6)
            slots.singular.append(straight or on_axis)
            if not straight:
                j4, j5, j6 = j4 + pi, -j5, j6 + pi


def _turned(angle: float, near: float, limits: tuple[float, float]) -> tuple[float, bool]:
    """As `turns.nearest_turn`; `limits` with their tolerance."""
    lower, upper = limits
    angle = near + remainder(angle - near, TURN)
    if lower <= angle <= upper:
        return angle, True
    angle = _other_turn(angle, lower, upper)
    return angle, lower <= angle <= upper


def _other_turn(angle: float, lower: float, upper: float) -> float:
    """The turn inside the limits, where there is one, of the nearest turn that lies outside them."""
    if angle < lower:
        other = angle + TURN * ceil((lower - angle) / TURN)
        return other if other <= upper else angle
    other = angle - TURN * ceil((angle - upper) / TURN)
    return other if other >= lower else angle
