"""Solves a retiming: a primal-dual interior-point method on the limits that matter.

The duration is minimised over the coefficients of y. Each limit has a slack; one that the beginning exceeds is widened
first and comes back by the share of each step. Only the limits that are closest in each interval are carried along: of
acceleration and speed on the side where they are close, of jerk, which changes sides quickly, on both. Others join them
where they are exceeded. Source: Nocedal and Wright, "Numerical Optimization", chapter 19. The curvature of jerk's limit
is left out as far as it is larger than that of the duration, which keeps every step a step downhill.

What belongs to the limits has the shape `(limits, intervals)`, in the order speed, acceleration, jerk. Besides, no
coefficient may become negative.
"""

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.optimal.banded import solve_banded
from robot_agent.trajectory.timing.optimal.retiming import Limited, basis, easing, on_windows

_CARRIED = (2, 6, 10)
"""Limits of speed, acceleration and jerk carried along per interval."""
_MORE = (1, 2, 3)
"""Limits that join them when others are exceeded."""
_LOOKING_ROUND = 2
"""Every so many steps more limits are carried along where others are exceeded by more than `_UNSEEN`."""
_UNSEEN = 0.02
_AGAIN = (0.02, 0.1)
"""Gap, at least and at most, with which the search goes on after tightened limits."""
_NO_LOSS = 1e-3
"""After tightened limits, which can only cost time, a path that takes so little longer than before is done."""
_SMALLEST_GAP = 1e-5
_NEAR = 0.2
"""Gap below which a search has come somewhere."""
_MOST_STEPS = 90
_SLACK, _SLACK_SHARE = 0.05, 0.3
"""Given at most to a limit that is not kept yet; and by how much more the more it is exceeded."""
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
        none = np.zeros((0, len(limited.h)))
        self._carried, self._sides = [none.astype(np.intp)] * 3, [none] * 3
        self._rows = self._values_there = np.zeros((3, 0, len(limited.h)))
        self._bounds = none
        self._choose(limited.use(c), _CARRIED)
        self._carried[2], self._sides[2] = (
            np.tile(self._carried[2], (2, 1)),
            np.concatenate([self._sides[2], -self._sides[2]]),
        )
        self._gather([0, 0, 0])
        self._gap, self._before_s = np.full(len(counts), np.inf), np.zeros(len(counts))
        self._complement = self._duration / self._size
        plain = self._plain
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
            done = (self._gap < gap) | (self._duration <= self._before_s * (1.0 + _NO_LOSS))
            if done.all() and self._widening.max() < kept:
                if not self._carry_more(kept):
                    break
            elif number % _LOOKING_ROUND == 0:
                self._carry_more(_UNSEEN)

    @property
    def found(self) -> bool:
        """Whether the search came near to a fastest rate; where coefficients are held there may be none."""
        return bool(np.isfinite(self.c).all() and (self._gap >= 0.0).all() and self._gap.max() < _NEAR)

    def keep_only(self, chosen: NDArray[np.bool_]) -> None:
        """Go on with some of the paths `(paths,)`."""
        coefficients = np.flatnonzero(chosen[self._path_of])
        intervals = coefficients[:-2]
        counts = np.bincount(self._path_of)[chosen]
        self.c, self._coefficient_duals = self.c[coefficients], self._coefficient_duals[coefficients]
        self.limited = self.limited.part(intervals, np.append(0, np.cumsum(counts)[:-1]))
        self._path_of = np.repeat(np.arange(len(counts)), counts)
        self._carried = [each[:, intervals] for each in self._carried]
        self._sides = [each[:, intervals] for each in self._sides]
        self._gap, self._complement, self._before_s = (
            each[chosen] for each in (self._gap, self._complement, self._before_s)
        )
        self._rows, self._values_there = self._rows[..., intervals], self._values_there[..., intervals]
        self._weights, self._bounds, self._widening, self._duals = (
            each[:, intervals] for each in (self._weights, self._bounds, self._widening, self._duals)
        )
        self._arrange()
        self._slacks = self._plain + self._widening

    def tighten(self, excess: Numbers) -> None:
        """Divide the limits of speed, acceleration and jerk by `excess` `(3, intervals)`, and ease the rate there."""
        self.limited = self.limited.tightened(excess)
        eased = self.c * easing(excess)
        self.c = np.append(self.c[: self._held], eased[self._held :])
        speed, acceleration, jerk = excess
        self._rows = self._rows * np.repeat(np.stack([speed**2, acceleration, jerk]), self._counts(), axis=0)
        self._arrange()
        most = np.maximum.reduceat(excess.max(axis=0), self.limited.starts)
        self._before_s = self._duration
        self._complement = np.clip(most - 1.0, *_AGAIN) * self._before_s / self._size
        target = self._complement[self._path_of]
        slacks = self._plain + self._widening
        more = _widened(slacks, np.minimum(_SLACK, np.sqrt(target[:-2])))
        self._widening, self._slacks = self._widening + more, slacks + more
        self._duals = np.maximum(self._duals, target[:-2] / self._slacks)
        self._coefficient_duals = np.maximum(self._coefficient_duals, target / self.c)

    def _carry_more(self, kept: float) -> bool:
        """Where limits are exceeded by more than `kept`: those that are closest now besides those carried along."""
        uses = self.limited.use(self.c)
        if max(float(np.abs(use).max()) for use in uses) <= 1.0 + kept:
            return False
        before = self._counts()
        for use, carried, side in zip(uses, self._carried, self._sides, strict=True):
            here = _taken(use, carried)
            use[carried, np.arange(use.shape[1])] = np.where(here * side > 0.0, 0.0, here)
        self._choose(uses, _MORE)
        known = self._gather(before)
        target, plain = self._complement[self._path_of][:-2], self._plain
        widening = _widened(plain, np.minimum(_SLACK, np.sqrt(target)))
        widening[known] = self._widening
        self._widening, self._slacks = widening, plain + widening
        duals = target / self._slacks
        duals[known] = self._duals
        self._duals = duals
        return True

    def _choose(self, uses: tuple[Numbers, Numbers, Numbers], more: tuple[int, int, int]) -> None:
        """Also so many of the limits that are used most, each on the side where it is."""
        for kind, (use, count) in enumerate(zip(uses, more, strict=True)):
            chosen = _largest(use, min(count, len(use)))
            side = np.where(_taken(use, chosen) < 0.0, -1.0, 1.0)
            self._carried[kind] = np.concatenate([self._carried[kind], chosen])
            self._sides[kind] = np.concatenate([self._sides[kind], side])

    def _counts(self) -> list[int]:
        """How many limits of each kind are carried along in an interval."""
        return [len(each) for each in self._carried]

    def _gather(self, before: list[int]) -> NDArray[np.bool_]:
        """What the limits carried along are, of each kind those after the first so many; which are not new."""
        limits, counts = self.limited, self._counts()
        v, a, j = (each[n:] for each, n in zip(self._carried, before, strict=True))
        sides = [each[n:] for each, n in zip(self._sides, before, strict=True)]
        rows = [_taken(each, at) for each, at in ((limits.speed, v), (limits.acceleration, a), (limits.jerk, j))]
        bounds = [np.ones(v.shape), np.where(sides[1] > 0.0, _taken(limits.above, a), _taken(limits.below, a))]
        known = np.concatenate([np.arange(n) < old for n, old in zip(counts, before, strict=True)])
        fixed = known[: counts[0] + counts[1]]
        self._rows = _merged(self._rows, np.concatenate(rows, axis=1) * np.concatenate(sides), known)
        self._bounds = _merged(self._bounds, np.concatenate(bounds), fixed)
        there = _taken(limits.value, j // limits.rows)
        self._values_there = np.concatenate([self._values_there, there], axis=1)
        self._arrange()
        return known

    def _arrange(self) -> None:
        """Rows `(3, limits + 3, intervals)` of limits and duration, and how many limits each path has."""
        self._size = np.bincount(self._path_of) * float(sum(self._counts()) + 1)
        self._sided = np.concatenate([self._rows, np.broadcast_to(_DURATION, (3, 3, len(self.limited.h)))], axis=1)
        self._place()

    def _place(self) -> None:
        """What follows from the coefficients: plain slacks, and the squared rates in the limits of jerk and duration.

        The root in the limit of jerk falls with y, which makes its rows steeper.
        """
        self._plain = -on_windows(self._rows, self.c)
        fixed = len(self._bounds)
        inverse = 1.0 / on_windows(self._values_there, self.c)
        root = np.sqrt(inverse)
        self._plain[:fixed] += self._bounds
        self._plain[fixed:] += root
        fall = 0.5 * root * inverse
        self._bend = 1.5 * fall * inverse
        np.add(self._rows[:, fixed:], fall * self._values_there, out=self._sided[:, fixed:-3])
        self._slowness = 1.0 / np.sqrt(on_windows(_DURATION, self.c))
        self._duration = np.add.reduceat((self._weights * self._slowness).sum(axis=0), self.limited.starts)

    def _step(self) -> None:
        """One Newton step on the conditions of optimality; each path takes as much of it as it can."""
        target, inverse = self._complement[self._path_of], 1.0 / self._slacks
        weight = self._duals * inverse
        pull = (self._duals * self._widening + target[:-2]) * inverse
        change = self._newton(weight, pull, target / self.c)
        used = on_windows(self._sided[:, :-3], change)
        growth = pull + weight * used - self._duals
        relative = change / self.c
        own = target / self.c - self._coefficient_duals * (1.0 + relative)
        primal = self._reach((used + self._widening) * -inverse, relative)
        dual = self._reach(growth / self._duals, own / self._coefficient_duals)
        by_primal, by_dual = primal[self._path_of], dual[self._path_of]
        self.c = self.c + by_primal * change
        self._duals = self._duals + by_dual[:-2] * growth
        self._coefficient_duals = self._coefficient_duals + by_dual * own
        self._widening = self._widening * (1.0 - by_primal[:-2])
        self._place()
        self._slacks = self._plain + self._widening
        self._aim(np.minimum(primal, dual))

    def _aim(self, least: Numbers) -> None:
        """What slack times dual shall be after the next step: less, the farther `(paths,)` the last one came."""
        rest = self._by_path(np.add, _dot(self._duals, self._slacks), self._coefficient_duals * self.c)
        duration = self._duration
        self._gap = rest / duration
        centre = np.where(least > 0.8, 0.1, np.where(least > 0.4, 0.3, 0.6))
        self._complement = np.maximum(centre * rest, _SMALLEST_GAP * duration) / self._size

    def _newton(self, weight: Numbers, pull: Numbers, coefficient_pull: Numbers) -> Numbers:
        """The change of the coefficients; none of those that are held."""
        slope = -0.5 * self._weights * self._slowness**3
        curve = -1.5 * slope * self._slowness**2
        back = _dot(self._duals[-len(self._bend) :], self._bend)
        left = np.maximum(1.0 - back / np.maximum(curve.sum(axis=0), 1e-30), 0.0)
        hessian = self._hessian(np.concatenate([weight, curve * left]))
        gradient = self._gradient(np.concatenate([pull, slope])) - coefficient_pull
        hessian[:, : self._held], gradient[: self._held] = 0.0, 0.0
        hessian[0, : self._held] = 1.0
        return -solve_banded(hessian, gradient)

    def _gradient(self, pull: Numbers) -> Numbers:
        """Of the duration and of the pull of all limits `(intervals + 2,)`."""
        window = np.einsum("mk,imk->ik", pull, self._sided)
        whole = np.zeros(len(self.c))
        for first, each in enumerate(window):
            whole[first : first + len(each)] += each
        return whole

    def _hessian(self, weight: Numbers) -> Numbers:
        """Lower bands `(3, intervals + 2)`."""
        window = np.einsum("imk,jmk->ijk", weight * self._sided, self._sided)
        bands = np.zeros((3, len(self.c)))
        bands[0] = self._coefficient_duals / self.c
        for first in range(3):
            for second in range(first, 3):
                bands[second - first, first : first + window.shape[2]] += window[first, second]
        return bands

    def _reach(self, change: Numbers, of_coefficients: Numbers) -> Numbers:
        """Share of the relative change, at most all of it, that keeps everything positive: of each path."""
        nearest = -self._by_path(np.minimum, change.min(axis=0), of_coefficients)
        return np.asarray(1.0 / np.maximum(1.0, nearest / _BOUNDARY))

    def _by_path(self, together: np.ufunc, by_interval: Numbers, by_coefficient: Numbers) -> Numbers:
        """`(paths,)` of values of the intervals and of the coefficients."""
        whole = by_coefficient.copy()
        whole[:-2] = together(whole[:-2], by_interval)
        return np.asarray(together.reduceat(whole, self.limited.starts))


def _widened(slacks: Numbers, room: Numbers) -> Numbers:
    """What is added to limits that are exceeded or nearly so."""
    room = room + _SLACK_SHARE * np.maximum(-slacks, 0.0)
    return np.where(slacks < _TOUCHING * room, room - slacks, 0.0)


def _dot(first: Numbers, second: Numbers) -> Numbers:
    """`(intervals,)` sums of products over all rows `(rows, intervals)`."""
    return np.asarray(np.einsum("mk,mk->k", first, second))


def _largest(use: Numbers, count: int) -> NDArray[np.intp]:
    """Numbers `(count, intervals)` of the largest magnitudes in each interval."""
    rest, intervals = np.ascontiguousarray(np.abs(use).T), np.arange(use.shape[1])
    chosen = np.empty((count, use.shape[1]), dtype=np.intp)
    for number in range(count):
        chosen[number] = rest.argmax(axis=1)
        rest[intervals, chosen[number]] = -1.0
    return chosen


def _merged(old: Numbers, new: Numbers, known: NDArray[np.bool_]) -> Numbers:
    """Limits `(..., limits, intervals)`: the old ones where they are known, the new ones elsewhere."""
    merged = np.empty((*old.shape[:-2], *known.shape, old.shape[-1]))
    merged[..., known, :], merged[..., ~known, :] = old, new
    return merged


def _taken(values: Numbers, at: NDArray[np.intp]) -> Numbers:
    """Of values `(..., m, intervals)` those `(..., n, intervals)` with the numbers `at` `(n, intervals)` out of m."""
    count = values.shape[-1]
    return np.asarray(np.take(values.reshape(*values.shape[:-2], -1), at * count + np.arange(count), axis=-1))
