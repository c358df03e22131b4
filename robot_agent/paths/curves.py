"""Curves of the TCP's position, by their own length: equal steps of the parameter are equal distances.

Every curve has a `length_m` and answers `at(distance_m)`, distances `(...)` from its beginning, with position, unit
tangent and curvature vector `(3, ..., 3)` [m, 1, 1/m].
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_HIGHEST = 5
_DERIVED = np.array([np.diag([float(math.perm(p, k)) for p in range(k, _HIGHEST + 1)], k) for k in range(3)])
"""What the coefficients of a polynomial and of its two derivatives are of its own ones."""
_CELLS = 48
_EDGES = np.arange(_CELLS + 1) / _CELLS
_NEWTON_STEPS = 4
_SMALL_STEP = 1e-8
"""After it the next one would be below rounding."""
_GAUSS_X, _GAUSS_W = (values / 2.0 for values in np.polynomial.legendre.leggauss(6))
_SMALLEST_SPEED = 1e-12
_EXACT_M = 1e-8
"""Largest distance by which a place in the middle of a cell may be passed early or late."""


class Curve(Protocol):
    """A curve of known length."""

    @property
    def length_m(self) -> float: ...

    def at(self, distance_m: Numbers) -> Numbers: ...


@dataclass(frozen=True, slots=True, eq=False)
class Straight:
    """A straight line from `start` `(3,)` along the unit vector `direction` `(3,)`."""

    start: Numbers
    direction: Numbers
    length_m: float

    def at(self, distance_m: Numbers) -> Numbers:
        """See the module."""
        distance = np.asarray(distance_m, dtype=np.float64)[..., None]
        states = np.zeros((3, *distance.shape[:-1], 3))
        states[0], states[1] = self.start + distance * self.direction, self.direction
        return states


@dataclass(frozen=True, slots=True, eq=False)
class Circle:
    """A circular arc about `centre` `(3,)`: from `centre + radius_m * u` towards `v`, both `(3,)` unit vectors.

    `angle_rad` is signed and may be several turns. With `lift_m` it is a helix: it climbs so far from its beginning to
    its end, evenly, along u x v.
    """

    centre: Numbers
    u: Numbers
    v: Numbers
    radius_m: float
    angle_rad: float
    lift_m: float = 0.0

    @property
    def length_m(self) -> float:
        return math.hypot(self.radius_m * self.angle_rad, self.lift_m)

    def at(self, distance_m: Numbers) -> Numbers:
        """See the module."""
        distance, length = np.asarray(distance_m, dtype=np.float64)[..., None], self.length_m
        turn = self.angle_rad / length
        climb = self.lift_m / length * np.cross(self.u, self.v) if self.lift_m else np.zeros(3)
        outwards = np.cos(turn * distance) * self.u + np.sin(turn * distance) * self.v
        onwards = np.cos(turn * distance) * self.v - np.sin(turn * distance) * self.u
        place = self.centre + self.radius_m * outwards + distance * climb
        return np.stack([place, self.radius_m * turn * onwards + climb, -self.radius_m * turn**2 * outwards])


@dataclass(frozen=True, eq=False)
class Polynomial:
    """A curve of at most fifth degree, `coefficients` `(degree + 1, 3)` of the powers of u in 0 to 1, by its length.

    The length is integrated by six-point Gauss in cells; u of a length follows by Newton from its cell.
    """

    coefficients: Numbers

    @cached_property
    def length_m(self) -> float:
        return float(self.starts[-1])

    @cached_property
    def starts(self) -> Numbers:
        """Distances `(cells + 1,)` at which the cells begin, and the end."""
        lengths = _distance(self._tangents, _EDGES[:-1], np.full(_CELLS, 1.0 / _CELLS))
        return np.append(0.0, np.cumsum(lengths))

    @cached_property
    def orders(self) -> Numbers:
        """Coefficients `(degree + 1, 9)` of the curve and its two derivatives by u."""
        count = len(self.coefficients)
        return np.concatenate(_DERIVED[:, :count, :count] @ self.coefficients, axis=1)

    @property
    def _tangents(self) -> Numbers:
        """Coefficients `(degree, 3)` of the first derivative by u."""
        return self.orders[:-1, 3:6]

    def parameter(self, distance_m: Numbers) -> Numbers:
        """u `(...)` at `distance_m` `(...)`."""
        distance = np.clip(np.asarray(distance_m, dtype=np.float64), 0.0, self.length_m)
        cell = np.searchsorted(self.starts[1:-1], distance, side="right")
        return _parameter(self._tangents, distance, cell, self.starts[cell], self.starts[cell + 1])

    def derivative(self, u: Numbers, order: int) -> Numbers:
        """The `order`-th derivative by u, up to the second, `(..., 3)` at u `(...)`; 0 is the position."""
        return _powers(u, len(self.orders)) @ self.orders[:, 3 * order : 3 * order + 3]

    def at(self, distance_m: Numbers) -> Numbers:
        """See the module."""
        u = self.parameter(distance_m)
        return _states(_powers(u, len(self.orders)) @ self.orders)


class Polynomials:
    """Several polynomial curves, for asking about many places on all of them at once.

    u of a length is a quintic in each cell, which begins and ends with the rates at which u grows there. Where one of
    the curves nearly stands, and that is too rough, u follows by Newton.
    """

    def __init__(self, curves: Sequence[Polynomial]) -> None:
        """At least one curve."""
        highest = max(len(each.coefficients) for each in curves)
        self._orders = np.zeros((len(curves), highest, 9))
        for number, each in enumerate(curves):
            self._orders[number, : len(each.orders)] = each.orders
        self._tangents = self._orders[:, :-1, 3:6]
        self._starts = np.stack([each.starts for each in curves])
        self._clock = self._clocks()

    def at(self, which: NDArray[np.intp], distance_m: Numbers) -> Numbers:
        """States as in the module `(3, k, 3)`, each at a distance `(k,)` on the curve with number `which` `(k,)`."""
        u = self.parameter(which, distance_m)
        return _states((_powers(u, self._orders.shape[1])[:, None] @ self._orders[which])[:, 0])

    def parameter(self, which: NDArray[np.intp], distance_m: Numbers) -> Numbers:
        """u `(k,)` at these distances on these curves."""
        starts = self._starts[which]
        distance = np.clip(distance_m, 0.0, starts[:, -1])
        cell = (starts[:, 1:-1] <= distance[:, None]).sum(axis=1)
        first, last = self._starts[which, cell], self._starts[which, cell + 1]
        if self._clock is None:
            return _parameter(self._tangents[which], distance, cell, first, last)
        share = (distance - first) / (last - first)
        return np.asarray((_powers(share, 6) * self._clock[which, cell]).sum(axis=1))

    def distance(self, which: NDArray[np.intp], u: Numbers) -> Numbers:
        """Distances `(k,)` [m] at which these curves pass u `(k,)`."""
        cell = np.clip((u * _CELLS).astype(np.intp), 0, _CELLS - 1)
        edge = cell / _CELLS
        return np.asarray(self._starts[which, cell] + _distance(self._tangents[which], edge, u - edge))

    def derivatives(self, which: NDArray[np.intp], u: Numbers) -> Numbers:
        """Place and its two derivatives by u `(3, k, 3)`."""
        values = (_powers(u, self._orders.shape[1])[:, None] @ self._orders[which])[:, 0]
        return np.moveaxis(values.reshape(-1, 3, 3), 1, 0)

    def _clocks(self) -> Numbers | None:
        """Coefficients `(curves, cells, 6)` of u over the share of a cell's distance; None where that is too rough."""
        values = _powers(_EDGES, self._orders.shape[1]) @ self._orders
        first, second = values[..., 3:6], values[..., 6:]
        square = np.maximum((first * first).sum(axis=-1), _SMALLEST_SPEED)
        edges = np.broadcast_to(_EDGES, square.shape)
        rates = np.stack([edges, 1.0 / np.sqrt(square), -(first * second).sum(axis=-1) / square**2])
        lengths = np.diff(self._starts, axis=1)
        scale = np.stack([np.ones_like(lengths), lengths, lengths**2])
        made = np.moveaxis(hermite(rates[..., :-1] * scale, rates[..., 1:] * scale), 0, -1)
        begins, middle = edges[:, :-1], made @ 0.5 ** np.arange(6.0)
        away = _distance(self._tangents[:, None], begins, middle - begins) - lengths / 2.0
        return made if np.abs(away).max() < _EXACT_M else None


