"""How the rate of path time changes from one value to another."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


def sample_times(count: int, cycle_s: float) -> Numbers:
    """`(count,)` [s] from 0, one cycle apart."""
    return np.arange(count, dtype=np.float64) * cycle_s


@dataclass(frozen=True, slots=True, eq=False)
class RateLaw:
    """The rate as a cubic from (`rate`, `slope`) to (`target`, 0) within `duration_s`, constant after that.

    The fields broadcast, so one law can stand for many candidates: `(k, 1)` fields and `(k, p)` times.
    """

    rate: Numbers
    slope: Numbers
    target: Numbers
    duration_s: Numbers

    @classmethod
    def one(cls, rate: float, slope: float, target: float, duration_s: float) -> "RateLaw":
        """A single law."""
        return cls(np.array(rate), np.array(slope), np.array(target), np.array(duration_s))

    def pick(self, index: int) -> "RateLaw":
        """Candidate `index` of many as a single law."""
        shape = self.duration_s.shape
        fields = (self.rate, self.slope, self.target, self.duration_s)
        return RateLaw(*(np.broadcast_to(field, shape)[index, 0] for field in fields))

    def at(self, t: Numbers) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """Advance of tau [s], rate, its slope and the slope's slope at times `t` since the beginning."""
        whole = self.duration_s
        x = np.minimum(t / whole, 1.0)
        rise, lean = self.target - self.rate, self.slope * whole
        square, cube = 3.0 * rise - 2.0 * lean, lean - 2.0 * rise
        advance = whole * x * (self.rate + x * (lean / 2.0 + x * (square / 3.0 + x * cube / 4.0)))
        rate = self.rate + x * (lean + x * (square + x * cube))
        slope = (lean + x * (2.0 * square + x * 3.0 * cube)) / whole
        bend = (2.0 * square + x * 6.0 * cube) / whole**2
        done = t >= whole
        return (
            advance + self.target * np.maximum(t - whole, 0.0),
            np.where(done, self.target, rate),
            np.where(done, 0.0, slope),
            np.where(t > whole, 0.0, bend),
        )

    @property
    def advance(self) -> Numbers:
        """Advance of tau [s] over the whole change."""
        return self.duration_s * ((self.rate + self.target) / 2.0 + self.slope * self.duration_s / 12.0)


def stopping_in(rate: Numbers, slope: Numbers, distance: Numbers) -> Numbers:
    """Duration of the law from (`rate`, `slope`) to rate 0 that advances tau by exactly `distance` (> 0).

    The positive root of slope/12 T^2 + rate/2 T = distance; infinite where there is none.
    """
    half = rate / 2.0
    under = half**2 + slope * distance / 3.0
    divisor = half + np.sqrt(np.maximum(under, 0.0))
    possible = (under >= 0.0) & (divisor > 1e-12)
    return np.where(possible, 2.0 * distance / np.where(possible, divisor, 1.0), np.inf)
