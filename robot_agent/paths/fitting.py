"""Few smooth curves in place of many short lines, never farther from them than a tolerance.

The lines are a polyline over its own length t, with a place and an orientation (a quaternion) at each vertex. The curve
is a cubic spline c(t) whose second derivative is continuous: the one nearest to the polyline in the sense of least
squares over the way (de Boor, A Practical Guide to Splines, chapter XIV). Where it is too far away its spans are
divided and it is fitted again. Such a fit never is much farther away than the best spline on the same knots, however
these lie (Shadrin, The L-infinity norm of the L2 spline projector is bounded independently of the knot sequence, 2001).

How far c(t) is from the polyline at the same t is a cubic between vertices and knots; the control points of its Bezier
form bound it everywhere. So the tolerance is kept both ways, in the order of the way, and not only where one looks.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.curves import Numbers

_LINES = 24
"""In a span at first."""
_MOST_PARTS = 4
_MOST_ROUNDS = 40
_GRADED = 2.5
"""A span is at most so many times as long as its neighbours."""
_FINEST = 1e-4
"""Shortest span, as a share of the tolerance."""
_SLOWEST = 0.3
"""Least way of the curve by t: below it goes back, or turns on itself."""
_GAUSS_X, _GAUSS_W = (values / 2.0 for values in np.polynomial.legendre.leggauss(3))
_GAUSS_X = _GAUSS_X + 0.5
_THIRDS = np.arange(4.0) / 3.0
_POWERS_OF = np.linalg.inv(_THIRDS[:, None] ** np.arange(4.0))
"""From values at the thirds of a span to the coefficients of the powers."""
_BEZIER_OF = (
    np.array([[6.0, 0.0, 0.0, 0.0], [-5.0, 18.0, -9.0, 2.0], [2.0, -9.0, 18.0, -5.0], [0.0, 0.0, 0.0, 6.0]]) / 6.0
)
"""From values at the thirds to control points."""
_BLOCK = 32


@dataclass(frozen=True, slots=True, eq=False)
class Polyline:
    """Vertices over the way: `t` `(n + 1,)` [m] rises from 0, `x` `(n + 1, d)`.

    `x` are places [m] and, where the tool turns, quaternions behind them, whose sign is that of the nearer one of both.
    """

    t: Numbers
    x: Numbers
    slack_rad: float = 0.0
    """How far, as a distance of quaternions, the straight way between two vertices may be from an even turn."""


@dataclass(frozen=True, slots=True, eq=False)
class Spline:
    """Cubic pieces between `knots` `(m + 1,)`: `powers` `(m, 4, d)` of the share of the piece, 0 to 1."""

    knots: Numbers
    powers: Numbers

    def until(self, t: float) -> "Spline":
        """The same up to t."""
        last = max(int(np.searchsorted(self.knots, t)) - 1, 0)
        share = (t - self.knots[last]) / (self.knots[last + 1] - self.knots[last])
        powers = self.powers[: last + 1].copy()
        powers[last] *= (share ** np.arange(4.0))[:, None]
        return Spline(np.append(self.knots[: last + 1], t), powers)


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A curve within the tolerance, and how far at most it is away: [m] and [rad]."""

    spline: Spline
    deviation_m: float
    deviation_rad: float


class NotFitted(Exception):
    """No smooth curve is within the tolerance; `t` is where it would have to bend too tightly."""

    def __init__(self, t: float) -> None:
        super().__init__(f"no smooth curve within the tolerance at {t} m of the way")
        self.t = t


def fitted(line: Polyline, tolerance_m: float, tolerance_rad: float, begins: Numbers) -> Fit:
    """The curve from `begins` to the last vertex of `line`, within both tolerances of it.

    `begins` is the value where it begins `(1, d)`, or that and its two derivatives by t `(3, d)`. Raises NotFitted.
    """
    scale = np.ones(line.x.shape[1])
    scale[3:] = tolerance_m / max(np.sin(tolerance_rad / 2.0) - line.slack_rad, 1e-9)
    middle = line.x.mean(axis=0)
    x = (line.x - middle) * scale
    first = begins * scale
    first[0] -= middle * scale
    knots = _first_knots(line.t)
    for _ in range(_MOST_ROUNDS):
        spline = _nearest(line.t, x, knots, first)
        away, slow = _away(spline, line.t, x), _slow(spline)
        excess = np.maximum(away.max(axis=0) / tolerance_m, np.where(slow, 8.0, 0.0))
        if (excess <= 1.0).all():
            place, turn = away.max(axis=1) / np.array([1.0, scale[-1]])
            angle = 2.0 * np.arcsin(min(1.0, turn + line.slack_rad)) if len(scale) > 3 else 0.0
            return Fit(_unscaled(spline, middle, scale), float(place), float(angle))
        knots = _divided(knots, excess, _FINEST * tolerance_m)
    raise NotFitted(float(knots[int(np.argmax(excess))]))


