"""Cubic B-splines: what their control points have to be."""

import numpy as np

from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.affine import Numbers


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


def beginning(state: Numbers, h: float, after: float) -> Numbers:
    """The first three control points `(3, ...)` of a curve that begins in `state` `(3, ...)`.

    `state` is value, first and second derivative, `h` and `after` the first two intervals; those before are as the
    first.
    """
    value, first, second = state
    return np.stack(
        [
            value - h * first + h * h / 3.0 * second,
            value - h * h / 6.0 * second,
            value + (2.0 * h + after) / 3.0 * first + h * (h + after) / 6.0 * second,
        ]
    )


def over(t: Numbers, samples: Numbers, start: Numbers | None = None) -> Pieces:
    """The cubic spline with knots `t` `(m,)` that passes `samples` `(m, n)` up to their fourth difference.

    It is at rest at both ends, or begins in `start` `(3, n)`: value, first and second derivative.
    """
    h = np.diff(t)[:, None]
    rise = np.diff(samples, axis=0) / h
    before, after = h[:-1], h[1:]
    bend = np.diff(rise, axis=0) / (before + after)
    slope = rise[:-1] + before * bend
    inner = samples[1:-1] + (slope * (after - before) - bend * before * after) / 3.0
    points = _resting(inner[1:-1], samples)
    if start is not None:
        points[:3] = beginning(start, *h[:2, 0].tolist())
    h = np.concatenate([h[:1], h, h[-1:]])
    width = h[:-2] + h[1:-1] + h[2:]
    change = np.diff(points[1:-1], axis=0) / width
    one, two = points[1:-2] + h[:-2] * change, points[1:-2] + (h[:-2] + h[1:-1]) * change
    first, last = (points[0] + 2.0 * points[1]) / 3.0, (2.0 * points[-2] + points[-1]) / 3.0
    left, right = np.concatenate([first[None], two]), np.concatenate([one, last[None]])
    at_knots = left + h[:-1] / (h[:-1] + h[1:]) * (right - left)
    begin, end, h = at_knots[:-1], at_knots[1:], h[1:-1]
    coefficients = np.zeros((len(h), 6, samples.shape[1]))
    coefficients[:, 0], coefficients[:, 1] = begin, 3.0 * (one - begin) / h
    coefficients[:, 2] = 3.0 * (two - 2.0 * one + begin) / h**2
    coefficients[:, 3] = (end - 3.0 * (two - one) - begin) / h**3
    return Pieces(t, coefficients)
