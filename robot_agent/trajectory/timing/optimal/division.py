"""Into which intervals a long motion is divided: short where it accelerates, else as long as its way allows.

Slow moves so take as many intervals as their way needs, and none from the fast ones beside them.
"""

import numpy as np

from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.path_limits import Rows

_CALM = 0.05
"""Share of the limits of acceleration and jerk below which only the speed matters."""
_PLACES = 12.0
"""Places of the path's grid that the time of a ramp is worth where nothing accelerates."""
_EVEN = 8.0
"""Intervals beside what accelerates that are as short as there: jerk spreads it out."""
_GROWTH = 0.1
"""Share of the time from there by which they get longer."""


def divided(at: Numbers, squared: Numbers, when: Numbers, rows: Rows, h: float, ramp_s: float) -> Numbers:
    """Times `(k,)` [s] from the beginning to the end: `h` [s] apart where the motion accelerates, else farther.

    At parameters `at` `(m,)` of its path it has the squared rate `squared` `(m,)` and the limits `rows`, and is there
    at times `when` `(m,)` [s]. Its acceleration builds up in `ramp_s` [s].
    """
    longest = _PLACES * h / ramp_s * np.diff(when)
    longest[_accelerates(at, squared, rows)] = 0.0
    longest[[0, -1]] = 0.0
    longest = np.maximum(longest, (1.0 - _GROWTH * _EVEN) * h)
    slope = _GROWTH * when
    before = np.append(np.inf, np.minimum.accumulate(longest - slope[1:])[:-1]) + slope[:-1]
    after = np.append(np.minimum.accumulate((longest + slope[:-1])[::-1])[::-1][1:], np.inf) - slope[1:]
    cells = zip(when[1:].tolist(), longest.tolist(), before.tolist(), after.tolist(), strict=True)
    t, begin, times = 0.0, 0.0, []
    for end, most, first, last in cells:
        while t < end:
            times.append(t)
            t += max(h, min(most, first + _GROWTH * (t - begin), last + _GROWTH * (end - t)))
        begin = end
    return np.append(times, t) * (float(when[-1]) / t)


def _accelerates(at: Numbers, squared: Numbers, rows: Rows) -> Numbers:
    """Between which places `(m - 1,)` limits of acceleration or jerk are used."""
    acceleration = (np.diff(squared) / (2.0 * np.diff(at)))[:, None]
    affine, by_jerk = rows.affine, np.abs(rows.third_jerk * squared[:, None] ** 1.5).max(axis=1) > _CALM
    used = by_jerk[1:] | by_jerk[:-1]
    for side in (slice(None, -1), slice(1, None)):
        each = affine.a[side] * acceleration + affine.b[side] * squared[side, None]
        used |= (np.maximum(each / affine.above[side], -each / affine.below[side]) > _CALM).any(axis=1)
    return np.asarray(used)
