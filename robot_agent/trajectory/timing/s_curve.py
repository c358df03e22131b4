"""The jerk-limited profile (S-curve), from any speed to any speed, with limits of their own in both directions."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Limit = float | tuple[float, float]
"""One magnitude for both directions, or the lowest (below 0) and the highest value (above 0)."""
_Range = tuple[float, float]
_EPSILON = 2.0**-53
_STEPS = 200


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
    """The speed of zone 4: the largest one, or the lowest where the profile has to go back or to slow down."""
    acceleration: float
    """Largest magnitude of the acceleration that is reached."""
    end_speed: float
    starts: NDArray[np.float64]
    """`(8,)` [s] times at which the zones begin, and the end."""
    states: NDArray[np.float64]
    """`(7, 4)` position, velocity, acceleration, jerk at the beginning of each zone."""

    @property
    def duration_s(self) -> float:
        return float(self.starts[-1])

    def at(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Position, velocity, acceleration and jerk `(4, ...)` at times `t` `(...)` [s].

        Outside the profile it goes on at the speed of that end. At a border between zones the jerk is that of the later
        zone.
        """
        t = np.asarray(t, dtype=np.float64)
        zone = np.clip(np.searchsorted(self.starts, t, side="right") - 1, 0, 6)
        x = np.clip(t, 0.0, self.duration_s) - self.starts[zone]
        s, v, a, j = np.moveaxis(self.states[zone], -1, 0)
        position = s + x * (v + x * (a / 2.0 + x * j / 6.0))
        out = np.stack([position, v + x * (a + x * j / 2.0), a + x * j, j])
        before, after = t < 0.0, t >= self.duration_s
        for outside, place, speed, since in (
            (before, 0.0, float(self.states[0, 1]), t),
            (after, self.distance, self.end_speed, t - self.duration_s),
        ):
            out[0, outside], out[1, outside] = (place + speed * since)[outside], speed
            out[2:, outside] = 0.0
        return out


def s_curve(
    distance: float,
    speed: Limit,
    acceleration: Limit,
    jerk: Limit,
    start_speed: float = 0.0,
    end_speed: float = 0.0,
) -> SCurve:
    """The fastest profile over `distance` (either sign) between two speeds, both without acceleration.

    Each limit is a magnitude or a pair for both directions, all in one unit of length. Between two speeds the fastest
    profile has one speed at which the acceleration changes its sign: above both where there is way left when the speed
    has been changed at once, else below both. The book has only the case from rest to rest, and one magnitude each.

    Raises ValueError for limits that are not finite or of the wrong sign, a distance that is not finite, and speeds at
    the ends that are beyond the limit.
    """
    ranges = [_range(*each) for each in (("speed", speed), ("acceleration", acceleration), ("jerk", jerk))]
    speeds, accelerations, jerks = ranges
    if not math.isfinite(distance):
        raise ValueError(f"s_curve: distance {distance} found, allowed a finite number")
    for name, value in (("start_speed", start_speed), ("end_speed", end_speed)):
        if not speeds[0] <= value <= speeds[1]:
            raise ValueError(f"s_curve: {name} {value} found, allowed {speeds[0]} to {speeds[1]}")
    if start_speed == end_speed == 0.0 and all(-low == high for low, high in ranges):
        top = math.copysign(_top_speed(abs(distance), speeds[1], accelerations[1], jerks[1]), distance)
    else:
        top = _turning_speed(distance, speeds, accelerations, jerks, start_speed, end_speed)
    first, last = _Ramp.over(start_speed, top, accelerations, jerks), _Ramp.over(top, end_speed, accelerations, jerks)
    rest = distance - first.way - last.way
    cruise = max(0.0, rest / top) if top in speeds else 0.0
    zones = np.array([*first.times, cruise, *last.times])
    states = np.zeros((7, 4))
    states[:3], states[4:] = first.states(0.0, start_speed), last.states(distance - last.way, top)
    states[3] = first.way, top, 0.0, 0.0
    peak = max(first.peak, last.peak)
    return SCurve(distance, zones, top, peak, end_speed, np.append(0.0, np.cumsum(zones)), states)


def _range(name: str, limit: Limit) -> _Range:
    low, high = limit if isinstance(limit, tuple) else (-limit, limit)
    if not (-math.inf < low < 0.0 < high < math.inf):
        raise ValueError(
            f"s_curve: {name} {limit} found, allowed a finite number above 0, or a pair of one below and one above 0"
        )
    return low, high


