"""A motion travelled in one direction: forwards as planned, or backwards along the same path."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.segment import PathState

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Path time `way` [s] grows in the direction of travel; forwards it is tau, backwards the time left to tau 0."""

    motion: Motion
    sign: float
    """1 forwards, -1 backwards."""
    rests: Numbers
    """Rising values of way at which the plan itself is at rest, both ends among them."""
    degree: int
    """Of the polynomials of the motion."""

    @classmethod
    def of(cls, motion: Motion, forwards: bool) -> "Track":
        rests = motion.rests if forwards else (motion.duration_s - motion.rests)[::-1]
        degree = 5 if motion.pieces.coefficients[:, 4:].any() else 3
        return cls(motion, 1.0 if forwards else -1.0, rests, degree)

    @property
    def duration_s(self) -> float:
        return self.motion.duration_s

    def way(self, tau: float) -> float:
        return tau if self.sign > 0.0 else self.motion.duration_s - tau

    def ways(self, taus: Numbers) -> Numbers:
        return taus if self.sign > 0.0 else self.motion.duration_s - taus

    def taus(self, way: Numbers) -> Numbers:
        """The other way round; a rest of the track is exactly the rest of the motion."""
        if self.sign > 0.0:
            return way
        at = np.minimum(np.searchsorted(self.rests, way), len(self.rests) - 1)
        return np.where(self.rests[at] == way, self.motion.rests[::-1][at], self.motion.duration_s - way)

    def state(self, state: PathState) -> PathState:
        """A state in tau as a state of the track."""
        return PathState(self.way(state.tau), self.sign * state.rate, self.sign * state.rate_dot)

    def sampled(self, taus: Numbers) -> tuple[Numbers, Numbers]:
        """Joints and, at rate 1, their velocity, each `(m, n)` at planned times `(m,)`."""
        pieces = self.motion.pieces
        piece = np.searchsorted(pieces.knots[1:-1], taus, side="right")
        x = (taus - pieces.knots[piece])[:, None]
        c, degree = pieces.coefficients[piece].transpose(1, 0, 2), self.degree
        q, qd = c[degree], degree * c[degree]
        for power in range(degree - 1, 0, -1):
            q, qd = q * x + c[power], qd * x + power * c[power]
        return q * x + c[0], qd

    def derivatives(self, way: Numbers) -> Numbers:
        """First to third derivative `(3, m, n)` of the joints by the way `(m,)`."""
        if self.sign > 0.0:
            return self.motion.pieces.derivatives(way)
        derivatives: Numbers = self.motion.pieces.derivatives(self.motion.duration_s - way)
        signs: Numbers = np.array([-1.0, 1.0, -1.0])[:, None, None]
        return derivatives * signs

    def next_rest(self, way: float) -> float:
        """The first rest of the plan from `way` on."""
        return float(self.rests[min(int(np.searchsorted(self.rests, way)), len(self.rests) - 1)])

    def rest_before(self, way: float) -> float:
        """The last rest of the plan up to `way`."""
        return float(self.rests[max(int(np.searchsorted(self.rests, way, side="right")) - 1, 0)])
