"""Spline: the TCP on a smooth curve through points; its control points follow from the points."""

from dataclasses import dataclass

import numpy as np

from robot_agent.paths.caps import TcpCaps
from robot_agent.paths.curves import Numbers

_TIGHTEST_M = 1e-5
_STANDING = 1e-6
_SAME_PLACE_M = 1e-7
"""The neighbours of a point are nearer to each other by rounding only, which gives the tangent no direction."""


@dataclass(frozen=True, slots=True, eq=False)
class Spline(TcpCaps):
    """Move the TCP through `poses` `(k, 4, 4)`, in the robot base, to the last of them.

    Consecutive splines of a sequence are one curve. Its tangent is parallel to the chord between the neighbours of a
    point; at its ends it is that of the line or arc before or after it, and without one it aims at the nearest point.
    A spline has no corners: it does not round its ends.
    """

    poses: Numbers
    line: int
    speed_m_s: float | None = None

    def __post_init__(self) -> None:
        self.check("spline", self.line, self.speed_m_s)


def control_points(points: Numbers, first: Numbers | None, last: Numbers | None) -> Numbers:
    """Control points `(k - 1, 4, 3)` of the cubic Bezier curves through `points` `(k, 3)`, no two neighbours equal.

    `first` and `last` are the unit tangents `(3,)` at the ends where neighbours give them. Source: Frigeni, Industrial
    Robotics Control, chapter 5: inner control points a third of the chord away, along the tangents.
    """
    chords = np.diff(points, axis=0)
    lengths = np.linalg.norm(chords, axis=1)
    tangents = np.empty_like(points)
    tangents[0] = chords[0] / lengths[0] if first is None else first
    tangents[-1] = chords[-1] / lengths[-1] if last is None else last
    across = points[2:] - points[:-2]
    wide = np.linalg.norm(across, axis=1)
    turning_back = wide < _SAME_PLACE_M
    across[turning_back] = chords[:-1][turning_back]
    tangents[1:-1] = across / np.linalg.norm(across, axis=1)[:, None]
    reach = lengths[:, None] / 3.0
    return np.stack(
        [points[:-1], points[:-1] + reach * tangents[:-1], points[1:] - reach * tangents[1:], points[1:]], 1
    )


def turns_back(controls: Numbers) -> bool:
    """Whether the cubic Bezier curve of `controls` `(4, 3)` has a cusp, or a bend of less than 10 um, inside.

    Both are where its derivative by its own parameter is shortest, which no robot passes but by all but standing still.
    """
    edges = 3.0 * np.diff(controls, axis=0)
    longest, ahead = np.linalg.norm(edges, axis=1).max(), controls[3] - controls[0]
    slowest = (edges @ ahead).min() / max(np.linalg.norm(ahead), 1e-300)  # along the chord; nowhere is it slower
    if slowest > _STANDING * longest and slowest**2 > 4.0 * _TIGHTEST_M * longest:
        return False
    first, middle, last = edges
    derivative = np.stack([first - 2.0 * middle + last, 2.0 * (middle - first), first])
    square = sum(np.convolve(each, each) for each in derivative.T)  # polymul would drop leading zeros
    u = np.roots(np.polyder(square))
    u = u.real[(np.abs(u.imag) < 1e-6) & (u.real > 0.0) & (u.real < 1.0)][:, None]
    way = (derivative[0] * u + derivative[1]) * u + derivative[2]
    speed = np.linalg.norm(way, axis=1)
    bend = np.linalg.norm(np.cross(way, 2.0 * derivative[0] * u + derivative[1]), axis=1)
    return bool(((speed < _STANDING * longest) | (speed**3 < _TIGHTEST_M * bend)).any())
