"""Trapezoids of the speed that begin and end together, as drives make them in their profile modes."""

import math
from collections.abc import Sequence

from robot_agent.model.description import ProfileKind
from robot_agent.trajectory.profile import Ramped


def trapezoid_in(distance: float, acceleration: float, duration_s: float) -> Ramped:
    """The trapezoid over `distance` (either sign) that takes exactly `duration_s` with `acceleration` (> 0).

    Raises ValueError where the acceleration is too low for that time: it must be 4 |distance| / duration_s^2 or more.
    """
    way = abs(distance)
    if way == 0.0:
        return Ramped(ProfileKind.TRAPEZOIDAL, distance, 0.0, 0.0, duration_s)
    square = duration_s**2 - 4.0 * way / acceleration
    if square < -1e-12 * duration_s**2:
        needed = 4.0 * way / duration_s**2
        raise ValueError(f"trapezoid: acceleration {acceleration:g} found, allowed from {needed:g} for that time")
    # (T - sqrt(T^2 - 4 d/a)) / 2 in the form that loses no digits
    ramp_s = min(2.0 * way / acceleration / (duration_s + math.sqrt(max(0.0, square))), duration_s / 2.0)
    speed = math.copysign(acceleration * ramp_s, distance)
    return Ramped(ProfileKind.TRAPEZOIDAL, distance, speed, ramp_s, duration_s - 2.0 * ramp_s)


def synchronised_trapezoids(
    distances: Sequence[float], speeds: Sequence[float], accelerations: Sequence[float]
) -> list[Ramped]:
    """One trapezoid for each axis, all as long as the slowest one takes at its own limits.

    The other axes keep their acceleration and cruise slower: v = a/2 (T - sqrt(T^2 - 4 |d| / a)). The limits are above
    0. An axis that takes less than v/a to its own speed has a triangle, which the source leaves out. Source: velocity
    trapezoid of profile modes, synchronised by their common duration.
    """
    limits = list(zip(distances, speeds, accelerations, strict=True))
    alone = (Ramped.fastest(ProfileKind.TRAPEZOIDAL, d, v, a, math.inf).duration_s if d else 0.0 for d, v, a in limits)
    duration_s = max(alone, default=0.0)
    return [trapezoid_in(d, a, duration_s) for d, _, a in limits]