def _powers(u: Numbers, count: int) -> Numbers:
    """The first powers `(..., count)` of u `(...)`."""
    made = np.ones((*np.shape(u), count))
    for power in range(1, count):
        np.multiply(made[..., power - 1], u, out=made[..., power])
    return made


def _parameter(c: Numbers, distance: Numbers, cell: NDArray[np.intp], first: Numbers, last: Numbers) -> Numbers:
    """u `(...)` of distances `(...)` that lie in cells, which reach from distance `first` to `last`.

    Here and below `c` are the coefficients of the derivative by u: of one polynomial `(degree, 3)`, or of one for each
    distance `(..., degree, 3)`.
    """
    missing, edge = distance - first, cell / _CELLS
    step = missing / np.maximum(last - first, _SMALLEST_SPEED) / _CELLS
    for _ in range(_NEWTON_STEPS):
        speed = np.maximum(_speeds(c, (edge + step)[..., None])[..., 0], _SMALLEST_SPEED)
        change = (_distance(c, edge, step) - missing) / speed
        step = step - change
        if np.abs(change).max(initial=0.0) < _SMALL_STEP:
            break
    return np.asarray(edge + step)


def _distance(c: Numbers, u: Numbers, step: Numbers) -> Numbers:
    return np.asarray(step * (_speeds(c, u[..., None] + step[..., None] * (0.5 + _GAUSS_X)) @ _GAUSS_W))


