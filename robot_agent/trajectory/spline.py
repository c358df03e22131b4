"""Uniform cubic B-splines: what their control points have to be."""

import numpy as np

from robot_agent.trajectory.affine import Numbers


def through(samples: Numbers) -> Numbers:
    """Control points `(m + 2, ...)` of the curve from rest to rest that passes `samples` `(m, ...)`, evenly spaced.

    It passes them up to their fourth difference (quasi-interpolation). Its third derivative is constant between them.
    """
    inner = samples[2:-2] - (samples[3:-1] - 2.0 * samples[2:-2] + samples[1:-3]) / 6.0
    return _resting(inner, samples)


def softly(samples: Numbers) -> Numbers:
    """As `through`, but only close to the samples, its third derivative smaller, and one interval longer."""
    return _resting((samples[:-2] + 2.0 * samples[1:-1] + samples[2:]) / 4.0, samples)


def _resting(inner: Numbers, samples: Numbers) -> Numbers:
    """Control points `inner` between three at both ends that let it rest there."""
    return np.concatenate([np.repeat(samples[:1], 3, axis=0), inner, np.repeat(samples[-1:], 3, axis=0)])


def beginning(state: Numbers, h: float) -> Numbers:
    """The first three control points `(3, ...)` of a curve that begins in `state` `(3, ...)`.

    `state` is value, first and second derivative, `h` the interval.
    """
    value, first, second = state[0], h * state[1], h * h * state[2]
    middle = value - second / 6.0
    return np.stack([middle - first + second / 2.0, middle, middle + first + second / 2.0])


def powers(points: Numbers, h: float) -> Numbers:
    """Coefficients `(m - 3, 4, ...)` of the powers of the time since the beginning of each interval."""
    a, b, c, d = points[:-3], points[1:-2], points[2:-1], points[3:]
    rows = [(a + 4.0 * b + c) / 6.0, (c - a) / 2.0, (a - 2.0 * b + c) / 2.0, (d - 3.0 * c + 3.0 * b - a) / 6.0]
    return np.stack([row / h**order for order, row in enumerate(rows)], axis=1)


def halfway(points: Numbers) -> Numbers:
    """Values `(m - 3, ...)` in the middle of each interval."""
    a, b, c, d = points[:-3], points[1:-2], points[2:-1], points[3:]
    return np.asarray((a + 23.0 * (b + c) + d) / 48.0)
