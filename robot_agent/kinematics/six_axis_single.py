"""The inverse of a six-axis arm for one pose, in plain floats: NumPy's calls alone would take ten times as long.

The formulas are those of `six_axis_inverse`, branch by branch.
"""

from dataclasses import dataclass
from math import atan2, ceil, cos, floor, hypot, nan, pi, sin, sqrt

from robot_agent.kinematics.six_axis_inverse import SINGULAR_RADIUS_M, SINGULAR_SINE, Lengths
from robot_agent.kinematics.triangle import REACH_TOLERANCE_M
from robot_agent.kinematics.turns import LIMIT_TOLERANCE_RAD, TURN

Row = list[float]
Ranges = list[tuple[float, float]]


@dataclass(slots=True)
class Slots:
    """Eight slots, in the order of the branches."""

    joints: list[Row]
    valid: list[bool]
    in_limits: list[bool]
    singular: list[bool]
    excess_m: list[float]


def solve_one(pose: list[Row], g: Lengths, near: Row, ranges: Ranges) -> Slots:
    """All branches for one pose `(4, 4)`; `ranges` are the limits of the joints."""
    (xx, _, _, x), (yx, _, _, y), (zx, _, _, z), _ = pose
    wx, wy, wz = x - g.a6x * xx, y - g.a6x * yx, z - g.a6x * zx
    radius = hypot(wx, wy)
    on_axis = radius < SINGULAR_RADIUS_M
    front = near[0] if on_axis else atan2(wy, wx)
    up = wz - g.a1z - g.a2z
    slots = Slots([], [], [], [], [])
    for side in (1.0, -1.0):
        j1 = front if side > 0 or on_axis else front + pi
        along = side * radius - g.a2x
        span = hypot(along, up)
        excess = _excess(span, g.a3z, g.forearm)
        if excess != 0:
            _add_nothing(slots, excess)
            continue
        at_joint, at_elbow = _triangle(span, g.a3z, g.forearm)
        direction, c1, s1 = pi / 2 - atan2(up, along), cos(j1), sin(j1)
        for sign in (side, -side):
            j2, j3 = direction - sign * at_joint, pi - g.rest - sign * at_elbow
            _add_wrists(slots, pose, (j1, j2, j3), (c1, s1), near, ranges, on_axis)
    return slots


def _add_wrists(
    slots: Slots,
    pose: list[Row],
    arm: tuple[float, float, float],
    turn1: tuple[float, float],
    near: Row,
    ranges: Ranges,
    on_axis: bool,
) -> None:
    """Both wrists of one arm: Rx(J4) Ry(J5) Rx(J6) = (Rz(J1) Ry(J2 + J3))^T R."""
    (x1, x2, x3, _), (y1, y2, y3, _), (z1, z2, z3, _), _ = pose
    c1, s1 = turn1
    c23, s23 = cos(arm[1] + arm[2]), sin(arm[1] + arm[2])
    a1, a2, a3 = c1 * x1 + s1 * y1, c1 * x2 + s1 * y2, c1 * x3 + s1 * y3
    r21, r22, r23 = c1 * y1 - s1 * x1, c1 * y2 - s1 * x2, c1 * y3 - s1 * x3
    r31, r32, r33 = s23 * a1 + c23 * z1, s23 * a2 + c23 * z2, s23 * a3 + c23 * z3
    sine = sqrt(r21 * r21 + r31 * r31)
    straight = sine < SINGULAR_SINE
    if straight:
        j4 = near[3]
        s4, c4 = sin(j4), cos(j4)
    else:
        j4, s4, c4 = atan2(r21, -r31), r21 / sine, -r31 / sine
    j6 = atan2(-c4 * r23 - s4 * r33, c4 * r22 + s4 * r32)
    j5 = atan2(s4 * r21 - c4 * r31, c23 * a1 - s23 * z1)
    other = (j4, j5, j6) if straight else (j4 + pi, -j5, j6 + pi)
    turned = [_turn(angle, near[i], *ranges[i]) for i, angle in enumerate(arm)]
    for wrist in ((j4, j5, j6), other):
        whole = turned + [_turn(angle, near[i], *ranges[i]) for i, angle in enumerate(wrist, 3)]
        slots.joints.append([value for value, _ in whole])
        slots.in_limits.append(all(inside for _, inside in whole))
        slots.valid.append(True)
        slots.singular.append(straight or on_axis)
        slots.excess_m.append(0.0)


def _add_nothing(slots: Slots, excess: float) -> None:
    slots.joints += [[nan] * 6] * 4
    slots.valid += [False] * 4
    slots.in_limits += [False] * 4
    slots.singular += [False] * 4
    slots.excess_m += [excess] * 4


def _excess(span: float, upper: float, fore: float) -> float:
    if span - (upper + fore) > REACH_TOLERANCE_M:
        return span - (upper + fore)
    near = abs(upper - fore) - span
    return -near if near > REACH_TOLERANCE_M else 0.0


def _triangle(span: float, upper: float, fore: float) -> tuple[float, float]:
    product = (upper + fore - span) * (upper + fore + span) * (span + upper - fore) * (span - upper + fore)
    sine = sqrt(max(product, 0.0)) / (2 * upper * fore)
    cosine = (upper * upper + fore * fore - span * span) / (2 * upper * fore)
    length = hypot(sine, cosine)
    return atan2(fore * sine / length, upper - fore * cosine / length), atan2(sine, cosine)


def _turn(angle: float, near: float, lower: float, upper: float) -> tuple[float, bool]:
    """As `turns.nearest_turn`."""
    least = ceil((lower - LIMIT_TOLERANCE_RAD - angle) / TURN)
    most = floor((upper + LIMIT_TOLERANCE_RAD - angle) / TURN)
    wished = round((near - angle) / TURN)
    if least > most:
        return angle + TURN * wished, False
    return angle + TURN * min(max(wished, least), most), True
