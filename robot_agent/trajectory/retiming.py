"""The fastest timing under limits of speed, acceleration and jerk: a given motion, its rate changed along the way.

A motion s(tau) that is smooth and at rest at both ends is given. With rate r = d tau/dt and y = r^2 the joints have

    velocity      sqrt(y) q'
    acceleration  y q'' + y'/2 q'
    jerk          sqrt(y) (y q''' + 3/2 y' q'' + 1/2 y'' q')

with derivatives by tau. Acceleration is affine in y. Jerk is |affine| <= j / sqrt(y), whose right side is convex: its
tangent is below it, so a Newton step that leaves the curvature of that side out never trusts a limit that is not there.
y is a quadratic B-spline on the knots of s; the duration, convex in y, is minimised by a barrier method that starts
from a feasible uniform rate and never leaves the limits.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.band import solve_banded

Numbers = NDArray[np.float64]

PLACES = np.linspace(0.0, 1.0, 5)
"""Where in each interval the limits are kept."""
_WEIGHTS = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
"""Boole's rule."""
_STAGES = (1.0, 6.0, 36.0, 200.0)
"""Weight of the duration against the barrier, in numbers of limits per duration."""
_NEWTON_STEPS = 40
_DECREMENT = 0.05
"""Of the barrier's value per limit row, below which a stage is done."""


@dataclass(frozen=True, slots=True, eq=False)
class Derivatives:
    """Of the limited coordinates by tau `(intervals, places, rows)`, divided by the limit of their order."""

    first: Numbers
    second: Numbers
    first_jerk: Numbers
    second_jerk: Numbers
    third_jerk: Numbers
    fastest: Numbers
    """`(intervals, places)`: bound on y."""

    def tightened(self, excess: Numbers) -> "Derivatives":
        """The same with the limits of speed, acceleration and jerk divided by `excess` `(3, intervals)`."""
        speed, acceleration, jerk = excess[..., None, None]
        return Derivatives(
            self.first * acceleration,
            self.second * acceleration,
            self.first_jerk * jerk,
            self.second_jerk * jerk,
            self.third_jerk * jerk,
            self.fastest / speed[..., 0] ** 2,
        )


def excesses(d: Derivatives, c: Numbers, h: float) -> Numbers:
    """How much of its limits a timing uses, at most in each interval `(3, intervals)`: speed, acceleration, jerk.

    `d` at places evenly from 0 to 1, any number of them; `c` as `Retiming.solve` gives it.
    """
    weights = basis(np.linspace(0.0, 1.0, d.first.shape[1]), h)
    z = np.einsum("pij,kj->kpi", weights, np.stack([c[:-2], c[1:-1], c[2:]], axis=-1))
    y, growth, bend = np.moveaxis(z, -1, 0)[..., None]
    acceleration = np.abs(y * d.second + growth / 2.0 * d.first).max(axis=(1, 2))
    jerk = y * d.third_jerk + 1.5 * growth * d.second_jerk + bend / 2.0 * d.first_jerk
    speed = np.sqrt(z[..., 0] / d.fastest).max(axis=1)
    return np.stack([speed, acceleration, np.abs(np.sqrt(y) * jerk).max(axis=(1, 2))])


def basis(places: Numbers, h: float) -> Numbers:
    """Value and two derivatives by tau of the quadratic B-spline `(..., 3, 3)` from its three coefficients."""
    u = np.asarray(places)
    zero = np.zeros_like(u)
    value = np.stack([(1.0 - u) ** 2 / 2.0, 0.5 + u - u * u, u * u / 2.0], axis=-1)
    first = np.stack([u - 1.0, 1.0 - 2.0 * u, u], axis=-1) / h
    second = np.stack([zero + 1.0, zero - 2.0, zero + 1.0], axis=-1) / h**2
    return np.stack([value, first, second], axis=-2)


