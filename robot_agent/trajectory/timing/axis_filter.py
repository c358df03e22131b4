"""The filter on every axis: the joints over time, smoothed by a Gaussian window, are the path that is driven."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.trajectory.joints.joint_path import Stretch, share_on_path
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.gaussian_window import gaussian_weights, window_cells
from robot_agent.trajectory.timing.slowdown import joints_slower_by, slower_by
from robot_agent.trajectory.timing.tcp_use import tcp_use
from robot_agent.trajectory.timing.timed import FilterInput, Timed

Numbers = NDArray[np.float64]
Cells = NDArray[np.intp]

_LONGEST_PIECE_S = 8e-3
_MOST_EVEN = 4000
"""Knots, and places at which the TCP is looked at, that are evenly apart: those of some 20 s."""
_EXACT = 2e-7
_SAMPLES = 8
"""Per window, at which the TCP is compared with where it would be without the filter."""
_NEAR_LARGEST, _LOOKED_AT, _FINER = 0.7, 16, 2
"""The largest deviation is looked for beside samples with so much of it, at most so many, so many times finer."""
_ROUNDING = 1e-9
_SAME = 1.0005
"""A clock that had to be slower by no more than this may stay as it is."""


def filtered(model: Model, stretches: Sequence[Stretch], timed: Timed, limits: Limits) -> Timed:
    """`timed` after the filter of `limits.shaping`: at rest at both ends, longer by the window, and in no phase lag.

    The weights are those of a Gaussian, constant in each of the cells of the window. What leaves the filter is a mean
    of what entered it, so no limit of a joint is exceeded; where the TCP would be faster than `stretches` of the
    path allow, or exceed its limits of acceleration and jerk, all of it is slowed down.
    """
    window_s = limits.shaping.filter_s
    pieces = _smoothed(timed.pieces, window_s)
    raw = FilterInput(timed.pieces, timed.times, timed.parameters, window_s)
    deviation, faster = _tcp(model, stretches, raw, pieces, limits)
    k = max(1.0, joints_slower_by(pieces, limits), faster, _harder(model, stretches, raw, pieces, limits))
    times = (timed.times + window_s / 2.0) * k
    return replace(timed, pieces=pieces.slower(1.0 / k), times=times, deviation_m=deviation, raw=replace(raw, slower=k))


def filtered_onward(
    model: Model, stretches: Sequence[Stretch], timed: Timed, before: FilterInput, at_s: float, limits: Limits
) -> Timed | None:
    """`timed` after the filter, where it goes on from the own time `at_s` [s] of what was filtered `before`.

    It begins in the state in which that left the filter, at a knot, and has the same clock; None where that would be
    too fast for what comes.
    """
    lead = before.window_before(at_s)
    times = timed.times + lead.duration_s
    pieces = Pieces.joined([lead, timed.pieces])
    raw = replace(before, pieces=pieces, times=times, parameters=timed.parameters, lead_s=lead.duration_s)
    smooth = _smoothed(pieces, raw.window_s, raw.lead_s)
    deviation, faster = _tcp(model, stretches, raw, smooth, limits)
    if max(joints_slower_by(smooth, limits), faster) > _SAME * raw.slower:
        return None
    times = (timed.times + raw.window_s / 2.0) * raw.slower
    return Timed(smooth.slower(1.0 / raw.slower), times, timed.parameters, deviation, raw)


def _smoothed(pieces: Pieces, window_s: float, from_s: float = 0.0) -> Pieces:
    """The filtered joints: exact values at multiples of a cell, as many of them knots as it takes.

    They begin with what leaves the filter when the value at `from_s` [s], on a multiple of a cell, enters it.
    """
    filtered = _Filtered(pieces, window_s)
    first, last, cell_s = round(from_s / filtered.cell_s), filtered.last, filtered.cell_s
    stride = max(1, math.floor(min(_LONGEST_PIECE_S, window_s / 4.0) / cell_s))
    kept = np.append(np.arange(first, last, stride), last)
    if len(kept) > _MOST_EVEN:  # a slow motion has as many as its way needs, as what it is filtered from
        kept = np.unique(np.ceil(np.append(pieces.knots, [0.0, np.inf]) / cell_s).clip(first, last).astype(np.intp))
    kept = kept[(kept < filtered.late) | (kept == last)]
    while True:
        t = filtered.times(kept)
        made = Pieces.through(t - t[0], *filtered.states(kept))
        inner = kept[:-1, None] + np.rint(np.diff(kept)[:, None] * np.arange(1, stride) / stride).astype(np.intp)
        inner = np.setdiff1d(inner, kept)
        inner = inner[inner < filtered.late]
        away = np.abs(made.position(filtered.times(inner) - t[0]) - filtered.states(inner)[0]).max(axis=1)
        if not (away > _EXACT).any():
            return made
        kept = np.union1d(kept, inner[away > _EXACT])


class _Filtered:
    """What leaves the filter, at multiples of a cell of its window."""

    def __init__(self, pieces: Pieces, window_s: float) -> None:
        cells = window_cells(window_s)
        weights = gaussian_weights(cells)
        self.cell_s = window_s / cells
        # the mean over a cell of a derivative is the difference of what it is the derivative of
        self._steps = np.diff(weights, prepend=0.0, append=0.0) / self.cell_s
        self._pieces = pieces
        self._duration_s = pieces.duration_s + window_s
        self.last = math.ceil(self._duration_s / self.cell_s)
        """The number at which the joints rest."""
        self.late = math.ceil(self._duration_s / self.cell_s - 0.1)
        """Numbers from here on up to the last one are too close to it."""

    def times(self, numbers: Cells) -> Numbers:
        """Times `(k,)` [s] of what has these numbers `(k,)`."""
        return np.where(numbers == self.last, self._duration_s, numbers * self.cell_s)

    def states(self, numbers: Cells) -> Numbers:
        """Position, velocity and acceleration `(3, k, n)`."""
        pieces, start = self._pieces, self._pieces.position(np.zeros(()))
        taps = numbers[:, None] - np.arange(len(self._steps))
        needed, place = np.unique(np.maximum(taps, -1), return_inverse=True)
        place = place.reshape(taps.shape)
        t = np.maximum(needed, 0) * self.cell_s
        entered = np.stack([_integral(pieces, t), pieces.position(t) - start, pieces.derivatives(t)[0]])
        entered[:, needed < 0] = 0.0  # nothing has moved before
        states = np.zeros((3, len(numbers), entered.shape[2]))
        for tap, step in enumerate(self._steps):
            states += step * entered[:, place[:, tap]]
        states[0] += start
        states[:, numbers == self.last] = 0.0
        states[0, numbers == self.last] = pieces.position(np.array(pieces.duration_s))
        return states


def _integral(pieces: Pieces, t: Numbers) -> Numbers:
    """The integral `(k, n)` from 0 to times `t` `(k,)` of the joints' way from the start."""
    knots, powers = pieces.knots, np.arange(1.0, 7.0)[:, None]
    coefficients = pieces.coefficients.copy()
    coefficients[:, 0] -= pieces.position(np.zeros(()))
    coefficients /= powers
    h = np.diff(knots)[:, None]
    starts = np.cumsum((coefficients * h[:, None] ** powers).sum(axis=1), axis=0)
    starts = np.concatenate([np.zeros((1, pieces.coefficients.shape[2])), starts])
    index = np.searchsorted(knots[1:-1], t, side="right")
    x = (np.minimum(t, knots[-1]) - knots[index])[:, None]
    value = np.zeros((len(t), pieces.coefficients.shape[2]))
    for power in range(5, -1, -1):
        value = (value + coefficients[index, power]) * x
    way = pieces.position(np.array(pieces.duration_s)) - pieces.position(np.zeros(()))
    return np.asarray(starts[index] + value + np.maximum(t - knots[-1], 0.0)[:, None] * way)