@dataclass(frozen=True, slots=True)
class _Ramp:
    """The fastest change of the speed: jerk until the acceleration is there, a hold, jerk back to none."""

    times: tuple[float, float, float]
    sign: float
    peak: float
    """Magnitude of the acceleration."""
    way: float

    @classmethod
    def over(cls, first: float, last: float, accelerations: _Range, jerks: _Range) -> "_Ramp":
        """From speed `first` to speed `last`."""
        sign = 1.0 if last >= first else -1.0
        limit = accelerations[1] if sign > 0.0 else -accelerations[0]
        build, release = (jerks[1], -jerks[0]) if sign > 0.0 else (-jerks[0], jerks[1])
        change = abs(last - first)
        softness = 1.0 / build + 1.0 / release
        peak = min(limit, math.sqrt(2.0 * change / softness))
        one, three = peak / build, peak / release
        two = max(0.0, change / peak - peak * softness / 2.0) if peak == limit else 0.0
        gained = peak * (one / 2.0 + two)
        beyond = peak * (one * one / 6.0 + one * two / 2.0 + two * two / 2.0) + three * (gained + peak * three / 3.0)
        return cls((one, two, three), sign, peak, first * (one + two + three) + sign * beyond)

    def states(self, position: float, speed: float) -> NDArray[np.float64]:
        """`(3, 4)` at the beginning of each zone, the first at `position` and `speed`."""
        one, two, three = self.times
        peak = self.sign * self.peak
        build, release = (peak / time if time > 0.0 else 0.0 for time in (one, three))
        states = np.zeros((3, 4))
        states[0] = position, speed, 0.0, build
        faster = speed + peak * one / 2.0
        position += one * (speed + peak * one / 6.0)
        states[1] = position, faster, peak, 0.0
        states[2] = position + two * (faster + peak * two / 2.0), faster + peak * two, peak, -release
        return states


def _top_speed(distance: float, speed: float, acceleration: float, jerk: float) -> float:
    """From rest to rest with one magnitude each: the limit, or less on a path too short for it."""
    peak = min(acceleration, math.sqrt(speed * jerk))
    if distance >= speed * (speed / peak + peak / jerk):
        return speed
    jerk_time = acceleration / jerk
    if distance >= 2.0 * acceleration * jerk_time**2:
        # v (v/a + a/j) = distance, in the form that loses no digits
        return 2.0 * distance / (jerk_time + math.sqrt(jerk_time**2 + 4.0 * distance / acceleration))
    return jerk * math.cbrt(distance / (2.0 * jerk)) ** 2


def _turning_speed(
    distance: float, speeds: _Range, accelerations: _Range, jerks: _Range, first: float, last: float
) -> float:
    """The speed in the middle, at which the acceleration changes its sign: the limit where the path is long enough."""

    def missing(top: float) -> float:
        ways = (_Ramp.over(*pair, accelerations, jerks).way for pair in ((first, top), (top, last)))
        return distance - sum(ways)

    up = missing(max(first, last)) >= 0.0
    near, far = (max(first, last), speeds[1]) if up else (min(first, last), speeds[0])
    left = missing(far)
    return far if left == 0.0 or (left > 0.0) == up else _root(missing, near, far)


def _root(function: Callable[[float], float], first: float, last: float) -> float:
    """Where `function` is zero between `first` and `last`, to rounding; the better end where the signs are equal.

    Inverse quadratic interpolation where it is safe, else halving. Source: Chandrupatla, A new hybrid quadratic/
    bisection algorithm for finding the zero of a nonlinear function, Advances in Engineering Software 28 (1997).
    """
    a, b = last, first
    fa, fb = function(a), function(b)
    if fa * fb > 0.0:
        return a if abs(fa) < abs(fb) else b
    c, fc, share = a, fa, 0.5
    for _ in range(_STEPS):
        x = a + share * (b - a)
        fx = function(x)
        if (fx > 0.0) == (fa > 0.0):
            c, fc = a, fa
        else:
            c, fc, b, fb = b, fb, a, fa
        a, fa = x, fx
        best, least = (a, fa) if abs(fa) < abs(fb) else (b, fb)
        smallest = 2.0 * _EPSILON * abs(best) / abs(b - a) if b != a else 1.0
        if least == 0.0 or smallest > 0.5:
            return best
        share = min(1.0 - smallest, max(smallest, _share(a, b, c, fa, fb, fc)))
    return best


def _share(a: float, b: float, c: float, fa: float, fb: float, fc: float) -> float:
    """How far from a to b to look next: by interpolation where the three points allow it."""
    xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
    if not (phi * phi < xi and (1.0 - phi) ** 2 < 1.0 - xi):
        return 0.5
    return fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
