"""An initial law and the rate at which it is passed: a motion over time."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joints.joint_path import JointPath
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.optimal.b_spline import beginning, over, through
from robot_agent.trajectory.timing.optimal.initial_law import InitialLaw
from robot_agent.trajectory.timing.optimal.retiming import basis
from robot_agent.trajectory.timing.timed import Timed

_PARTS = 8
"""Of an interval, between which time passes evenly enough to be interpolated."""
_PIECES = 4
"""Of the joints' spline per interval; as many as there are places in a search from one end of it to the other."""
_HALVINGS = 5
_EXACT = 2e-6
"""Largest distance [rad or m] of the joints over time from the joints along the path."""
_GAUSS_X, _GAUSS_W = (values / 2.0 for values in np.polynomial.legendre.leggauss(3))
_BEGINNING = basis(np.arange(_PARTS) / _PARTS)[:, 0].T


@dataclass(frozen=True, slots=True, eq=False)
class Fitted:
    """A law's joints over time, and which of its intervals each piece `(pieces,)` is in."""

    timed: Timed
    interval: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class TimingLaw:
    """s(t): `initial` and the coefficients `(intervals + 2,)` of the squared rate y."""

    initial: InitialLaw
    squared: Numbers

    @property
    def duration_s(self) -> float:
        return float(self._clock[-1])

    @property
    def compared_s(self) -> float:
        """The duration where each interval that lasts as long as it shall counts `initial.h`."""
        return float(self._paced[0][-1])

    def resampled(self, h: float, most: int, start: Numbers | None = None) -> InitialLaw:
        """The same motion as an initial law with intervals of about `h` [s], or longer as in its own, at most `most`.

        It begins at rest, or with the value and two derivatives `start` `(3,)`.
        """
        count = int(np.clip(math.ceil(self.compared_s / h), 8, most))
        h = self.compared_s / count
        at = self._times(count)
        points = through(self._samples(at))
        if start is not None:
            points[:3] = beginning(start, h, h)
        return InitialLaw.rising(points, h, h / np.diff(at))

    def timed(self, path: JointPath, start: Numbers | None = None) -> "Fitted":
        """A cubic spline of the joints, fine enough to be the path.

        Its knots divide each interval alike: the places at which a search keeps the limits are among them, and what one
        interval uses of its limits does not depend on the time that others take. The joints begin at rest, or with
        position, velocity and acceleration `start` `(3, n)`.
        """
        for halvings in range(_HALVINGS):
            count = _PIECES << halvings
            at, s = self._times_of(2 * count), self._parameters(2 * count)
            q = path.pieces.position(s)[:, : path.joints]
            pieces = over(at[::2], q[::2], start)
            if np.abs(_between(pieces, at[1::2]) - q[1::2]).max() < _EXACT:
                break
        return Fitted(Timed(pieces, pieces.knots, s[::2]), np.repeat(np.arange(self.initial.intervals), count))

    @cached_property
    def _clock(self) -> Numbers:
        """Times `(parts + 1,)` [s] at which the parts of all intervals begin, and the end."""
        return self._times_of(_PARTS)

    def _times_of(self, parts: int) -> Numbers:
        """The same for so many parts of each interval."""
        inside = basis(np.add.outer(np.arange(parts) / parts, (0.5 + _GAUSS_X) / parts).ravel())[:, 0].T
        y = np.lib.stride_tricks.sliding_window_view(self.squared, 3) @ inside
        steps = (1.0 / np.sqrt(y)).reshape(-1, len(_GAUSS_W)) @ _GAUSS_W
        return np.append(0.0, np.cumsum(steps * self.initial.h / parts))

    def _parameters(self, parts: int) -> Numbers:
        """Parameters `(intervals * parts + 1,)` at these times."""
        number = np.arange(self.initial.intervals * parts + 1)
        interval = np.minimum(number // parts, self.initial.intervals - 1)
        return self.initial.places(interval, number / parts - interval)

    @cached_property
    def _paced(self) -> tuple[Numbers, Numbers]:
        """The clock `(parts + 1,)` of a time that passes at the initial rates, and the rates at the same places."""
        k, rates = self.initial.intervals, self.initial.rates
        rate = np.interp(np.arange(k * _PARTS + 1) / _PARTS, np.arange(k) + 0.5, rates)
        return np.append(0.0, np.cumsum(np.diff(self._clock) * (rate[1:] + rate[:-1]) / 2.0)), rate

    def _times(self, count: int) -> Numbers:
        """Times `(count + 1,)` from the beginning to the end, farther apart where its intervals are longer."""
        clock, (paced, rate) = self._clock, self._paced
        at = np.linspace(0.0, paced[-1], count + 1)
        part = np.clip(np.searchsorted(paced, at, side="right") - 1, 0, len(clock) - 2)
        after, steeper = at - paced[part], np.diff(rate)[part] / np.diff(clock)[part]
        root = np.sqrt(np.maximum(rate[part] ** 2 + 2.0 * steeper * after, 0.0))
        times = clock[part] + 2.0 * after / (rate[part] + root)
        times[-1] = clock[-1]
        return np.asarray(times)

    def _samples(self, at: Numbers) -> Numbers:
        """Parameters `(k,)` at times `(k,)` [s]."""
        clock = self._clock
        part = np.clip(np.searchsorted(clock, at, side="right") - 1, 0, len(clock) - 2)
        after, step, width = at - clock[part], np.diff(clock)[part], self.initial.h / _PARTS
        windows = np.lib.stride_tricks.sliding_window_view(self.squared, 3)
        rate = np.sqrt((windows @ _BEGINNING).ravel())
        first, last = rate[part], np.append(rate[1:], math.sqrt(self.squared[-2:].mean()))[part]
        # the cubic with the rates at both ends of a part: tau by time
        x = after / step
        share = x * x * (3.0 - 2.0 * x) + step / width * x * (1.0 - x) * ((1.0 - x) * first - x * last)
        interval, number = np.divmod(part, _PARTS)
        return self.initial.places(interval, (number + np.clip(share, 0.0, 1.0)) / _PARTS)


def _between(pieces: Pieces, at: Numbers) -> Numbers:
    """Values `(p, n)` at times `(p,)`, one in each cubic piece."""
    x, c = (at - pieces.knots[:-1])[:, None], pieces.coefficients
    return np.asarray(c[:, 0] + x * (c[:, 1] + x * (c[:, 2] + x * c[:, 3])))
