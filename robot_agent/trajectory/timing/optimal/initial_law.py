"""A smooth motion along a path that is given: the law whose rate is then changed until none is faster."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.timing.affine import Numbers


@dataclass(frozen=True, slots=True, eq=False)
class InitialLaw:
    """s(tau) as a cubic B-spline with control points `points` `(intervals + 3,)`, rising, and intervals of `h` [s].

    Three equal control points at either end let it rest there. Where its intervals shall last longer than others it is
    as much too fast.
    """

    points: Numbers
    h: float
    rates: Numbers
    """`(intervals,)` at which its tau shall pass: 1, or less where it is too fast; 1 at either end."""

    @classmethod
    def rising(cls, points: Numbers, h: float, rates: Numbers) -> "InitialLaw":
        """With control points that never fall."""
        return cls(np.minimum(np.maximum.accumulate(points), points[-1]), h, rates)

    @property
    def intervals(self) -> int:
        return len(self.points) - 3

    @property
    def duration_s(self) -> float:
        return self.intervals * self.h

    def places(self, interval: NDArray[np.intp], place: Numbers) -> Numbers:
        """s `(...)` in intervals `(...)` at places `(...)` in 0 to 1 of them."""
        u, v, c = place, 1.0 - place, [self.points[interval + k] for k in range(4)]
        uu, vv = u * u, v * v
        inner = (3.0 * uu * u - 6.0 * uu + 4.0) * c[1] + (3.0 * vv * v - 6.0 * vv + 4.0) * c[2]
        return np.clip((vv * v * c[0] + inner + uu * u * c[3]) / 6.0, 0.0, self.points[-1])

    def at(self, interval: NDArray[np.intp], place: Numbers) -> Numbers:
        """s and three derivatives `(4, ...)` in intervals `(...)` at places `(...)` in 0 to 1 of them."""
        u, c = place, [self.points[interval + k] for k in range(4)]
        v = 1.0 - u
        one, two, three = c[1] - c[0], c[2] - c[1], c[3] - c[2]
        bend, later = two - one, three - two
        return np.stack(
            [
                self.places(interval, place),
                (v * v * one + (1.0 + 2.0 * u * v) * two + u * u * three) / (2.0 * self.h),
                (v * bend + u * later) / self.h**2,
                (later - bend) / self.h**3 + 0.0 * u,
            ]
        )