def _speeds(c: Numbers, u: Numbers) -> Numbers:
    """How fast the place changes by u `(..., m)`, m of them for each polynomial."""
    tangents = _powers(u, c.shape[-2]) @ c
    return np.asarray(np.sqrt(np.einsum("...i,...i", tangents, tangents)))


def _states(values: Numbers) -> Numbers:
    """Position, tangent and curvature `(3, ..., 3)` from position and two derivatives by u `(..., 9)`."""
    first, second = values[..., 3:6], values[..., 6:]
    square = np.maximum((first * first).sum(axis=-1, keepdims=True), _SMALLEST_SPEED**2)
    tangent = first / np.sqrt(square)
    bent = second - tangent * (tangent * second).sum(axis=-1, keepdims=True)
    return np.stack([values[..., :3], tangent, bent / square])


@dataclass(frozen=True, slots=True, eq=False)
class Trimmed:
    """The part of `curve` from distance `first_m` to `last_m`."""

    curve: Curve
    first_m: float
    last_m: float

    @property
    def length_m(self) -> float:
        return self.last_m - self.first_m

    def at(self, distance_m: Numbers) -> Numbers:
        """See the module."""
        return self.curve.at(self.first_m + np.asarray(distance_m, dtype=np.float64))


def bezier(points: Numbers) -> Polynomial:
    """The Bezier curve with control points `(degree + 1, 3)` [m]."""
    degree = len(points) - 1
    rows = np.zeros((degree + 1, degree + 1))
    for k in range(degree + 1):
        for power in range(k, degree + 1):
            sign = (-1.0) ** (power - k)
            rows[power, k] = sign * math.comb(degree, k) * math.comb(degree - k, power - k)
    return Polynomial(rows @ np.asarray(points, dtype=np.float64))


def hermite(first: Numbers, last: Numbers) -> Numbers:
    """Coefficients `(6, d)` over u in 0 to 1 of the quintic between two ends.

    `first` and `last` `(3, d)` are value, first and second derivative by u there.
    """
    position = last[0] - (first[0] + first[1] + first[2] / 2.0)
    velocity = last[1] - (first[1] + first[2])
    acceleration = last[2] - first[2]
    return np.stack(
        [
            first[0],
            first[1],
            first[2] / 2.0,
            10.0 * position - 4.0 * velocity + acceleration / 2.0,
            -15.0 * position + 7.0 * velocity - acceleration,
            6.0 * position - 3.0 * velocity + acceleration / 2.0,
        ]
    )


def joining(first: Numbers, last: Numbers, scale_m: float) -> Polynomial:
    """The smooth curve from state `first` to state `last` `(3, 3)` as `at` gives them: same place, tangent, curvature.

    `scale_m` is the length of the derivative by u at both ends. With twice the distance to the corner of two straight
    lines it is the quartic round edge of Frigeni, Industrial Robotics Control, (5-33); for curved neighbours the book's
    control points would not even keep the tangents.
    """
    scale = np.array([1.0, scale_m, scale_m**2])[:, None]
    return Polynomial(hermite(first * scale, last * scale))
