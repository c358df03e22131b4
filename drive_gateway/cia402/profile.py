"""Trapezoids of speed that a drive runs by itself: their times, and the speeds with which axes arrive together."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt


@dataclass(frozen=True, slots=True)
class Trapezoid:
    """One axis from rest to rest. Signed as the distance; a triangle where the speed is not reached."""

    velocity: float
    """Highest velocity [1/s]."""
    duration_s: float
    stop_s: float
    """When braking begins."""


def trapezoid(distance: float, speed: float, acceleration: float) -> Trapezoid:
    """The shortest motion over `distance` within `speed` and `acceleration`, braking as hard as it accelerates.

    With d = |distance|: T = d / v + v / a; below d = v^2 / a the speed is sqrt(a d) and T = 2 sqrt(d / a).
    """
    way = abs(distance)
    peak = min(speed, sqrt(acceleration * way))
    ramp_s = peak / acceleration
    duration_s = way / peak + ramp_s if peak else 0.0
    return Trapezoid(peak if distance >= 0.0 else -peak, duration_s, duration_s - ramp_s)


def together(distances: Sequence[float], speeds: Sequence[float], accelerations: Sequence[float]) -> list[Trapezoid]:
    """All axes start and end together: the slowest one sets the time, the others go at a lower speed.

    In the time T an axis with the ramp a needs v = a / 2 (T - sqrt(T^2 - 4 d / a)), here without the difference of two
    almost equal numbers: 2 d / (T + sqrt(...)). T is the largest of the shortest times, so the root always exists.
    """
    shortest = [trapezoid(*axis) for axis in zip(distances, speeds, accelerations, strict=True)]
    duration_s = max((motion.duration_s for motion in shortest), default=0.0)
    return [
        _within(distance, acceleration, duration_s)
        for distance, acceleration in zip(distances, accelerations, strict=True)
    ]


def _within(distance: float, acceleration: float, duration_s: float) -> Trapezoid:
    root = sqrt(max(0.0, duration_s**2 - 4.0 * abs(distance) / acceleration))
    speed = 2.0 * abs(distance) / (duration_s + root) if duration_s else 0.0
    return Trapezoid(speed if distance >= 0.0 else -speed, duration_s, duration_s - speed / acceleration)
