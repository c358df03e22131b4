"""Solves a retiming: a primal-dual interior-point method on the limits that matter.

The duration is minimised over the coefficients of y. Each limit has a slack; one that the beginning exceeds is widened
first and comes back by the share of each step. Only the limits that are closest in each interval are carried along,
chosen anew every few steps. Source: Nocedal and Wright, "Numerical Optimization", chapter 19. The curvature of jerk's
limit is left out as far as it is larger than that of the duration, which keeps every step a step downhill.
"""

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.affine import Numbers
from robot_agent.trajectory.band import solve_banded
from robot_agent.trajectory.retiming import Limited, basis, on_windows

_CARRIED = (2, 8, 14)
"""Limits of speed, acceleration and jerk carried along per interval."""
_MORE = (1, 3, 5)
"""Limits that join them when others are exceeded."""
_KIND = (1, 1, 2, 2, 0)
"""Of which kind the limits on each side are: acceleration above and below, jerk above and below, speed."""
_FIRST_STEPS = 6
_AGAIN = 0.02
"""Gap with which the search goes on behind tightened limits."""
_SMALLEST_GAP = 1e-5
_NEAR = 0.2
"""Gap below which a search has come somewhere."""
_MOST_STEPS = 90
_SLACK = 0.05
"""Given to a limit that is not kept yet."""
_TOUCHING = 0.01
"""Share of it below which a limit counts as not kept."""
_BOUNDARY = 0.95
"""Of the way to the nearest limit that a step may take."""
_DURATION = np.moveaxis(basis(np.array([0.0, 0.5, 1.0]))[:, 0], -1, 0)[:, None]
_WEIGHTS = np.array([1.0, 4.0, 1.0]) / 6.0
"""Simpson's rule."""


