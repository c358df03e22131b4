"""The fastest timing of a path that begins in motion: from the rate that another motion has there, to rest."""

from contextlib import suppress

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.trajectory.joints.joint_path import JointPath
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.continuation import PathUnderWay
from robot_agent.trajectory.timing.optimal.b_spline import beginning, softly
from robot_agent.trajectory.timing.optimal.initial_law import InitialLaw
from robot_agent.trajectory.timing.optimal.interior_point import Search
from robot_agent.trajectory.timing.optimal.reachability import times
from robot_agent.trajectory.timing.optimal.retiming import PLACES, Limited
from robot_agent.trajectory.timing.optimal.time_optimal import (
    FINE,
    MARGIN,
    MOST_INTERVALS,
    begin,
    limit_use,
    quickest,
    ramp_s,
    sampled_rise,
)
from robot_agent.trajectory.timing.optimal.timing_law import TimingLaw
from robot_agent.trajectory.timing.path_limits import PathLimits
from robot_agent.trajectory.timing.timed import Timed

_COARSE = 2.0
"""Intervals per ramp of the acceleration, at first."""
_HELD = 2
"""Coefficients of the squared rate that are 1: the initial law's own rate, and its slope, at the beginning."""
_ROOM = 1.0003
"""More of a limit than what the state uses of it, in the first interval."""
_ROUGHLY = 1.5
_ROUGHLY_JERK = 2.0
"""The same for the coarse search, in some more intervals."""
_ROUGH_INTERVALS = 4
_TRIED = ((4.0, 1.0), (2.0, 1.25), (8.0, 0.8), (3.0, 1.6), (6.0, 2.0))
"""Tried one after the other: coarse intervals over which the known rate passes into the new one; how much finer."""
_ATTEMPTS = 8
_JERK_MARGIN = 1.008
"""Jerk between the places that the search looks at is another by about so much."""
_ACCEPTED = 1.001
_CERTAIN = 1.0005
_EASED = 8
"""Coefficients over which the search begins with less and less of the known rate."""


def fastest_onward(model: Model, path: JointPath, limits: Limits, going: PathUnderWay) -> Timed | None:
    """Joints over time along `path` from the state `going` to rest; None where the limits cannot be kept from there.

    `path` begins as the rest of the path of `going` does. The joints begin exactly in its position, velocity and
    acceleration.
    """
    bounds = PathLimits(path, limits)
    for over, finer in _TRIED:
        # a search that finds nothing ends in numbers that are not finite, or in equations without a solution
        with np.errstate(all="ignore"), suppress(np.linalg.LinAlgError):
            initial = _coarsely(path, bounds, going, ramp_s(limits) / finer, over)
            timed = None if initial is None else _finely(model, path, bounds, initial, going)
            if timed is not None:
                return timed
    return None


def _coarsely(path: JointPath, bounds: PathLimits, going: PathUnderWay, ramp: float, over: float) -> InitialLaw | None:
    initial = _first(path, bounds, ramp, going, over)
    limited = _roomy(Limited.of(initial, bounds), _ROUGH_INTERVALS, _ROUGHLY, _ROUGHLY_JERK)
    search = Search(limited, _begin(limited), _HELD)
    search.run(gap=0.1, kept=0.5)
    if not search.found:
        return None
    return TimingLaw(initial, search.c).resampled(ramp / FINE, MOST_INTERVALS, np.array([0.0, *going.rate]))


def _finely(
    model: Model, path: JointPath, bounds: PathLimits, initial: InitialLaw, going: PathUnderWay
) -> Timed | None:
    own = Limited.of(initial, bounds)
    limited = _roomy(own.tightened(np.array([[MARGIN], [MARGIN], [_JERK_MARGIN]])), 1, _ROOM, _ROOM)
    search = Search(limited, _begin(limited), _HELD)
    for _ in range(_ATTEMPTS):
        search.run(gap=0.003, kept=(MARGIN - 1.0) / 2.0)
        if not search.found:
            return None
        fitted = TimingLaw(initial, search.c).timed(path, going.joints)
        excess = limit_use(model, bounds, fitted, initial)
        if max(float(excess.max()), float(own.excess(search.c)[:2].max())) <= _ACCEPTED:
            return fitted.timed
        around = np.lib.stride_tricks.sliding_window_view(np.pad(excess, ((0, 0), (1, 1))), 3, axis=1).max(axis=2)
        tighter = np.where(around > _CERTAIN, around * _CERTAIN, 1.0)
        tighter[:2, 0] = 1.0
        search.tighten(tighter)
    return None


def _first(path: JointPath, bounds: PathLimits, ramp: float, going: PathUnderWay, over: float) -> InitialLaw:
    """A motion that begins as the known one does and keeps the limits of speed and acceleration, nearly."""
    grid, squared, rows = quickest(path, bounds, ramp, float(going.rate[0] ** 2))
    known = np.interp(grid, going.known[0], going.known[1], right=0.0)
    far = float(np.interp(over * ramp / _COARSE, times(going.known[0], going.known[1]), going.known[0]))
    share = np.clip(grid / max(far, grid[1]), 0.0, 1.0)
    share = share * share * (3.0 - 2.0 * share)
    squared = (1.0 - share) * known + share * squared
    s, h, rates = sampled_rise(grid, squared, rows, ramp, _COARSE)
    points = softly(s)[1:]  # from rest it begins one interval later
    points[:3] = beginning(np.array([0.0, *going.rate]), h, h)
    return InitialLaw.rising(points, h, np.append(rates, rates[-1]))


def _roomy(limited: Limited, intervals: int, more: float, jerk: float) -> Limited:
    """The limits of the first intervals widened to `more` times what the state uses of them, if that is more.

    Those of jerk to `jerk` times what the first interval needs at least.
    """
    uses = limited.use(np.ones(len(limited.h) + 2))[:2]
    at_once = [float(np.abs(use[: len(use) // len(PLACES), 0]).max()) for use in uses]
    room = np.ones((3, len(limited.h)))
    for order, used in enumerate(at_once):
        room[order, :intervals] = 1.0 / max(1.0, more * used)
    room[2, :intervals] = 1.0 / max(1.0, jerk * _least_jerk(limited))
    return limited.tightened(room)


def _begin(limited: Limited) -> Numbers:
    """As for a motion from rest, but from the rate that is given."""
    share = np.clip((np.arange(len(limited.h) + 2) - (_HELD - 1)) / _EASED, 0.0, 1.0)
    return np.asarray(np.exp(share * np.log(begin(limited))))


def _least_jerk(limited: Limited) -> float:
    """The least that the first interval can use of its limits of jerk."""
    jerk, value = limited.jerk[..., 0], limited.value[..., 0]
    third = np.linspace(0.7, 1.3, 301)[:, None]
    rate = np.sqrt(value[0] + value[1] + third * value[2])
    used = np.abs(jerk[0] + jerk[1] + third * jerk[2]) * np.repeat(rate, limited.rows, axis=1)
    return float(used.max(axis=1).min())