class Retiming:
    """One motion of `intervals` intervals of `h` [s]."""

    def __init__(self, d: Derivatives, h: float) -> None:
        self._h = h
        self._intervals, _, rows = d.first.shape
        self._basis = basis(PLACES, h)
        self._acceleration = np.stack([d.second, d.first / 2.0], axis=-1)
        self._jerk = np.stack([d.third_jerk, 1.5 * d.second_jerk, d.first_jerk / 2.0], axis=-1)
        self._fastest = d.fastest
        self._weights = _WEIGHTS * h
        self._limits = self._intervals * len(PLACES) * (4 * rows + 2)

    def solve(self, near: Numbers | None = None) -> Numbers:
        """Coefficients `(intervals + 2,)` of y. `near`: a solution of almost the same limits, to begin with."""
        c = np.full(self._intervals + 2, 0.8 * self._uniform()) if near is None else self._inside(near)
        for stage in _STAGES[near is not None :]:
            weight = stage * self._limits / self._duration(c)
            for _ in range(_NEWTON_STEPS):
                c, decrement = self._newton(c, weight)
                if decrement < _DECREMENT * self._intervals:
                    break
        return c

    def _inside(self, c: Numbers) -> Numbers:
        """`c`, slowed down all along until it keeps the limits with some room."""
        z = self._local(c)
        left_a, left_j, left_v = self._slacks(z)
        acceleration, speed = float(1.0 - left_a.min()), float(1.0 - left_v.min())
        jerk = float((1.0 - left_j * np.sqrt(z[..., 0])[..., None]).max())
        slower: Numbers = c * 0.8 / max(1.0, acceleration, speed, jerk ** (2.0 / 3.0))
        return slower

    def _uniform(self) -> float:
        """The largest y that is the same everywhere."""
        acceleration = np.abs(self._acceleration[..., 0]).max()
        jerk = np.abs(self._jerk[..., 0]).max()
        return float(min(self._fastest.min(), 1.0 / max(acceleration, 1e-12), (1.0 / max(jerk, 1e-12)) ** (2.0 / 3.0)))

    def _local(self, c: Numbers) -> Numbers:
        """y, y', y'' `(intervals, places, 3)`."""
        windows = np.stack([c[:-2], c[1:-1], c[2:]], axis=-1)
        local: Numbers = np.einsum("pij,kj->kpi", self._basis, windows)
        return local

    def _duration(self, c: Numbers) -> float:
        return float((self._weights / np.sqrt(self._local(c)[..., 0])).sum())

    def _slacks(self, z: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """What is left of each limit, both sides: acceleration, jerk `(2, intervals, places, rows)`, and speed."""
        a = (self._acceleration @ z[..., :2, None])[..., 0]
        j = (self._jerk @ z[..., None])[..., 0]
        room = (1.0 / np.sqrt(z[..., 0]))[..., None]
        return np.stack([1.0 - a, 1.0 + a]), np.stack([room - j, room + j]), 1.0 - z[..., 0] / self._fastest

    def _merit(self, c: Numbers, weight: float) -> float:
        z = self._local(c)
        if z[..., 0].min() <= 0.0:
            return np.inf
        slacks = self._slacks(z)
        if min(float(each.min()) for each in slacks) <= 0.0:
            return np.inf
        return weight * self._duration(c) - float(sum(np.log(each).sum() for each in slacks) + np.log(z[..., 0]).sum())

    def _newton(self, c: Numbers, weight: float) -> tuple[Numbers, float]:
        """One damped Newton step and how much the merit could fall by it."""
        gradient, hessian = self._derivatives(c, weight)
        step = -solve_banded(hessian, gradient)
        slope = float(gradient @ step)
        merit, share = self._merit(c, weight), self._room(c, step)
        for _ in range(30):
            ahead = c + share * step
            if self._merit(ahead, weight) <= merit + 0.1 * share * slope:
                return ahead, -slope
            share *= 0.5
        return c, 0.0

    def _room(self, c: Numbers, step: Numbers) -> float:
        """How much of a step, at most all of it, stays inside the limits; those of jerk to first order."""
        z, dz = self._local(c), self._local(step)
        left_a, left_j, left_v = self._slacks(z)
        by_a = (self._acceleration @ dz[..., :2, None])[..., 0]
        by_j = (self._jerk @ dz[..., None])[..., 0]
        less = (0.5 * z[..., 0] ** -1.5 * dz[..., 0])[..., None]
        used = (
            (by_a / left_a[0]).max(),
            (-by_a / left_a[1]).max(),
            ((less + by_j) / left_j[0]).max(),
            ((less - by_j) / left_j[1]).max(),
            (dz[..., 0] / (self._fastest * left_v)).max(),
            (-dz[..., 0] / z[..., 0]).max(),
        )
        return 1.0 / max(1.0, float(max(used)) / 0.95)

    def _derivatives(self, c: Numbers, weight: float) -> tuple[Numbers, Numbers]:
        """Gradient `(m,)` and the lower bands `(3, m)` of the Hessian."""
        z = self._local(c)
        y = z[..., 0]
        left_a, left_j, left_v = self._slacks(z)
        gradient = np.zeros_like(z)
        hessian = np.zeros((*z.shape, 3))
        by_a, by_j = 1.0 / left_a, 1.0 / left_j
        gradient[..., :2] += ((by_a[0] - by_a[1])[..., None, :] @ self._acceleration)[..., 0, :]
        curve = (by_a[0] ** 2 + by_a[1] ** 2)[..., None] * self._acceleration
        hessian[..., :2, :2] += np.swapaxes(self._acceleration, -1, -2) @ curve
        gradient += ((by_j[0] - by_j[1])[..., None, :] @ self._jerk)[..., 0, :]
        square = by_j[0] ** 2 + by_j[1] ** 2
        hessian += np.swapaxes(self._jerk, -1, -2) @ (square[..., None] * self._jerk)
        fall = -0.5 * y**-1.5
        gradient[..., 0] -= fall * (by_j[0] + by_j[1]).sum(axis=-1)
        mixed = -fall[..., None] * ((by_j[0] ** 2 - by_j[1] ** 2)[..., None, :] @ self._jerk)[..., 0, :]
        hessian[..., 0, :] += mixed
        hessian[..., :, 0] += mixed
        by_v = 1.0 / (self._fastest * left_v)
        gradient[..., 0] += by_v - 1.0 / y - weight * self._weights * 0.5 * y**-1.5
        hessian[..., 0, 0] += (
            fall**2 * square.sum(axis=-1) + by_v**2 + 1.0 / y**2 + weight * self._weights * 0.75 * y**-2.5
        )
        return self._gather(gradient, hessian)

    def _gather(self, gradient: Numbers, hessian: Numbers) -> tuple[Numbers, Numbers]:
        """From y, y', y'' at each place to the coefficients."""
        by_window = np.einsum("pij,kpi->kj", self._basis, gradient)
        squares = (np.swapaxes(self._basis, -1, -2) @ hessian @ self._basis).sum(axis=1)
        whole, bands = np.zeros(self._intervals + 2), np.zeros((3, self._intervals + 2))
        for i in range(3):
            whole[i : i + self._intervals] += by_window[:, i]
            for j in range(i + 1):
                bands[i - j, j : j + self._intervals] += squares[:, i, j]
        return whole, bands
