"""The jerk-limited profile from rest to rest (S-curve)."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_JERK_SIGNS = np.array([1.0, 0.0, -1.0, 0.0, -1.0, 0.0, 1.0])


@dataclass(frozen=True, slots=True, eq=False)
class SCurve:
    """Seven zones of constant jerk; empty zones have no duration.

    Source: Frigeni, Industrial Robotics Control, (7-2) to (7-17). The book names two degenerate cases, a short path (no
    zone 4) and a very short one (zones 1, 3, 5, 7); the third is a path on which the speed is reached before the
    acceleration is (zones 1, 3, 4, 5, 7).
    """

    distance: float
    zones: NDArray[np.float64]
    """`(7,)` [s] durations."""
    speed: float
    """Top speed that is reached."""
    acceleration: float
    """Largest acceleration that is reached."""
    jerk: float
    starts: NDArray[np.float64]
    """`(8,)` [s] times at which the zones begin, and the end."""
    states: NDArray[np.float64]
    """`(7, 4)` position, velocity, acceleration, jerk at the beginning of each zone."""

    @property
    def duration_s(self) -> float:
        return float(self.starts[-1])

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Position, velocity, acceleration and jerk `(4, ...)` at times `t` `(...)` [s]; at rest outside the profile.

        At a border between zones the jerk is that of the later zone.
        """
        t = np.asarray(t, dtype=np.float64)
        zone = np.clip(np.searchsorted(self.starts, t, side="right") - 1, 0, 6)
        x = np.clip(t, 0.0, self.duration_s) - self.starts[zone]
        s, v, a, j = np.moveaxis(self.states[zone], -1, 0)
        position = s + x * (v + x * (a / 2.0 + x * j / 6.0))
        out = np.stack([position, v + x * (a + x * j / 2.0), a + x * j, j])
        out[1:, (t < 0.0) | (t >= self.duration_s)] = 0.0
        out[0, t >= self.duration_s] = self.distance
        return out


def s_curve(distance: float, speed: float, acceleration: float, jerk: float) -> SCurve:
    """The fastest profile over `distance` (>= 0) from rest to rest within the three limits (> 0, one unit of length).

    Raises ValueError for limits that are not positive and finite or a distance that is negative.
    """
    for name, value in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk)):
        if not (value > 0.0 and math.isfinite(value)):
            raise ValueError(f"s_curve: {name} {value} found, allowed a finite number above 0")
    if not (distance >= 0.0 and math.isfinite(distance)):
        raise ValueError(f"s_curve: distance {distance} found, allowed a finite number from 0")
    top = _top_speed(distance, speed, acceleration, jerk)
    peak = min(acceleration, math.sqrt(top * jerk))
    build = peak / jerk
    hold = max(0.0, top / peak - build) if peak == acceleration else 0.0
    ramp_length = top * (2.0 * build + hold) / 2.0
    cruise = max(0.0, distance - 2.0 * ramp_length) / top if top == speed else 0.0
    zones = np.array([build, hold, build, cruise, build, hold, build])
    starts = np.append(0.0, np.cumsum(zones))
    return SCurve(distance, zones, top, peak, jerk, starts, _states(distance, zones, top, jerk))


def _top_speed(distance: float, speed: float, acceleration: float, jerk: float) -> float:
    """The speed that is reached: the limit, or less on a path too short for it."""
    peak = min(acceleration, math.sqrt(speed * jerk))
    if distance >= speed * (speed / peak + peak / jerk):
        return speed
    jerk_time = acceleration / jerk
    if distance >= 2.0 * acceleration * jerk_time**2:
        # v (v/a + a/j) = distance, in the form that loses no digits
        return 2.0 * distance / (jerk_time + math.sqrt(jerk_time**2 + 4.0 * distance / acceleration))
    return jerk * math.cbrt(distance / (2.0 * jerk)) ** 2


def _states(distance: float, zones: NDArray[np.float64], top: float, jerk: float) -> NDArray[np.float64]:
    states = np.zeros((7, 4))
    states[:, 3] = jerk * _JERK_SIGNS
    for k in (0, 1, 3, 4, 5):
        x, (s, v, a, j) = zones[k], states[k]
        states[k + 1, :3] = s + x * (v + x * (a / 2 + x * j / 6)), v + x * (a + x * j / 2), a + x * j
        if k == 1:  # the cruise begins as far from the start as it ends from the end
            ramp = top * (2.0 * zones[0] + zones[1]) / 2.0
            states[3, :3] = ramp, top, 0.0
        if k == 3:
            states[4, :3] = distance - states[3, 0], top, 0.0
    return states
