"""Joints over time as polynomials between knots."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

_DEGREES = 6
_POWERS = np.arange(_DEGREES)


@dataclass(frozen=True, slots=True, eq=False)
class Pieces:
    """Quintic polynomials between `knots` `(p + 1,)` [s]; `coefficients` `(p, 6, n)` of the powers of t - knot.

    Before the first and after the last knot the joints rest.
    """

    knots: NDArray[np.float64]
    coefficients: NDArray[np.float64]

    @classmethod
    def standing(cls, q: NDArray[np.float64]) -> Self:
        """No motion at joints `q` `(n,)`."""
        coefficients = np.zeros((1, 6, len(q)))
        coefficients[0, 0] = q
        return cls(np.zeros(2), coefficients)

    @classmethod
    def through(
        cls, knots: NDArray[np.float64], q: NDArray[np.float64], qd: NDArray[np.float64], qdd: NDArray[np.float64]
    ) -> Self:
        """The quintic Hermite curve through states `(p + 1, n)` at `knots` `(p + 1,)`; acceleration is continuous."""
        states = np.stack([q, qd, qdd])
        return cls.between(knots, states[:, :-1], states[:, 1:])

    @classmethod
    def between(cls, knots: NDArray[np.float64], first: NDArray[np.float64], last: NDArray[np.float64]) -> Self:
        """Quintic Hermite pieces, each from its state `first` to its state `last`.

        Both are value, first and second derivative `(3, p, n)` at the ends of each piece.
        """
        h = np.diff(knots)[:, None]
        (q, qd, qdd), (q_last, qd_last, qdd_last) = first, last
        position = q_last - (q + h * (qd + h * qdd / 2.0))
        velocity = h * (qd_last - (qd + h * qdd))
        acceleration = h * h * (qdd_last - qdd)
        coefficients = np.stack(
            [
                q,
                qd,
                qdd / 2.0,
                (10.0 * position - 4.0 * velocity + acceleration / 2.0) / h**3,
                (-15.0 * position + 7.0 * velocity - acceleration) / h**4,
                (6.0 * position - 3.0 * velocity + acceleration / 2.0) / h**5,
            ],
            axis=1,
        )
        return cls(knots, coefficients)

    @classmethod
    def joined(cls, parts: list[Self]) -> Self:
        """Parts one after the other in time."""
        knots, offset = [np.zeros(1)], 0.0
        for part in parts:
            knots.append(part.knots[1:] + offset)
            offset += float(part.knots[-1])
        return cls(np.concatenate(knots), np.concatenate([part.coefficients for part in parts]))

    @property
    def duration_s(self) -> float:
        return float(self.knots[-1])

    def slower(self, k: float) -> Self:
        """The same curve at `k` times the speed."""
        powers = k ** np.arange(6.0)
        return type(self)(self.knots / k, self.coefficients * powers[:, None])

    def position(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """`(..., n)` at times `t` `(...)`."""
        return _value(*self._locate(t))

    def with_slope(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Value and first derivative `(..., n)` of the curve itself at times `t` `(...)`, at its ends too."""
        c, x = self._locate(t)
        return _value(c, x), _first(c, x)

    def derivatives(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """First to third derivative `(3, ..., n)` at times `t` `(...)`; zero where the joints rest."""
        t = np.asarray(t)
        moving = (t >= 0.0) & (t < self.duration_s)
        return self.slopes(t) * moving[..., None]

    def shape(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Value and first to third derivative `(4, ..., n)` of the curve itself, at its ends too."""
        c, x = self._locate(t)
        return np.stack([_value(c, x), *_derivatives(c, x)])

    def slopes(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """First to third derivative `(3, ..., n)` of the curve itself, at its ends too."""
        return np.stack(_derivatives(*self._locate(t)))

    def bends(self, t: NDArray[np.float64]) -> NDArray[np.float64]:
        """Second derivative `(..., n)` of the curve itself, at its ends too."""
        return _second(*self._locate(t))

    def part(self, first: float, last: float) -> Self:
        """The curve from `first` to `last`; the parameter of the part begins at 0."""
        inner = self.knots[(self.knots > first + 1e-12) & (self.knots < last - 1e-12)]
        starts = np.concatenate([[first], inner])
        # by their middles: where it begins just before a knot it is the piece after that knot
        piece = np.searchsorted(self.knots[1:-1], (starts + np.append(inner, last)) / 2.0, side="right")
        c, x = self.coefficients[piece], (starts - self.knots[piece])[:, None]
        shifted = np.zeros_like(c)
        for low in range(6):
            for high in range(low, 6):
                shifted[:, low] += math.comb(high, low) * c[:, high] * x ** (high - low)
        return type(self)(np.concatenate([starts, [last]]) - first, shifted)

    def peaks(self, places: int = 5) -> NDArray[np.float64]:
        """Largest magnitude `(3, n)` of velocity, acceleration and jerk, looked at in so many places of each piece."""
        return np.asarray(np.abs(self.inside(places)).max(axis=(1, 2)))

    def inside(self, places: int) -> NDArray[np.float64]:
        """Velocity, acceleration and jerk `(3, places, p, n)` in so many places of each piece, both ends included."""
        c = np.ascontiguousarray(self.coefficients.transpose(1, 0, 2))
        share, width = np.linspace(0.0, 1.0, places)[:, None, None], np.diff(self.knots)[:, None]
        return np.stack(_derivatives(c, share * _filled(width, c.shape[1:])))

    def _locate(self, t: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The polynomials `(6, ..., n)` at times `t` `(...)`, and the times `(..., n)` since their knots.

        Both without gaps and of one shape, since arithmetic on many short rows takes twice as long.
        """
        t = np.asarray(t, dtype=np.float64)
        piece = np.searchsorted(self.knots[1:-1], t, side="right")
        rows = self.coefficients.reshape(-1, self.coefficients.shape[2])
        c = rows.take(np.add.outer(_POWERS, _DEGREES * piece), axis=0)
        x = np.minimum(np.maximum(t, 0.0), self.knots[-1]) - self.knots[piece]
        return c, _filled(x[..., None], c.shape[1:])


def _filled(x: NDArray[np.float64], shape: tuple[int, ...]) -> NDArray[np.float64]:
    filled = np.empty(shape)
    filled[...] = x
    return filled


def _value(c: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    value: NDArray[np.float64] = c[-1]
    for each in c[-2::-1]:
        value = value * x + each
    return value


def _derivatives(c: NDArray[np.float64], x: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    c3, c4, c5 = c[3:]
    third = 6.0 * c3 + x * (24.0 * c4 + x * 60.0 * c5)
    return _first(c, x), _second(c, x), third


def _first(c: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    c1, c2, c3, c4, c5 = c[1:]
    first: NDArray[np.float64] = c1 + x * (2.0 * c2 + x * (3.0 * c3 + x * (4.0 * c4 + x * 5.0 * c5)))
    return first


def _second(c: NDArray[np.float64], x: NDArray[np.float64]) -> NDArray[np.float64]:
    c2, c3, c4, c5 = c[2:]
    second: NDArray[np.float64] = 2.0 * c2 + x * (6.0 * c3 + x * (12.0 * c4 + x * 20.0 * c5))
    return second
