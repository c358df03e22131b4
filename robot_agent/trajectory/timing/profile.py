"""Profiles from rest to rest: how the way along a path grows with time. The robot file names one."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from robot_agent.model.description import ProfileKind, Shaping
from robot_agent.trajectory.timing.gaussian_window import spread_s
from robot_agent.trajectory.timing.s_curve import Limit, s_curve

Numbers = NDArray[np.float64]

_MOST_EVEN = 2400
"""Times at which a profile is looked at, a few seconds of it and more than enough for a slow one."""
_LEAST_RAMP = 0.2
"""Of a trapezoid, as a share of the filter's window: a shorter ramp is gone behind the filter, but less even."""


class Profile(Protocol):
    """A way over time, `at` times `(...)` [s]: position, velocity, acceleration and jerk `(4, ...)`.

    Between two values of `starts`, which are rising and end with `duration_s`, all of it is smooth; at one of them `at`
    gives what begins there.
    """

    @property
    def starts(self) -> Numbers: ...

    @property
    def duration_s(self) -> float: ...

    def at(self, t: Numbers) -> Numbers: ...


@dataclass(frozen=True, slots=True)
class _RampShape:
    """How the speed grows from 0 to 1 over x in 0 to 1; the largest values of its first two derivatives by x."""

    at: Callable[[Numbers], list[Numbers]]
    """Way, speed and its two derivatives at x `(...)`; the way at 1 is one half."""
    steepest: float
    sharpest: float


def _sine(x: Numbers) -> list[Numbers]:
    turn = math.tau * x
    way = x * x / 2.0 - np.sin(turn / 2.0) ** 2 * 2.0 / math.tau**2
    return [way, x - np.sin(turn) / math.tau, 1.0 - np.cos(turn), math.tau * np.sin(turn)]


def _cubic(x: Numbers) -> list[Numbers]:
    return [x**3 * (1.0 - x / 2.0), x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x), 6.0 - 12.0 * x]


def _linear(x: Numbers) -> list[Numbers]:
    return [x * x / 2.0, x, np.ones_like(x), np.zeros_like(x)]


_SHAPES = {
    ProfileKind.SINUSOIDAL: _RampShape(_sine, 2.0, math.tau),
    ProfileKind.BEZIER: _RampShape(_cubic, 1.5, 6.0),
    ProfileKind.TRAPEZOIDAL: _RampShape(_linear, 1.0, 0.0),
}


@dataclass(frozen=True, slots=True)
class Ramped:
    """A ramp up to `speed`, a cruise, the same ramp down; speed and distance may be negative.

    Source: Frigeni, Industrial Robotics Control, chapter 7, sinusoidal and Bezier profile; the book's distance of a
    sinusoidal ramp (7-29) holds only where the acceleration limit is reached, here it is half the speed times the time.
    """

    kind: ProfileKind
    """Sinusoidal, Bezier or trapezoidal. The acceleration of a trapezoid steps; its jerk is given as 0."""
    distance: float
    speed: float
    ramp_s: float
    cruise_s: float

    @classmethod
    def fastest(cls, kind: ProfileKind, distance: float, speed: float, acceleration: float, jerk: float) -> "Ramped":
        """The fastest of its kind within the limits (> 0), which it may not reach on a short way."""
        shape, way = _SHAPES[kind], abs(distance)
        top = min(speed, math.sqrt(way * acceleration / shape.steepest))
        if shape.sharpest > 0.0:
            top = min(top, math.cbrt(way * way * jerk / shape.sharpest))
        ramp_s = max(shape.steepest * top / acceleration, math.sqrt(shape.sharpest * top / jerk))
        cruise_s = max(0.0, way / top - ramp_s) if top == speed else 0.0
        return cls(kind, distance, math.copysign(top, distance), ramp_s, cruise_s)

    @property
    def duration_s(self) -> float:
        return 2.0 * self.ramp_s + self.cruise_s

    @property
    def starts(self) -> Numbers:
        """`(4,)` [s]"""
        return np.array([0.0, self.ramp_s, self.ramp_s + self.cruise_s, self.duration_s])

    def at(self, t: Numbers) -> Numbers:
        """See `Profile`; at rest outside."""
        t = np.asarray(t, dtype=np.float64)
        if self.ramp_s == 0.0:
            return np.zeros((4, *t.shape))
        down, inside = t >= self.ramp_s + self.cruise_s, (t >= 0.0) & (t < self.duration_s)
        near = np.clip(np.where(down, self.duration_s - t, t), 0.0, None)
        ramping = near < self.ramp_s
        ramping |= down
        way, *speeds = _SHAPES[self.kind].at(np.minimum(near / self.ramp_s, 1.0))
        position = self.speed * (self.ramp_s * way + np.where(ramping, 0.0, near - self.ramp_s))
        out = np.stack(
            [
                np.where(down, self.distance - position, position),
                self.speed * speeds[0] * inside,
                self.speed / self.ramp_s * speeds[1] * np.where(down, -1.0, 1.0) * (inside & ramping),
                self.speed / self.ramp_s**2 * speeds[2] * (inside & ramping),
            ]
        )
        out[0, t >= self.duration_s] = self.distance
        return out