def _tcp(
    model: Model, stretches: Sequence[Stretch], raw: FilterInput, after: Pieces, limits: Limits
) -> tuple[float, float]:
    """How far the filter takes the TCP off its path [m], and by how much faster than allowed it makes it.

    Allowed is what is anywhere in the window: by the stretches of the path and, before it begins, what the TCP did.
    `after` begins when the value at `raw.lead_s` enters the filter.
    """
    step, half = raw.window_s / _SAMPLES, _SAMPLES // 2
    last = math.ceil(after.duration_s / step)
    looked_at = np.arange(last + 1)
    if last > _MOST_EVEN:
        looked_at = np.unique(np.rint(after.knots / step).astype(np.intp).clip(0, last))
    around = np.minimum(looked_at[:, None] + np.arange(-half, half + 1), last)
    places, near = np.unique(around, return_inverse=True)
    near = near.reshape(around.shape)
    t = np.asarray(looked_at * step, dtype=np.float64)
    own: Numbers = np.asarray(places * step, dtype=np.float64) + (raw.lead_s - raw.window_s / 2.0)
    was = model.forward(raw.pieces.position(own))[:, :3, 3]
    now = model.forward(after.position(t))[:, :3, 3]
    away = np.linalg.norm(was[near] - now[:, None], axis=2)
    nearest = own[near[np.arange(len(near)), away.argmin(axis=1)]]
    deviations = np.minimum(away.min(axis=1), _distances(model, raw.pieces, nearest, step, now))
    deviation = _largest(model, raw.pieces, after, t, nearest, deviations, step)
    allowed = _allowed(stretches, np.interp(own, raw.times, raw.parameters), limits)
    earlier = own < raw.lead_s
    allowed[earlier] = _speeds(model, raw.pieces, own[earlier]) + _ROUNDING
    return deviation, float((_speeds(model, after, t) / allowed[near].max(axis=1)).max())


