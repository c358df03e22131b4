"""Holds the SYNCs of a bus to multiples of its cycle by the cell clock, so that all buses of a cell keep in step."""

import math

from cell.messages import ManagerState
from cell.net.clock import ManagerClock

MOST_RATE = 100e-6
"""[s/s] The cycle is no longer or shorter by more; drives and agents see nothing of it."""
CATCH_UP_RATE = 0.005
"""[s/s] The same after the own cycles have slipped: half a cycle of 20 ms is made up for within 2 s."""
SLIP = 0.1
"""Of a cycle: one that begins so much too late after the one before may have moved all later ones."""
SILENT_S = 2.0
"""A manager that was not heard for so long gives no clock."""
_PROPORTIONAL = 0.5
"""[1/s]"""
_INTEGRAL = 0.25 * _PROPORTIONAL**2
"""[1/s^2] Critical damping: both poles at half of the proportional gain."""
_RE_WRAP = 0.75
"""Of a cycle: beyond, the SYNC before or after is so much nearer that it is the one to go for."""


class PhaseLock:
    """A phase-locked loop of second order over the instants at which cycles begin.

    Where the manager's clock jumps, or another manager comes, the new phase is approached at `MOST_RATE` at most. After
    a stall of the own loop, which leaves its cycles late, it is `CATCH_UP_RATE` until the phase is there. Without a
    manager the loop runs free, by the own clock.
    """

    def __init__(self, cycle_s: float) -> None:
        self._cycle_s = cycle_s
        self.clock = ManagerClock()
        self._heard_at: float | None = None
        self._drift = 0.0
        self._due: float | None = None
        """When the next cycle begins, by the own clock."""
        self._catching_up = False
        self.error_s: float | None = None
        """How much the newest SYNC was behind its moment by the cell clock, within one cycle; `None`: no manager."""

    def heard(self, state: ManagerState, at: float, round_s: float = math.inf) -> None:
        """A manager's state arrived at `at` [s]; it answers what this gateway sent `round_s` [s] before."""
        self.clock.heard(state, at, round_s)
        self._heard_at = at

    def trim(self, now: float) -> float:
        """By how much the next cycle is to come later than a cycle after this one, which began at `now` [s]."""
        slipped = self._due is not None and now - self._due > SLIP * self._cycle_s
        trim = self._trim(now, slipped)
        self._due = now + self._cycle_s + trim
        return trim

    def _trim(self, now: float, slipped: bool) -> float:
        moment = self.clock.moment(now)
        if moment is None or self._heard_at is None or now - self._heard_at > SILENT_S:
            self.error_s, self._drift, self._catching_up = None, 0.0, False
            return 0.0
        self.error_s = self._near(moment.seconds)
        self._catching_up = (self._catching_up or slipped) and abs(self.error_s) > CATCH_UP_RATE * self._cycle_s
        if self._catching_up:
            return -math.copysign(CATCH_UP_RATE, self.error_s) * self._cycle_s
        rate = _PROPORTIONAL * self.error_s + self._drift
        if abs(rate) < MOST_RATE:
            self._drift += _INTEGRAL * self.error_s * self._cycle_s
        return -min(max(rate, -MOST_RATE), MOST_RATE) * self._cycle_s

    def _near(self, cell_time: float) -> float:
        """The phase error nearest to the last one, so that noise at half a cycle does not turn the way round."""
        before = self.error_s or 0.0
        error = before + _centred(cell_time - before, self._cycle_s)
        return _centred(error, self._cycle_s) if abs(error) > _RE_WRAP * self._cycle_s else error


def _centred(value: float, period: float) -> float:
    """`value` less as many whole periods as bring it into [-period/2, period/2]."""
    return value - period * round(value / period)
