"""Uniform cubic B-splines: what their control points have to be."""

import numpy as np

from robot_agent.trajectory.affine import Numbers


def through(samples: Numbers, h: float, speed: Numbers, acceleration: Numbers) -> Numbers:
    """Control points `(m + 2, ...)` of the curve that passes `samples` `(m, ...)`, `h` apart, and ends at rest.

    It begins with `speed` and `acceleration` `(...)`, exactly; in between it passes the samples up to their fourth
    difference (quasi-interpolation). Its third derivative is constant between samples.
    """
    inner = samples[2:-2] - (samples[3:-1] - 2.0 * samples[2:-2] + samples[1:-3]) / 6.0
    return between(inner, samples, h, speed, acceleration)


def softly(samples: Numbers, h: float, speed: Numbers, acceleration: Numbers) -> Numbers:
    """As `through`, but only close to the samples, its third derivative smaller; two or three points longer."""
    soft = (samples[:-2] + 2.0 * samples[1:-1] + samples[2:]) / 4.0
    return between(soft if not np.any(speed) else soft[1:], samples, h, speed, acceleration)


def between(inner: Numbers, samples: Numbers, h: float, speed: Numbers, acceleration: Numbers) -> Numbers:
    """Control points `inner` between three at both ends for the states there."""
    bend, step = acceleration * h**2, speed * h
    middle = samples[0] - bend / 6.0
    first = np.stack([middle - step + bend / 2.0, middle, middle + step + bend / 2.0])
    return np.concatenate([first, inner, np.repeat(samples[-1:], 3, axis=0)])


def powers(points: Numbers, h: float) -> Numbers:
    """Coefficients `(m - 3, 4, ...)` of the powers of the time since the beginning of each interval."""
    a, b, c, d = points[:-3], points[1:-2], points[2:-1], points[3:]
    rows = [(a + 4.0 * b + c) / 6.0, (c - a) / 2.0, (a - 2.0 * b + c) / 2.0, (d - 3.0 * c + 3.0 * b - a) / 6.0]
    return np.stack([row / h**order for order, row in enumerate(rows)], axis=1)