def _unscaled(spline: Spline, middle: Numbers, scale: Numbers) -> Spline:
    powers = spline.powers / scale
    powers[:, 0] += middle
    return replace(spline, powers=powers)


def _first_knots(t: Numbers) -> Numbers:
    inner = np.arange(_LINES, len(t) - _LINES // 2, _LINES)
    return _graded(np.concatenate([t[:1], t[inner], t[-1:]]))


def _graded(knots: Numbers) -> Numbers:
    """The same with spans divided that are far longer than a neighbour, which would swing about beside it."""
    while True:
        width = np.diff(knots)
        least = np.minimum(np.append(width[1:], np.inf), np.append(np.inf, width[:-1]))
        long = width > _GRADED * least
        if not long.any():
            return knots
        knots = np.sort(np.append(knots, (knots[:-1] + knots[1:])[long] / 2.0))


def _divided(knots: Numbers, excess: Numbers, finest_m: float) -> Numbers:
    """The same with the spans `(m,)` divided that leave the tolerance."""
    parts = np.where(excess > 1.0, np.clip(np.ceil(excess ** (1.0 / 3.0)), 2, _MOST_PARTS), 1).astype(np.intp)
    width = np.diff(knots)
    fine = np.flatnonzero((parts > 1) & (width < 2.0 * finest_m))
    if len(fine):
        raise NotFitted(float(knots[fine[np.argmax(excess[fine])]]))
    first = np.repeat(np.cumsum(parts) - parts, parts)
    number = np.arange(len(first)) - first
    return _graded(np.append(np.repeat(knots[:-1], parts) + number * np.repeat(width / parts, parts), knots[-1]))


def _nearest(t: Numbers, x: Numbers, knots: Numbers, first: Numbers) -> Spline:
    """The spline on these knots that is nearest to the polyline, from the states `first` to its last vertex."""
    whole = np.concatenate([knots[:1]] * 3 + [knots] + [knots[-1:]] * 3)
    held = _beginning(whole, first)
    solved = np.zeros((len(knots) + 2, x.shape[1]))
    solved[: len(held)], solved[-1] = held, x[-1]
    free = slice(len(held), len(solved) - 1)
    if free.start < free.stop:
        borders = np.union1d(t, knots)
        width = np.diff(borders)
        at = (borders[:-1, None] + width[:, None] * _GAUSS_X).ravel()
        line = np.clip(np.searchsorted(t, at) - 1, 0, len(t) - 2)
        share = ((at - t[line]) / (t[line + 1] - t[line]))[:, None]
        span = np.clip(np.searchsorted(knots, at) - 1, 0, len(knots) - 2)
        basis = _basis(whole, span, at)
        known = (solved[span[:, None] + np.arange(4)] * basis[..., None]).sum(axis=1)
        missing = (x[line] + share * (x[line + 1] - x[line]) - known) * (width[:, None] * _GAUSS_W).ravel()[:, None]
        weighted = basis * (width[:, None] * _GAUSS_W).ravel()[:, None]
        size = len(solved)
        right = np.stack(
            [sum(np.bincount(span + a, basis[:, a] * each, size) for a in range(4)) for each in missing.T], axis=1
        )
        bands = np.zeros((4, size))
        for a in range(4):
            for b in range(a, 4):
                bands[b - a] += np.bincount(span + a, weighted[:, a] * basis[:, b], size)
        solved[free] = _solved(bands[:, free], right[free])
    places = knots[:-1, None] + np.diff(knots)[:, None] * _THIRDS
    spans = np.arange(len(knots) - 1)
    basis = _basis(whole, np.repeat(spans, 4), places.ravel()).reshape(-1, 4, 4)
    return Spline(knots, _POWERS_OF @ (basis @ solved[spans[:, None] + np.arange(4)]))


def _beginning(whole: Numbers, states: Numbers) -> Numbers:
    """The first coefficients `(k, d)` of the spline that begins with a value, or a value and two derivatives."""
    held = states.copy()
    if len(states) == 3:
        one, two = whole[4] - whole[3], whole[5] - whole[3]
        held[1] = states[0] + states[1] * one / 3.0
        slope = states[1] + states[2] * one / 2.0
        held[2] = held[1] + slope * two / 3.0
    return held


def _basis(whole: Numbers, span: NDArray[np.intp], at: Numbers) -> Numbers:
    """The four B-splines `(k, 4)` that are not 0 in spans `(k,)` at places `(k,)`; de Boor, chapter X."""
    values = [np.ones_like(at)]
    for degree in range(1, 4):
        made, carried = [], np.zeros_like(at)
        for r in range(degree):
            right, left = whole[span + 4 + r], whole[span + 4 + r - degree]
            share = values[r] / (right - left)
            made.append(carried + (right - at) * share)
            carried = (at - left) * share
        values = [*made, carried]
    return np.stack(values, axis=1)


def _away(spline: Spline, t: Numbers, x: Numbers) -> Numbers:
    """In each span, bounds on the distance from the polyline at the same t `(2, m)`: of the place, and of the rest."""
    borders = np.union1d(t, spline.knots)
    at = borders[:-1, None] + np.diff(borders)[:, None] * _THIRDS
    span = np.clip(np.searchsorted(spline.knots, borders[:-1], side="right") - 1, 0, len(spline.powers) - 1)
    line = np.clip(np.searchsorted(t, borders[:-1], side="right") - 1, 0, len(t) - 2)
    share = ((at - spline.knots[span, None]) / np.diff(spline.knots)[span, None])[..., None]
    c = spline.powers[span][:, :, None]
    curve = c[:, 0] + share * (c[:, 1] + share * (c[:, 2] + share * c[:, 3]))
    passed = ((at - t[line, None]) / np.diff(t)[line, None])[..., None]
    control = _BEZIER_OF @ (curve - (x[line, None] + passed * np.diff(x, axis=0)[line, None]))
    most = np.zeros((2, len(spline.powers)))
    for row, part in zip(most, (control[..., :3], control[..., 3:]), strict=True):
        np.maximum.at(row, span, np.sqrt((part * part).sum(axis=2).max(axis=1)))
    return most


def _slow(spline: Spline) -> NDArray[np.bool_]:
    """Spans `(m,)` in which the place may come to stand, or goes back."""
    c = spline.powers[..., :3]
    control = np.stack([c[:, 1], c[:, 1] + c[:, 2], c[:, 1] + 2.0 * c[:, 2] + 3.0 * c[:, 3]], axis=1)
    ahead = c[:, 1:].sum(axis=1)
    ahead = ahead / np.maximum(np.linalg.norm(ahead, axis=1), 1e-300)[:, None]
    return np.asarray((control * ahead[:, None]).sum(axis=2).min(axis=1) < _SLOWEST * np.diff(spline.knots))


def _solved(bands: Numbers, right: Numbers) -> Numbers:
    """x `(m, d)` of A x = `right`, A positive definite with diagonal and upper bands `bands` `(4, m)`.

    Block after block of some rows: A is block tridiagonal.
    """
    count = bands.shape[1]
    blocks = -(-count // _BLOCK)
    size = blocks * _BLOCK
    padded = np.zeros((4, size + 3))
    padded[:, :count] = bands
    padded[0, count:] = 1.0
    for k in range(1, 4):
        padded[k, max(count - k, 0) :] = 0.0
    wanted = np.zeros((size, right.shape[1]))
    wanted[:count] = right
    rows = np.arange(_BLOCK)
    own, beside = np.zeros((blocks, _BLOCK, _BLOCK)), np.zeros((blocks, _BLOCK, _BLOCK))
    by_block = padded[:, :size].reshape(4, blocks, _BLOCK)
    for k in range(4):
        inside = rows + k < _BLOCK
        own[:, rows[inside], rows[inside] + k] = by_block[k][:, inside]
        own[:, rows[inside] + k, rows[inside]] = by_block[k][:, inside]
        beside[:, rows[~inside], rows[~inside] + k - _BLOCK] = by_block[k][:, ~inside]
    wanted = wanted.reshape(blocks, _BLOCK, -1)
    x, carried = np.empty_like(wanted), list[Numbers]()
    for k in range(blocks):
        if k:
            step = carried[-1]
            own[k] -= beside[k - 1].T @ step[:, :_BLOCK]
            wanted[k] -= beside[k - 1].T @ step[:, _BLOCK:]
        carried.append(np.linalg.solve(own[k], np.concatenate([beside[k], wanted[k]], axis=1)))
    for k in reversed(range(blocks)):
        x[k] = carried[k][:, _BLOCK:]
        if k + 1 < blocks:
            x[k] -= carried[k][:, :_BLOCK] @ x[k + 1]
    return x.reshape(size, -1)[:count]