@dataclass(frozen=True, slots=True)
class Quintic:
    """One polynomial of fifth degree from rest to rest: the smoothest start and end, the highest speed in the middle.

    Source: polynomial trajectories with position, velocity and acceleration at both ends; from rest to rest the way is
    distance (10 u^3 - 15 u^4 + 6 u^5), whose peaks are 15/8, 10/sqrt(3) and 60 of distance / duration^order.
    """

    distance: float
    duration_s: float

    @classmethod
    def fastest(cls, distance: float, speed: float, acceleration: float, jerk: float) -> "Quintic":
        """The fastest within the limits (> 0)."""
        way = abs(distance)
        needed = 1.875 * way / speed, math.sqrt(10.0 / math.sqrt(3.0) * way / acceleration), math.cbrt(60 * way / jerk)
        return cls(distance, max(needed))

    @property
    def starts(self) -> Numbers:
        """`(2,)` [s]"""
        return np.array([0.0, self.duration_s])

    def at(self, t: Numbers) -> Numbers:
        """See `Profile`; at rest outside."""
        t = np.asarray(t, dtype=np.float64)
        if self.duration_s == 0.0:
            return np.zeros((4, *t.shape))
        inside, u = (t >= 0.0) & (t < self.duration_s), np.clip(t / self.duration_s, 0.0, 1.0)
        return np.stack(
            [
                self.distance * u**3 * (10.0 - u * (15.0 - 6.0 * u)),
                self.distance / self.duration_s * 30.0 * (u * (1.0 - u)) ** 2 * inside,
                self.distance / self.duration_s**2 * 60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) * inside,
                self.distance / self.duration_s**3 * 60.0 * (1.0 - 6.0 * u * (1.0 - u)) * inside,
            ]
        )


def profile(kind: ProfileKind, distance: float, speed: float, acceleration: Limit, jerk: float) -> Profile:
    """The fastest profile of a kind over `distance` (either sign) from rest to rest within three limits.

    A trapezoidal profile has no jerk limit; the others keep all three. Of two limits of acceleration (lowest, highest)
    an S-curve uses both, every other profile the smaller one. Raises ValueError for limits that are not
    positive and finite, and for a distance that is not finite.
    """
    if kind is ProfileKind.S_CURVE:
        return s_curve(distance, speed, acceleration, jerk)
    acceleration = _smaller(acceleration)
    if not (math.isfinite(distance) and all(0.0 < limit < math.inf for limit in (speed, acceleration, jerk))):
        found = f"distance {distance}, speed {speed}, acceleration {acceleration}, jerk {jerk}"
        raise ValueError(f"profile: {found} found, allowed finite numbers, and limits above 0")
    if kind is ProfileKind.QUINTIC:
        return Quintic.fastest(distance, speed, acceleration, jerk)
    return Ramped.fastest(kind, distance, speed, acceleration, jerk)


def even_times(starts: Numbers, step_s: float) -> Numbers:
    """Times `(k,)` evenly from the first to the last of `starts`, at most `step_s` [s] apart.

    Where that would be more than `_MOST_EVEN` they are so many between one start and the next: a cruise, however slow,
    is passed evenly.
    """
    duration_s = float(starts[-1])
    count = max(2, math.ceil(duration_s / step_s))
    if count <= _MOST_EVEN:
        return np.linspace(0.0, duration_s, count + 1)
    counts = np.clip(np.ceil(np.diff(starts) / step_s), 1, _MOST_EVEN).astype(np.intp)
    zones = zip(starts[:-1].tolist(), starts[1:].tolist(), counts.tolist(), strict=True)
    parts = [np.linspace(begin, end, count, endpoint=False) for begin, end, count in zones]
    return np.append(np.concatenate(parts), duration_s)


def _smaller(limit: Limit) -> float:
    return min(-limit[0], limit[1]) if isinstance(limit, tuple) else limit


def shaped_profile(shaping: Shaping, distance: float, speed: float, acceleration: Limit, jerk: float) -> Profile:
    """The profile that a robot file asks for, see `profile`; a trapezoid so that the jerk is kept after the filter."""
    if shaping.profile is ProfileKind.TRAPEZOIDAL:  # its acceleration may step from one limit to the other
        steep = speed / (_LEAST_RAMP * shaping.filter_s)
        acceleration = min(_smaller(acceleration), jerk * spread_s(shaping.filter_s) / 2.0, steep)
    return profile(shaping.profile, distance, speed, acceleration, jerk)
