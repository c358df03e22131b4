"""Solves a retiming: a primal-dual interior-point method on the limits that matter.

The duration is minimised over the coefficients of y. Each limit has a slack; one that the beginning exceeds is widened
first and comes back by the share of each step. Only the limits that are closest in each interval are carried along,
chosen anew every few steps. Source: Nocedal and Wright, "Numerical Optimization", chapter 19. The curvature of jerk's
limit is left out as far as it is larger than that of the duration, which keeps every step a step downhill.

What belongs to the limits has the shape `(limits, intervals)`, in the order acceleration above and below, jerk above
and below, speed. Besides, no coefficient may become negative.
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
_LOOKING_ROUND = (3, 6)
"""After so many steps more limits are carried along where others are exceeded by more than `_UNSEEN`."""
_UNSEEN = 0.02
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
_DURATION = np.moveaxis(basis(np.array([0.0, 0.5, 1.0]))[:, 0], -1, 0)[..., None]
_WEIGHTS = np.array([[1.0], [4.0], [1.0]]) / 6.0
"""Simpson's rule."""


class Search:
    """The fastest rate within limits, and where the search for it stands: `c` are the coefficients of y."""

    def __init__(self, limited: Limited, c: Numbers, held: int = 0) -> None:
        """`held` is how many of the first coefficients stay as they are."""
        self.c, self.limited, self._held = c, limited, held
        self._weights = limited.h * _WEIGHTS
        counts = np.diff(np.append(limited.starts, len(c)))
        self._path_of = np.repeat(np.arange(len(counts)), counts)
        uses = limited.use(c)
        self._carried = [_largest(use, count) for use, count in zip(uses, _CARRIED, strict=True)]
        self._gather()
        self._gap = np.full(len(counts), np.inf)
        self._complement = self._duration() / self._size()
        plain = self._plain_slacks()
        self._widening = _widened(plain, np.full((1, 1), _SLACK))
        self._slacks = plain + self._widening
        target = self._complement[self._path_of]
        self._duals, self._coefficient_duals = target[:-2] / self._slacks, target / c

    def run(self, gap: float, kept: float) -> None:
        """On until the duration is within `gap` of what duality allows and no limit is exceeded by more than `kept`.

        Both are relative. Ends also after so many steps that nothing better is to be expected.
        """
        for number in range(1, _MOST_STEPS):
            self._step()
            if self._gap.max() < gap and self._widening.max() < kept:
                if self.limited.largest(self.c) <= 1.0 + kept:
                    break
                self._carry_more()
            elif number in _LOOKING_ROUND and self.limited.largest(self.c) > 1.0 + _UNSEEN:
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
        target = self._complement[self._path_of]
        slacks = self._plain_slacks() + self._widening
        more = _widened(slacks, np.minimum(_SLACK, np.sqrt(target[:-2])))
        self._widening, self._slacks = self._widening + more, slacks + more
        self._duals = np.maximum(self._duals, target[:-2] / self._slacks)
        self._coefficient_duals = np.maximum(self._coefficient_duals, target / self.c)

    def keep_only(self, chosen: NDArray[np.bool_]) -> None:
        """Go on with some of the paths `(paths,)`."""
        coefficients = np.flatnonzero(chosen[self._path_of])
        intervals = coefficients[:-2]
        counts = np.bincount(self._path_of)[chosen]
        self.c, self._coefficient_duals = self.c[coefficients], self._coefficient_duals[coefficients]
        self.limited = self.limited.part(intervals, np.append(0, np.cumsum(counts)[:-1]))
        self._path_of = np.repeat(np.arange(len(counts)), counts)
        self._weights = self._weights[:, intervals]
        self._carried = [each[:, intervals] for each in self._carried]
        self._gap, self._complement = self._gap[chosen], self._complement[chosen]
        self._widening, self._duals = self._widening[:, intervals], self._duals[:, intervals]
        self._gather()
        self._slacks = self._plain_slacks() + self._widening

    def _carry_more(self) -> None:
        """The limits that are closest now besides those that are carried along."""
        before = self._counts()
        for kind, use in enumerate(self.limited.use(self.c)):
            np.put_along_axis(use, self._carried[kind], -np.inf, axis=0)
            self._carried[kind] = np.concatenate([self._carried[kind], _largest(use, _MORE[kind])])
        self._gather()
        known = np.concatenate([np.arange(n) < old for n, old in zip(self._counts(), before, strict=True)])
        target, plain = self._complement[self._path_of][:-2], self._plain_slacks()
        widening = _widened(plain, np.minimum(_SLACK, np.sqrt(target)))
        widening[known] = self._widening
        self._widening, self._slacks = widening, plain + widening
        duals = target / self._slacks
        duals[known] = self._duals
        self._duals = duals

    def _counts(self) -> list[int]:
        """How many limits there are on each side in an interval."""
        return [len(self._carried[kind]) for kind in _KIND]

    def _gather(self) -> None:
        """The rows of acceleration, jerk, y at the places of jerk, speed and y where the duration is counted."""
        limits, (v, a, j) = self.limited, self._carried
        taken = ((limits.acceleration, a), (limits.jerk, j), (limits.value, j // limits.rows), (limits.speed, v))
        rows = [np.take_along_axis(each, at[None], axis=1) for each, at in taken]
        rows.append(np.broadcast_to(_DURATION, (3, 3, len(limits.h))))
        self._rows = np.concatenate(rows, axis=1)
        self._borders = np.cumsum([each.shape[1] for each in rows])[:-1]
        self._above, self._below = (np.take_along_axis(each, a, axis=0) for each in (limits.above, limits.below))
        self._sided = self._rows.copy()
        self._values = on_windows(self._rows, self.c)

    def _parts(self, values: Numbers) -> list[Numbers]:
        """Values `(rows, intervals)` of acceleration, jerk, y there, speed, y for the duration."""
        return np.split(values, self._borders)

    def _step(self) -> None:
        """One Newton step on the conditions of optimality; each path takes as much of it as it can."""
        target, inverse = self._complement[self._path_of], 1.0 / self._slacks
        weight = self._duals * inverse
        pull = self._duals * self._widening
        pull += target[:-2]
        pull *= inverse
        change = self._newton(weight, pull, target / self.c)
        moved = on_windows(self._rows, change)
        a, j, growing, v, _ = self._parts(moved)
        q = self._fall * growing
        ahead = np.concatenate([-a, a, q - j, q + j, -v])
        weight *= ahead
        growth = np.subtract(pull, weight, out=pull)
        growth -= self._duals
        ahead -= self._widening
        ahead *= inverse
        relative = change / self.c
        own = target / self.c - self._coefficient_duals * (1.0 + relative)
        primal = self._reach(ahead, relative)
        dual = self._reach(growth / self._duals, own / self._coefficient_duals)
        by_primal, by_dual = primal[self._path_of], dual[self._path_of]
        self.c = self.c + by_primal * change
        self._values = on_windows(self._rows, self.c)
        growth *= by_dual[:-2]
        self._duals += growth
        self._coefficient_duals = self._coefficient_duals + by_dual * own
        self._widening *= 1.0 - by_primal[:-2]
        self._slacks = self._plain_slacks()
        self._slacks += self._widening
        self._aim(np.minimum(primal, dual))

    def _aim(self, least: Numbers) -> None:
        """What slack times dual shall be after the next step: less, the farther `(paths,)` the last one came."""
        rest = self._by_path(np.add, _dot(self._duals, self._slacks), self._coefficient_duals * self.c)
        duration = self._duration()
        self._gap = rest / duration
        centre = np.where(least > 0.8, 0.1, np.where(least > 0.4, 0.3, 0.6))
        self._complement = np.maximum(centre * rest, _SMALLEST_GAP * duration) / self._size()

    def _newton(self, weight: Numbers, pull: Numbers, coefficient_pull: Numbers) -> Numbers:
        """The change of the coefficients; none of those that are held."""
        self._turn_to_sides()
        hessian, gradient = self._hessian(weight), self._gradient(pull, coefficient_pull)
        hessian[:, : self._held], gradient[: self._held] = 0.0, 0.0
        hessian[0, : self._held] = 1.0
        return -solve_banded(hessian, gradient)

    def _turn_to_sides(self) -> None:
        """The rows of jerk become those of its slacks above and below, whose root falls with y."""
        first, second, third, _ = self._borders
        jerk = self._rows[:, first:second]
        root = self._fall * self._rows[:, second:third]
        np.subtract(root, jerk, out=self._sided[:, first:second])
        np.add(root, jerk, out=self._sided[:, second:third])

    def _reach(self, change: Numbers, of_coefficients: Numbers) -> Numbers:
        """Share of the relative change, at most all of it, that keeps everything positive: of each path."""
        nearest = -self._by_path(np.minimum, change.min(axis=0), of_coefficients)
        return np.asarray(1.0 / np.maximum(1.0, nearest / _BOUNDARY))

    def _by_path(self, together: np.ufunc, by_interval: Numbers, by_coefficient: Numbers) -> Numbers:
        """`(paths,)` of values of the intervals and of the coefficients."""
        whole = by_coefficient.copy()
        whole[:-2] = together(whole[:-2], by_interval)
        return np.asarray(together.reduceat(whole, self.limited.starts))

    def _size(self) -> Numbers:
        """Number of limits `(paths,)`."""
        return np.diff(np.append(self.limited.starts, len(self.c))) * float(sum(self._counts()) + 1)

    def _duration(self) -> Numbers:
        """`(paths,)`"""
        time = (self._weights / np.sqrt(self._parts(self._values)[4])).sum(axis=0)
        return np.asarray(np.add.reduceat(time, self.limited.starts))

    def _plain_slacks(self) -> Numbers:
        """Without what they are widened by; and the derivative by y of what jerk's limit leaves."""
        a, j, y, v, _ = self._parts(self._values)
        self._inverse = 1.0 / y
        q = np.sqrt(self._inverse)
        self._fall = -0.5 * q * self._inverse
        return np.concatenate([self._above - a, self._below + a, q - j, q + j, 1.0 - v])

    def _gradient(self, pull: Numbers, coefficient_pull: Numbers) -> Numbers:
        """Of the duration and of the pull of all limits `(intervals + 2,)`."""
        above, below, *jerk, speed = np.split(pull, np.cumsum(self._counts())[:-1])
        y = self._parts(self._values)[4]
        down = -0.5 * self._weights / (y * np.sqrt(y))
        each = np.concatenate([above - below, *[-side for side in jerk], speed, down])
        window = np.einsum("mk,imk->ik", each, self._sided)
        whole = -coefficient_pull
        whole[:-2] += window[0]
        whole[1:-1] += window[1]
        whole[2:] += window[2]
        return whole

    def _hessian(self, weight: Numbers) -> Numbers:
        """Lower bands `(3, intervals + 2)`."""
        ma, mj = self._counts()[1:3]
        y = self._parts(self._values)[4]
        curve = 0.75 * self._weights / (y * y * np.sqrt(y))
        duals = self._duals[2 * ma : 2 * ma + mj] + self._duals[2 * ma + mj : 2 * (ma + mj)]
        back = -1.5 * _dot(duals, self._fall * self._inverse)
        left = np.maximum(1.0 - back / np.maximum(curve.sum(axis=0), 1e-30), 0.0)
        each = np.concatenate([weight[:ma] + weight[ma : 2 * ma], weight[2 * ma :], curve * left])
        one, two, three = self._sided
        by_one, by_two = each * one, each * two
        bands = np.zeros((3, len(self.c)))
        bands[0] = self._coefficient_duals / self.c
        bands[0, :-2] += _dot(by_one, one)
        bands[0, 1:-1] += _dot(by_two, two)
        bands[0, 2:] += _dot(each * three, three)
        bands[1, :-2] += _dot(by_one, two)
        bands[1, 1:-1] += _dot(by_two, three)
        bands[2, :-2] += _dot(by_one, three)
        return bands


def _dot(first: Numbers, second: Numbers) -> Numbers:
    """`(intervals,)` sums of products over all rows `(rows, intervals)`."""
    return np.asarray(np.einsum("mk,mk->k", first, second))


def _widened(slacks: Numbers, room: Numbers) -> Numbers:
    """What is added to limits that are exceeded or nearly so."""
    return np.where(slacks < _TOUCHING * room, room - slacks, 0.0)


def _largest(use: Numbers, count: int) -> NDArray[np.intp]:
    """Indices `(count, intervals)` of the largest in each interval."""
    return np.argpartition(-use, min(count, len(use) - 1), axis=0)[:count]
