"""From a joint path to joints over time: as fast as all limits allow."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joint_path import JointPath, Numbers
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.path_limits import PathLimits
from robot_agent.trajectory.pieces import Pieces
from robot_agent.trajectory.reachable import fastest_speeds, times
from robot_agent.trajectory.retiming import PLACES, Derivatives, Retiming, basis, excesses

_GRID_STEP = 0.005
_FEWEST, _MOST = 160, 2400
_FEWEST_INTERVALS, _MOST_INTERVALS = 16, 1200
_CHECKED = np.linspace(0.0, 1.0, 9)
"""Places in each interval at which a solution is looked at again."""
_ATTEMPTS = 3
_ACCEPTED = 1.01
"""An excess over a limit that a slower clock may take away; more is solved again with tighter limits there."""
_EXACT = 2e-7
"""Largest distance [rad or m] of the joints over time from the joints along the path."""
_GAUSS_X, _GAUSS_W = (values / 2.0 for values in np.polynomial.legendre.leggauss(5))


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """Joints over time, and times `(k,)` [s] at which parameters `(k,)` of the path are passed."""

    pieces: Pieces
    times: Numbers
    parameters: Numbers


def fastest(path: JointPath, limits: Limits) -> Timed:
    """Joints over time along `path`, from rest to rest."""
    bounds = PathLimits(path, limits)
    grid = np.linspace(0.0, path.length, int(np.clip(math.ceil(path.length / _GRID_STEP), _FEWEST, _MOST)) + 1)
    when = times(grid, fastest_speeds(grid, bounds.rows(grid)))
    base = Base(grid, when, _interval(limits, float(when[-1])))
    coarse, fine = _derivatives(base, bounds, PLACES), _derivatives(base, bounds, _CHECKED)
    for _ in range(_ATTEMPTS):
        rate = Retiming(coarse, base.h).solve()
        excess = excesses(fine, rate, base.h)
        if excess.max() <= _ACCEPTED:
            break
        coarse = coarse.tightened(_spread(np.maximum(excess, 1.0)))
    pieces, t, s = _over_time(path, base, rate)
    allowed = np.stack([limits.velocity, limits.acceleration, limits.jerk])
    measured = (pieces.peaks() / allowed).max(axis=1)
    worst = np.maximum(measured, excess.max(axis=1)) ** (1.0 / np.arange(1.0, 4.0))
    k = 1.0 / max(1.0, float(worst.max()))
    return Timed(pieces.slower(k), t / k, s)


def _spread(excess: Numbers) -> Numbers:
    """Each interval's excess `(3, intervals)` for its neighbours too: what a limit does reaches over the border."""
    wide = np.pad(excess, ((0, 0), (1, 1)), mode="edge")
    return np.maximum(np.maximum(wide[:, :-2], wide[:, 2:]), excess)


def _interval(limits: Limits, duration_s: float) -> float:
    """Length of an interval of tau: a few per ramp of the acceleration."""
    build = float((limits.acceleration / limits.jerk).min())
    count = np.clip(math.ceil(4.0 * duration_s / build), _FEWEST_INTERVALS, _MOST_INTERVALS)
    return duration_s / float(count)


class Base:
    """A smooth motion s(tau), at rest at both ends: the cubic B-spline whose control points a faster motion passes."""

    def __init__(self, grid: Numbers, when: Numbers, h: float) -> None:
        self.h = h
        inner = np.interp(np.arange(round(float(when[-1]) / h) + 1) * h, when, grid)
        # halfway between neighbours: softer than the steps of the acceleration, so that the rate need not mend them
        inner = (np.append(grid[0], inner) + np.append(inner, grid[-1])) / 2.0
        self._points = np.concatenate([np.full(2, grid[0]), inner, np.full(2, grid[-1])])
        self.intervals = len(self._points) - 3
        self._last = float(grid[-1])

    def at(self, interval: NDArray[np.intp], place: Numbers) -> Numbers:
        """s and three derivatives `(4, k)` in intervals `(k,)` at places `(k,)` in 0 to 1."""
        u, h = place, self.h
        c = self._points[interval[:, None] + np.arange(4)]
        one = np.ones_like(u)
        rows = [
            [(1 - u) ** 3 / 6, (3 * u**3 - 6 * u**2 + 4) / 6, (-3 * u**3 + 3 * u**2 + 3 * u + 1) / 6, u**3 / 6],
            [-((1 - u) ** 2) / 2, (3 * u**2 - 4 * u) / 2, (-3 * u**2 + 2 * u + 1) / 2, u**2 / 2],
            [1 - u, 3 * u - 2, 1 - 3 * u, u],
            [-one, 3 * one, -3 * one, one],
        ]
        out = np.stack([(c * np.stack(row, axis=-1)).sum(axis=-1) / h**order for order, row in enumerate(rows)])
        out[0] = np.clip(out[0], 0.0, self._last)
        return out