class Search:
    """The fastest rate within limits, and where the search for it stands: `c` are the coefficients of y."""

    def __init__(self, limited: Limited, c: Numbers, held: int = 0) -> None:
        """`held` is how many of the first coefficients stay as they are."""
        self.c, self.limited, self._held = c, limited, held
        self._weights = limited.h[:, None] * _WEIGHTS
        counts = np.diff(np.append(limited.starts, len(c)))
        self._path_of = np.repeat(np.arange(len(counts)), counts)
        uses = limited.use(c)
        self._carried = [_largest(use, count) for use, count in zip(uses, _CARRIED, strict=True)]
        self._gather()
        self._widening: list[Numbers] = [np.zeros((1, 1))] * 5 + [np.zeros(1)]
        self._gap = np.full(len(counts), np.inf)
        self._complement = self._duration() / self._size()
        self._widening = _widened(self._slacks(), [np.full((1, 1), _SLACK)] * 5 + [np.zeros(1)])
        slacks, target = self._slacks(), self._by_limit(self._complement)
        self._duals = [mu / slack for mu, slack in zip(target, slacks, strict=True)]

    def run(self, gap: float, kept: float) -> None:
        """On until the duration is within `gap` of what duality allows and no limit is exceeded by more than `kept`.

        Both are relative. Ends also after so many steps that nothing better is to be expected.
        """
        for number in range(1, _MOST_STEPS):
            self._step()
            if self._gap.max() < gap and max(float(each.max()) for each in self._widening) < kept:
                if self.limited.largest(self.c) <= 1.0 + kept:
                    break
                self._carry_more()
            elif number == _FIRST_STEPS:
                self._carry_more()

    @property
    def found(self) -> bool:
        """Whether the search came near to a fastest rate; where coefficients are held there may be none."""
        return bool(np.isfinite(self.c).all() and (self._gap >= 0.0).all() and self._gap.max() < _NEAR)

    def tighten(self, excess: Numbers) -> None:
        """Divide the limits of speed, acceleration and jerk by `excess` `(3, intervals)`."""
        self.limited = self.limited.tightened(excess)
        self._gather()
        most = np.maximum.reduceat(excess.max(axis=0), self.limited.starts)
        self._complement = np.clip(most - 1.0, _AGAIN, 1.0) * self._duration() / self._size()
        target = self._by_limit(self._complement)
        fresh = _widened(self._slacks(), [np.minimum(_SLACK, np.sqrt(mu)) for mu in target])
        self._widening = [old + new for old, new in zip(self._widening, fresh, strict=True)]
        slacks = self._slacks()
        self._duals = [np.maximum(dual, mu / s) for dual, mu, s in zip(self._duals, target, slacks, strict=True)]

    def _carry_more(self) -> None:
        """The limits that are closest now besides those that are carried along."""
        added = []
        for use, known, count in zip(self.limited.use(self.c), self._carried, _MORE, strict=True):
            np.put_along_axis(use, known, -np.inf, axis=1)
            added.append(_largest(use, count))
        before = [self._carried[kind].shape[1] for kind in _KIND]
        self._carried = [np.concatenate(each, axis=1) for each in zip(self._carried, added, strict=True)]
        self._gather()
        widening, self._widening = self._widening, [np.zeros((1, 1))] * 5 + [np.zeros(1)]
        target = self._by_limit(self._complement)
        fresh = _widened(self._slacks(), [np.minimum(_SLACK, np.sqrt(mu)) for mu in target])
        for new, old, count in zip(fresh, widening, before, strict=False):
            new[:, :count] = old
        self._widening = [*fresh[:5], widening[5]]
        for number, (slack, count, mu) in enumerate(zip(self._slacks(), before, target, strict=False)):
            self._duals[number] = np.concatenate([self._duals[number], mu / slack[:, count:]], axis=1)

    def _gather(self) -> None:
        limits, (v, a, j) = self.limited, self._carried
        self._a, self._j, self._v = (
            np.take_along_axis(rows, at[None], axis=2)
            for rows, at in ((limits.acceleration, a), (limits.jerk, j), (limits.speed, v))
        )
        self._y = np.take_along_axis(limits.value, (j // limits.rows)[None], axis=2)
        self._above, self._below = (np.take_along_axis(each, a, axis=1) for each in (limits.above, limits.below))
        self._squares = [_products(rows) for rows in (self._a, self._j, self._v, self._y)]
        self._mixed = _products(self._j + self._y) - self._squares[1] - self._squares[3]

    def _step(self) -> None:
        """One Newton step on the conditions of optimality; each path takes as much of it as it can."""
        slacks, y = self._slacks(), on_windows(_DURATION, self.c)
        q = self._room()
        fall = -0.5 * q**3
        weight = [dual / slack for dual, slack in zip(self._duals, slacks, strict=True)]
        target = self._by_limit(self._complement)
        pull = [
            (mu + dual * wide) / slack
            for mu, dual, wide, slack in zip(target, self._duals, self._widening, slacks, strict=True)
        ]
        change = self._newton(self._hessian(weight, y, q, fall), self._gradient(pull, y, fall))
        ahead = [d - wide for d, wide in zip(self._moved(change, fall), self._widening, strict=True)]
        growth = [
            p - dual - w * d for p, dual, w, d in zip(pull, self._duals, weight, self._moved(change, fall), strict=True)
        ]
        primal, dual_share = self._reach(ahead, slacks), self._reach(growth, self._duals)
        by_limit = self._by_limit(dual_share)
        self.c = self.c + primal[self._path_of] * change
        self._duals = [dual + s * more for dual, s, more in zip(self._duals, by_limit, growth, strict=True)]
        self._widening = [wide * (1.0 - s) for wide, s in zip(self._widening, self._by_limit(primal), strict=True)]
        products = [dual * slack for dual, slack in zip(self._duals, self._slacks(), strict=True)]
        rest = self._by_path([each.sum(axis=1) for each in products[:5]], products[5], np.add)
        duration = self._duration()
        self._gap = rest / duration
        least = np.minimum(primal, dual_share)
        centre = np.where(least > 0.8, 0.1, np.where(least > 0.4, 0.3, 0.6))
        self._complement = np.maximum(centre * rest, _SMALLEST_GAP * duration) / self._size()

    def _newton(self, hessian: Numbers, gradient: Numbers) -> Numbers:
        """The change of the coefficients; none of those that are held."""
        hessian[:, : self._held], gradient[: self._held] = 0.0, 0.0
        hessian[0, : self._held] = 1.0
        return -solve_banded(hessian, gradient)

    def _reach(self, change: list[Numbers], of: list[Numbers]) -> Numbers:
        """Share of the change, at most all of it, that keeps everything positive: of each path."""
        near = [-(d / value) for d, value in zip(change, of, strict=True)]
        nearest = self._by_path([each.max(axis=1) for each in near[:5]], near[5], np.maximum)
        return np.asarray(1.0 / np.maximum(1.0, nearest / _BOUNDARY))

    def _by_path(self, by_interval: list[Numbers], by_coefficient: Numbers, add: np.ufunc) -> Numbers:
        """`(paths,)` of values of the intervals and of the coefficients."""
        whole = by_coefficient.copy()
        for each in by_interval:
            whole[:-2] = add(whole[:-2], each)
        return np.asarray(add.reduceat(whole, self.limited.starts))

    def _by_limit(self, values: Numbers) -> list[Numbers]:
        """Values `(paths,)` for all limits, in the shapes of the slacks."""
        spread = values[self._path_of]
        return [*[spread[:-2, None]] * 5, spread]

    def _size(self) -> Numbers:
        """Number of limits `(paths,)`."""
        each = sum(self._carried[kind].shape[1] for kind in _KIND) + 1
        return np.diff(np.append(self.limited.starts, len(self.c))) * float(each)

    def _duration(self) -> Numbers:
        """`(paths,)`"""
        time = (self._weights / np.sqrt(on_windows(_DURATION, self.c))).sum(axis=1)
        return np.asarray(np.add.reduceat(time, self.limited.starts))

    def _room(self) -> Numbers:
        """1 / sqrt(y) where jerk is limited."""
        return np.asarray(1.0 / np.sqrt(on_windows(self._y, self.c)))

    def _slacks(self) -> list[Numbers]:
        a, j, q = on_windows(self._a, self.c), on_windows(self._j, self.c), self._room()
        v = on_windows(self._v, self.c)
        plain = [self._above - a, self._below + a, q - j, q + j, 1.0 - v, self.c]
        return [slack + wide for slack, wide in zip(plain, self._widening, strict=True)]

    def _moved(self, change: Numbers, fall: Numbers) -> list[Numbers]:
        """The slacks' change, to first order."""
        a, j, q = on_windows(self._a, change), on_windows(self._j, change), fall * on_windows(self._y, change)
        return [-a, a, q - j, q + j, -on_windows(self._v, change), change]

    def _gradient(self, pull: list[Numbers], y: Numbers, fall: Numbers) -> Numbers:
        """Of the duration and of the pull of all limits `(intervals + 2,)`."""
        down = -0.5 * self._weights * y**-1.5
        window = (
            _summed(pull[0] - pull[1], self._a)
            + _summed(pull[2] - pull[3], self._j)
            - _summed((pull[2] + pull[3]) * fall, self._y)
            + _summed(pull[4], self._v)
            + _summed(down, _DURATION)
        )
        whole = -pull[5]
        whole[:-2] += window[0]
        whole[1:-1] += window[1]
        whole[2:] += window[2]
        return whole

    def _hessian(self, weight: list[Numbers], y: Numbers, q: Numbers, fall: Numbers) -> Numbers:
        """Lower bands `(3, intervals + 2)`."""
        both = weight[2] + weight[3]
        curve = 0.75 * self._weights * y**-2.5
        back = (0.75 * (self._duals[2] + self._duals[3]) * q**5).sum(axis=1)
        left = np.maximum(1.0 - back / np.maximum(curve.sum(axis=1), 1e-30), 0.0)[:, None]
        a, j, v, value = self._squares
        six = (
            _summed(weight[0] + weight[1], a)
            + _summed(both, j)
            + _summed(both * fall * fall, value)
            + _summed((weight[3] - weight[2]) * fall, self._mixed)
            + _summed(weight[4], v)
            + _summed(curve * left, _products(_DURATION))
        )
        bands = np.zeros((3, len(self.c)))
        bands[0] = weight[5]
        bands[0, :-2] += six[0]
        bands[0, 1:-1] += six[1]
        bands[0, 2:] += six[2]
        bands[1, :-2] += six[3]
        bands[1, 1:-1] += six[4]
        bands[2, :-2] += six[5]
        return bands


def _summed(weights: Numbers, rows: Numbers) -> Numbers:
    """`(parts, intervals)`: rows `(parts, intervals, m)` by weights `(intervals, m)`, summed."""
    return np.asarray(np.einsum("km,ikm->ik", weights, np.broadcast_to(rows, (len(rows), *weights.shape))))


def _products(rows: Numbers) -> Numbers:
    """The six different products of three parts: squares, neighbours, ends."""
    one, two, three = rows
    return np.stack([one * one, two * two, three * three, one * two, two * three, one * three])


def _widened(slacks: list[Numbers], rooms: list[Numbers]) -> list[Numbers]:
    """What is added to limits that are exceeded or nearly so."""
    return [np.where(each < _TOUCHING * room, room - each, 0.0) for each, room in zip(slacks, rooms, strict=True)]


def _largest(use: Numbers, count: int) -> NDArray[np.intp]:
    """Indices `(intervals, count)` of the largest in each interval."""
    return np.argpartition(-use, min(count, use.shape[1] - 1), axis=1)[:, :count]