def _harder(model: Model, stretches: Sequence[Stretch], raw: FilterInput, after: Pieces, limits: Limits) -> float:
    """How much slower all has to be for the TCP's limits of acceleration and jerk.

    They hold where all that is in the window is on the TCP's path.
    """
    first, last = after.knots[1:] - raw.window_s, after.knots[:-1]
    on_path = share_on_path(stretches, *(np.interp(each, raw.times, raw.parameters) for each in (first, last)))
    return slower_by(tcp_use(model, after, on_path == 1.0, limits.path))


def _allowed(stretches: Sequence[Stretch], at: Numbers, limits: Limits) -> Numbers:
    """Linear and angular speed `(k, 2)` that the TCP may have at parameters `at` `(k,)`."""
    tcp = np.array([limits.path.speed_m_s, limits.path.angular_speed_rad_s])
    caps = np.array([[each.speed_m_s, each.rotation_rad_s] for each in stretches])
    on_path = np.array([each.on_path for each in stretches])
    caps[on_path] = np.minimum(caps[on_path], tcp)
    return np.asarray(caps[np.searchsorted([each.end for each in stretches[:-1]], at, side="right")])


def _speeds(model: Model, pieces: Pieces, t: Numbers) -> Numbers:
    """Linear and angular speed of the TCP `(k, 2)`."""
    twist = (model.jacobian(pieces.position(t)) @ pieces.derivatives(t)[0][..., None])[..., 0]
    return np.stack([np.linalg.norm(twist[:, :3], axis=1), np.linalg.norm(twist[:, 3:], axis=1)], axis=1)


def _largest(
    model: Model, path: Pieces, after: Pieces, t: Numbers, nearest: Numbers, deviations: Numbers, step: float
) -> float:
    """The largest deviation [m], between the samples `t` `(k,)` too: looked for beside those that come near to it."""
    high = np.flatnonzero(deviations >= _NEAR_LARGEST * deviations.max())
    for _ in range(_FINER):
        if len(high) > _LOOKED_AT:
            high = high[np.argsort(-deviations[high])[:_LOOKED_AT]]
        beside = step * np.linspace(-0.5, 0.5, 5)
        t = np.clip(t[high, None] + beside, 0.0, after.duration_s).ravel()
        nearest = (nearest[high, None] + beside).ravel()
        places = model.forward(after.position(t))[:, :3, 3]
        deviations, step = _distances(model, path, nearest, 2.0 * step, places), step / 4.0
        high = np.arange(len(t))
    return float(deviations.max())


def _distances(model: Model, path: Pieces, near: Numbers, step: float, places: Numbers) -> Numbers:
    """Distances `(k,)` [m] of `places` `(k, 3)` from the TCP's path, each nearest to it within `step` of a time."""
    t = near
    for _ in range(3):
        q, qd = path.position(t), path.derivatives(t)[0]
        velocity = (model.jacobian(q)[:, :3] @ qd[..., None])[..., 0]
        missing = places - model.forward(q)[:, :3, 3]
        square = np.maximum((velocity**2).sum(axis=1), 1e-12)
        t = np.clip(t + (missing * velocity).sum(axis=1) / square, near - step, near + step)
    return np.asarray(np.linalg.norm(places - model.forward(path.position(t))[:, :3, 3], axis=1))
