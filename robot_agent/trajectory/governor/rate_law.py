"""How the rate of path time changes: its second derivative steps between constant values."""

from bisect import bisect_left, bisect_right
from dataclasses import dataclass
from typing import Self, TypeVar

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]
Each = TypeVar("Each", float, Numbers)


def sample_times(count: int, cycle_s: float) -> Numbers:
    """`(count,)` [s] from 0, one cycle apart."""
    return np.arange(count, dtype=np.float64) * cycle_s


@dataclass(frozen=True, slots=True, eq=False)
class RateLaw:
    """The rate from `times[0]` on, with a constant slope of its slope in each piece; the last piece never ends."""

    times: Numbers
    """`(k,)` [s] the beginnings of the pieces, the first at or before 0."""
    states: Numbers
    """`(k, 4)` advance of tau [s], rate, its slope [1/s] and the slope's slope [1/s^2] there."""
    bump: float = 0.0
    """Advance [s] added smoothly from `bump_from` on, over all of the change, so that it ends at an exact tau."""
    bump_from: float = 0.0
    """Time [s]."""

    @classmethod
    def constant(cls, rate: float) -> Self:
        """Always the same rate."""
        return cls(np.zeros(1), np.array([[0.0, rate, 0.0, 0.0]]))

    @classmethod
    def of_pieces(cls, rate: float, slope: float, pieces: list[tuple[float, float]], target: float) -> Self:
        """From (`rate`, `slope`) through pieces of (duration [s], slope's slope) to exactly (`target`, 0)."""
        states, times, at, advance = [], [], 0.0, 0.0
        for duration, bend in pieces:
            times.append(at)
            states.append((advance, rate, slope, bend))
            at += duration
            advance += duration * (rate + duration * (slope / 2.0 + duration * bend / 6.0))
            rate += duration * (slope + duration * bend / 2.0)
            slope += duration * bend
        times.append(at)
        states.append((advance, target, 0.0, 0.0))
        return cls(np.array(times), np.array(states))

    @property
    def duration_s(self) -> float:
        """Until the rate is constant."""
        return float(self.times[-1])

    @property
    def target(self) -> float:
        """The rate at the end."""
        return float(self.states[-1, 1])

    @property
    def advance(self) -> float:
        """Advance of tau [s] until the rate is constant."""
        return float(self.states[-1, 0]) + self.bump

    def at(self, t: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """Advance of tau [s], rate and its slope at times `t` `(m,)` from 0 on."""
        if len(self.times) == 1:
            return self.states[0, 1] * t, np.full_like(t, self.states[0, 1]), np.zeros_like(t)
        piece = self.times.searchsorted(t, side="right") - 1
        advance, rate, slope = _on_piece(t - self.times[piece], *self.states.take(piece, axis=0).T)
        if self.bump == 0.0:
            return advance, rate, slope
        over_s = self.duration_s - self.bump_from
        share = np.clip((t - self.bump_from) / over_s, 0.0, 1.0)
        left, height = 1.0 - share, 30.0 * self.bump / over_s
        return (
            advance + self.bump * share**3 * (10.0 - share * (15.0 - 6.0 * share)),
            rate + height * (share * left) ** 2,
            slope + height * 2.0 * share * left * (left - share) / over_s,
        )

    def state(self, t: float) -> tuple[float, float, float]:
        """Advance of tau [s], rate and its slope at time `t` [s] from 0 on; not for a law with a bump."""
        piece = bisect_right(self.times, t) - 1
        return _on_piece(t - float(self.times[piece]), *self.states[piece].tolist())

    def later(self, t: float) -> "RateLaw":
        """The same law from time `t` [s] on; not for a law with a bump."""
        if len(self.times) == 1:
            return self
        return RateLaw(self.times - t, self.states - np.array([self.state(t)[0], 0.0, 0.0, 0.0]))

    def then(self, t: float, other: "RateLaw") -> "RateLaw":
        """This law until time `t` [s] and `other` from there on; not for this law with a bump."""
        kept = bisect_left(self.times, t)
        times = np.concatenate([self.times[:kept], other.times + t])
        after = other.states + np.array([self.state(t)[0], 0.0, 0.0, 0.0])
        return RateLaw(times, np.concatenate([self.states[:kept], after]), other.bump, t + other.bump_from)

    def longer(self, advance: float) -> "RateLaw":
        """The same change with that much more advance of tau [s], spread over it so that both ends keep their slope."""
        return RateLaw(self.times, self.states, self.bump + advance)


def _on_piece(x: Each, advance: Each, rate: Each, slope: Each, bend: Each) -> tuple[Each, Each, Each]:
    """Advance, rate and slope a time `x` [s] after where a piece begins with these."""
    gain = x * bend
    return advance + x * (rate + x * (slope + gain / 3.0) / 2.0), rate + x * (slope + gain / 2.0), slope + gain
