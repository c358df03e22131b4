"""Arc: the TCP on a circle through three points, or by so many degrees of it."""

import math
from dataclasses import dataclass

import numpy as np

from robot_agent.paths.caps import TcpCaps
from robot_agent.paths.curves import Circle, Numbers
from robot_agent.paths.line import SAME_PLACE_M
from robot_agent.paths.orientation import turn_between, turned

_COLLINEAR = 1e-6
"""Relative: below this the radius says more about rounding than about the points."""


@dataclass(frozen=True, slots=True, eq=False)
class Arc(TcpCaps):
    """Move the TCP on the circle through its start, `via_pose` and `target_pose`, both `(4, 4)`, in the robot base.

    Without `angle_rad` it ends in the target. With it the arc goes on (positive: from the start towards the via point)
    for that angle, any number of turns, and the target is only a point of the circle. The orientation passes through
    those of start, via and target wherever the arc passes their places. With `lift_m` it is a helix that ends so far
    beside the plane of the circle, on the side from which start, via and target are counter-clockwise.
    """

    via_pose: Numbers
    target_pose: Numbers
    line: int
    angle_rad: float | None = None
    speed_m_s: float | None = None
    lift_m: float = 0.0

    def __post_init__(self) -> None:
        self.check("arc", self.line, self.speed_m_s)
        if self.angle_rad is not None and not (math.isfinite(self.angle_rad) and self.angle_rad != 0.0):
            raise ValueError(f"arc move, line {self.line}: angle {self.angle_rad} rad found, allowed any but 0")


@dataclass(frozen=True, slots=True, eq=False)
class CircleGeometry:
    """The circle through three points, and at which angles [rad] the second and the third lie."""

    circle: Circle
    """From the first point; `angle_rad` reaches the third."""
    via_rad: float
    target_rad: float

    @classmethod
    def through(cls, first: Numbers, via: Numbers, target: Numbers) -> "CircleGeometry | None":
        """The circle through points `(3,)`; None where they lie on a line or coincide.

        Source: Frigeni, Industrial Robotics Control, (5-18) to (5-24). The angle is taken by arctangent, which needs
        none of the book's tests for more than half a turn; the printed test names the wrong pair of vectors.
        """
        a, b = via - first, target - first
        normal = np.cross(a, target - via)
        sides = [float(np.linalg.norm(each)) for each in (a, b, target - via)]
        if min(sides) < SAME_PLACE_M or np.linalg.norm(normal) <= _COLLINEAR * sides[0] * sides[2]:
            return None
        square = 2.0 * float(normal @ normal)
        centre = first + np.cross((a @ a) * b - (b @ b) * a, np.cross(a, b)) / square
        radius = float(np.linalg.norm(first - centre))
        u = (first - centre) / radius
        v = np.cross(normal / np.linalg.norm(normal), u)
        angles = [math.atan2(float(p @ v), float(p @ u)) % math.tau for p in (via - centre, target - centre)]
        return cls(Circle(centre, u, v, radius, angles[1]), *angles)


def evenly_turned(start: Numbers, via: Numbers, target: Numbers) -> Numbers:
    """The via pose `(4, 4)` with the orientation that an even turn from `start` to `target` has there."""
    geometry = CircleGeometry.through(start[:3, 3], via[:3, 3], target[:3, 3])
    share = 0.5 if geometry is None else geometry.via_rad / geometry.target_rad
    axis, angle = turn_between(start[:3, :3], target[:3, :3])
    pose = via.copy()
    pose[:3, :3] = turned(axis, np.array(share * angle)) @ start[:3, :3]
    return pose