def _derivatives(base: Base, bounds: PathLimits, places: Numbers) -> Derivatives:
    interval, place = np.repeat(np.arange(base.intervals), len(places)), np.tile(places, base.intervals)
    s, *speeds = base.at(interval, place)
    rows = bounds.rows(s)
    v, a, j = (each[:, None] for each in speeds)
    with np.errstate(divide="ignore", over="ignore"):
        fastest_y = np.minimum(rows.fastest / np.maximum(speeds[0] ** 2, 1e-300), 1e12)
    coordinates = (
        rows.first * v,
        rows.second * v**2 + rows.first * a,
        rows.first_jerk * v,
        rows.second_jerk * v**2 + rows.first_jerk * a,
        rows.third_jerk * v**3 + 3.0 * rows.second_jerk * v * a + rows.first_jerk * j,
    )
    shape = (base.intervals, len(places))
    one, two, three, four, five = (each.reshape(*shape, -1) for each in coordinates)
    return Derivatives(one, two, three, four, five, fastest_y.reshape(shape))


def _over_time(path: JointPath, base: Base, c: Numbers) -> tuple[Pieces, Numbers, Numbers]:
    """Quintic pieces over time through exact states, fine enough to be the path."""
    law = _Law(path, base, c)
    parts = np.full(base.intervals, 2)
    for _ in range(6):
        interval, place = _places(parts)
        width = 1.0 / parts[interval]
        t = np.append(0.0, np.cumsum(law.time(interval, place, width)))
        state, s = law.state(np.append(interval, base.intervals - 1), np.append(place, 1.0))
        pieces = Pieces.through(t, *state)
        to_middle = t[:-1] + law.time(interval, place, width / 2.0)
        away = np.abs(pieces.position(to_middle) - law.state(interval, place + width / 2.0)[0][0]).max(axis=1)
        worst = np.maximum.reduceat(away, np.cumsum(parts) - parts)
        if worst.max() <= _EXACT:
            break
        parts = np.where(worst > _EXACT, 2 * parts, parts)
    return pieces, t, s


class _Law:
    """s(tau) with its rate: where the joints are at a place of an interval."""

    def __init__(self, path: JointPath, base: Base, c: Numbers) -> None:
        self._path, self._base, self._c = path, base, c

    def time(self, interval: NDArray[np.intp], place: Numbers, width: Numbers) -> Numbers:
        """Time [s] from `place` of the interval on for `width` of it."""
        places = place[:, None] + width[:, None] * (0.5 + _GAUSS_X)
        y = self._squared_rate(interval[:, None], places)[0]
        return np.asarray(self._base.h * width * (1.0 / np.sqrt(y) @ _GAUSS_W))

    def state(self, interval: NDArray[np.intp], place: Numbers) -> tuple[Numbers, Numbers]:
        """Joints, velocity, acceleration `(3, k, n)` and parameter `(k,)`."""
        s, v, a, _ = self._base.at(interval, place)
        y, growth = self._squared_rate(interval, place)
        q, first, second, _ = self._path.pieces.shape(s)[..., : self._path.joints]
        speed = np.sqrt(y) * v
        acceleration = y * a + growth * v / 2.0
        velocity = first * speed[:, None]
        return np.stack([q, velocity, first * acceleration[:, None] + second * (speed**2)[:, None]]), s

    def _squared_rate(self, interval: NDArray[np.intp], place: Numbers) -> tuple[Numbers, Numbers]:
        """y and y' by tau."""
        weights = basis(place, self._base.h)
        window = self._c[interval[..., None] + np.arange(3)]
        return (weights[..., 0, :] * window).sum(axis=-1), (weights[..., 1, :] * window).sum(axis=-1)


def _places(parts: NDArray[np.intp]) -> tuple[NDArray[np.intp], Numbers]:
    """Interval and place in it of every piece's beginning."""
    interval = np.repeat(np.arange(len(parts)), parts)
    number = np.arange(len(interval)) - np.repeat(np.cumsum(parts) - parts, parts)
    return interval, number / parts[interval]
