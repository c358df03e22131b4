"""From a joint path to joints over time: as fast as all limits allow."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joint_path import JointPath, Numbers
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.path_limits import PathLimits
from robot_agent.trajectory.pieces import Pieces
from robot_agent.trajectory.rate_law import sample_times
from robot_agent.trajectory.reachable import fastest_speeds, times
from robot_agent.trajectory.retiming import PLACES, Derivatives, Retiming, basis, excesses

_GRID_STEP = 0.005
_FEWEST, _MOST = 160, 2400
_FEWEST_INTERVALS, _MOST_INTERVALS = 16, 1200
_SHORTEST_PIECE = 0.02
"""Of an interval."""
_CHECKED = np.linspace(0.0, 1.0, 9)
"""Places in each interval at which a solution is looked at again."""
_ATTEMPTS = 3
_ACCEPTED = 1.003
"""Slowing down all of the motion by so much is better than solving it again with tighter limits here and there."""
_EXACT = 2e-7
"""Largest distance [rad or m] of the joints over time from the joints along the path."""
_GAUSS_X, _GAUSS_W = (values / 2.0 for values in np.polynomial.legendre.leggauss(5))


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """Joints over time, and times `(k,)` [s] at which parameters `(k,)` of the path are passed."""

    pieces: Pieces
    times: Numbers
    parameters: Numbers
    deviation_m: float = 0.0
    """How far a filter takes the flange off the path."""


def fastest(path: JointPath, limits: Limits) -> Timed:
    """Joints over time along `path`, from rest to rest."""
    bounds = PathLimits(path, limits)
    grid = np.linspace(0.0, path.length, int(np.clip(math.ceil(path.length / _GRID_STEP), _FEWEST, _MOST)) + 1)
    squared = fastest_speeds(grid, bounds.rows(grid))
    when = times(grid, squared)
    h = _interval(limits, float(when[-1]))
    base = Base(_along(grid, squared, when, sample_times(round(float(when[-1]) / h) + 1, h)), h)
    coarse, fine = _derivatives(base, bounds, PLACES), _derivatives(base, bounds, _CHECKED)
    best: Timed | None = None
    rate: Numbers | None = None
    for _ in range(_ATTEMPTS):
        rate = Retiming(coarse, base.h).solve(rate)
        timed, interval = _over_time(path, base, rate)
        excess = np.maximum(excesses(fine, rate, base.h), _excesses_of(timed.pieces, interval, limits))
        k = max(1.0, float((excess.max(axis=1) ** (1.0 / np.arange(1.0, 4.0))).max()))
        if best is None or timed.pieces.duration_s * k < best.pieces.duration_s:
            best = Timed(timed.pieces.slower(1.0 / k), timed.times * k, timed.parameters)
        if k <= _ACCEPTED:
            break
        coarse = coarse.tightened(np.maximum(excess, 1.0))
    return timed if best is None else best


def _excesses_of(pieces: Pieces, interval: NDArray[np.intp], limits: Limits) -> Numbers:
    """As `excesses`, for the joints' pieces themselves, each in its `interval`."""
    allowed = np.stack([limits.velocity, limits.acceleration, limits.jerk])[:, None]
    share = (pieces.peaks_of_pieces() / allowed).max(axis=2)
    first = np.searchsorted(interval, np.arange(interval[-1] + 1))
    return np.asarray(np.maximum.reduceat(share, first, axis=1))


def _interval(limits: Limits, duration_s: float) -> float:
    """Length of an interval of tau: a few per ramp of the acceleration."""
    build = float((limits.acceleration / limits.jerk).min())
    count = np.clip(math.ceil(4.0 * duration_s / build), _FEWEST_INTERVALS, _MOST_INTERVALS)
    return duration_s / float(count)


def _along(grid: Numbers, squared: Numbers, when: Numbers, t: Numbers) -> Numbers:
    """Parameters `(k,)` at times `t` `(k,)`, the acceleration constant between points of the grid."""
    k = np.clip(np.searchsorted(when, t, side="right") - 1, 0, len(grid) - 2)
    after = np.minimum(t, when[-1]) - when[k]
    acceleration = np.diff(squared)[k] / (2.0 * np.diff(grid)[k])
    return np.asarray(np.minimum(grid[k] + after * (np.sqrt(squared[k]) + after * acceleration / 2.0), grid[-1]))


class Base:
    """A smooth motion s(tau), at rest at both ends: the cubic B-spline whose control points a faster motion passes."""

    def __init__(self, points: Numbers, h: float) -> None:
        """`points` are passed at intervals of `h` [s]."""
        self.h = h
        first, last = points[0], points[-1]
        # halfway between neighbours: softer than the steps of the acceleration, so that the rate need not mend them
        inner = (np.append(first, points) + np.append(points, last)) / 2.0
        self._points = np.concatenate([np.full(2, first), inner, np.full(2, last)])
        self.intervals = len(self._points) - 3
        self._last = float(last)

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


def _over_time(path: JointPath, base: Base, c: Numbers) -> tuple[Timed, NDArray[np.intp]]:
    """Quintic pieces through exact states, fine enough to be the path, and the interval `(pieces,)` each lies in."""
    law = _Law(path, base, c)
    places = _with_knots(np.arange(2 * base.intervals + 1) / 2.0, base, path.pieces.knots[1:-1])
    for _ in range(6):
        interval = np.minimum(places.astype(np.intp), base.intervals - 1)
        place, width = places - interval, np.diff(places)
        t = np.append(0.0, np.cumsum(law.time(interval[:-1], place[:-1], width)))
        state, s = law.state(interval, place)
        pieces = Pieces.through(t, *state)
        to_middle = t[:-1] + law.time(interval[:-1], place[:-1], width / 2.0)
        there = law.state(interval[:-1], place[:-1] + width / 2.0)[0][0]
        away = np.abs(pieces.position(to_middle) - there).max(axis=1) > _EXACT
        if not away.any():
            break
        places = np.sort(np.concatenate([places, (places[:-1] + width / 2.0)[away]]))
    return Timed(pieces, t, s), interval[:-1]


def _with_knots(places: Numbers, base: Base, knots: Numbers) -> Numbers:
    """Places, counted in intervals, and those at which the path passes its knots, where its third derivative jumps."""
    interval = np.minimum(places.astype(np.intp), base.intervals - 1)
    s = base.at(interval, places - interval)[0]
    rising = np.append(True, np.diff(s) > 0.0)
    at = np.interp(knots, s[rising], places[rising])
    for _ in range(4):
        interval = np.minimum(at.astype(np.intp), base.intervals - 1)
        value, slope = base.at(interval, at - interval)[:2]
        at = np.clip(at - (value - knots) / np.maximum(slope * base.h, 1e-9), 0.0, base.intervals)
    at = np.sort(at)
    apart = (np.abs(2.0 * at - np.rint(2.0 * at)) > 2.0 * _SHORTEST_PIECE) & (
        np.diff(at, prepend=-1.0) > _SHORTEST_PIECE
    )
    return np.sort(np.concatenate([places, at[apart]]))


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
