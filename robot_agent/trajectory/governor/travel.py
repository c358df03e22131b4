"""A motion travelled in one direction: forwards as planned, or backwards along the same path."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.governor.segment import PathState
from robot_agent.trajectory.motion import Motion

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Travel:
    """Path time `way` [s] grows in the direction of travel; forwards it is tau, backwards the time left to tau 0."""

    motion: Motion
    sign: float
    """1 forwards, -1 backwards."""
    rests: tuple[float, ...]
    """Rising values of way at which the plan itself is at rest, both ends among them."""
    degree: int
    """Of the polynomials of the motion."""

    @classmethod
    def of(cls, motion: Motion, forwards: bool) -> "Travel":
        rests = motion.rests if forwards else (motion.duration_s - motion.rests)[::-1]
        degree = 5 if motion.pieces.coefficients[:, 4:].any() else 3
        return cls(motion, 1.0 if forwards else -1.0, tuple(rests.tolist()), degree)

    @property
    def duration_s(self) -> float:
        return self.motion.duration_s

    def way(self, tau: float) -> float:
        return tau if self.sign > 0.0 else self.motion.duration_s - tau

    def ways(self, taus: Numbers) -> Numbers:
        return taus if self.sign > 0.0 else self.motion.duration_s - taus

    def taus(self, way: Numbers) -> Numbers:
        """The other way round; a rest of the travel is exactly the rest of the motion."""
        if self.sign > 0.0:
            return way
        at = np.minimum(np.searchsorted(self.rests, way), len(self.rests) - 1)
        return np.where(np.array(self.rests)[at] == way, self.motion.rests[::-1][at], self.motion.duration_s - way)

    def state(self, state: PathState) -> PathState:
        """A state in tau as a state of the travel."""
        return PathState(self.way(state.tau), self.sign * state.rate, self.sign * state.rate_dot)

    def sampled(self, taus: Numbers) -> tuple[Numbers, Numbers]:
        """Joints and, at rate 1, their velocity, each `(m, n)` at planned times `(m,)`."""
        c, x = self._located(taus)
        return _value(c, x), _value(_differentiated(c), x)

    def derivatives(self, way: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """First to third derivative of the joints by the way `(m,)`, each `(m, n)`."""
        c, x = self._located(way if self.sign > 0.0 else self.motion.duration_s - way)
        first = _differentiated(c)
        second = _differentiated(first)
        return self.sign * _value(first, x), _value(second, x), self.sign * _value(_differentiated(second), x)

    def _located(self, taus: Numbers) -> tuple[Numbers, Numbers]:
        """The polynomials `(degree + 1, m, n)` at planned times `(m,)`, and the time `(m, 1)` [s] since their knots."""
        pieces = self.motion.pieces
        piece = np.searchsorted(pieces.knots[1:-1], taus, side="right")
        coefficients = pieces.coefficients[:, : self.degree + 1][piece]
        return np.ascontiguousarray(coefficients.transpose(1, 0, 2)), (taus - pieces.knots[piece])[:, None]

    def next_rest(self, way: float) -> float:
        """The first rest of the plan from `way` on."""
        return self.rests[min(bisect_left(self.rests, way), len(self.rests) - 1)]

    def rest_before(self, way: float) -> float:
        """The last rest of the plan up to `way`."""
        return self.rests[max(bisect_right(self.rests, way) - 1, 0)]


def _value(c: Numbers, x: Numbers) -> Numbers:
    """`(m, n)` of polynomials with coefficients `(k, m, n)` of rising powers at `x` `(m, 1)`."""
    value: Numbers = c[-1]
    for each in c[-2::-1]:
        value = value * x + each
    return value


def _differentiated(c: Numbers) -> Numbers:
    """Coefficients `(k - 1, m, n)` of the derivatives of polynomials."""
    return c[1:] * np.arange(1.0, len(c))[:, None, None]
