"""The fastest timing under limits of speed, acceleration and jerk: a given motion, its rate changed along the way.

A motion s(tau) that is smooth is given, `InitialLaw`. With rate r = d tau/dt and y = r^2 the joints have

    velocity      sqrt(y) q'
    acceleration  y q'' + y'/2 q'
    jerk          sqrt(y) (y q''' + 3/2 y' q'' + 1/2 y'' q')

with derivatives by tau. Acceleration is affine in y. Jerk is |affine| <= j / sqrt(y), whose right side is convex: its
tangent is below it, so a Newton step never trusts a limit that is not there. y is a quadratic B-spline on the knots of
s, so each limit at one place is a row of three coefficients; `Limited` holds these rows for five places of an interval.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.optimal.initial_law import InitialLaw
from robot_agent.trajectory.timing.path_limits import PathLimits

Places = NDArray[np.intp]

PLACES = np.linspace(0.0, 1.0, 5)
"""Where in each interval the limits are kept."""
_AROUND = np.array([0.0, 0.125, 0.375, 0.625, 0.875, 1.0])
"""Borders of the parts of an interval around them, for each of which one third derivative of the path stands."""
_EASED = 8
"""Intervals on either side of a place where the rate is lowered with it."""
_FIRMLY = 1.2
"""The rate is lowered by so many times what the place itself needs, since a dip takes some jerk of its own."""
_DIP = np.cos(np.pi / 2.0 * np.arange(-_EASED, _EASED + 1) / (_EASED + 1)) ** 2
_SMOOTHED = np.hanning(_EASED + 3)[1:-1] / np.hanning(_EASED + 3).sum()


def basis(places: Numbers) -> Numbers:
    """Value and two derivatives by the place `(..., 3, 3)` of the quadratic B-spline from its three coefficients."""
    u = np.asarray(places)
    zero = np.zeros_like(u)
    value = np.stack([(1.0 - u) ** 2 / 2.0, 0.5 + u - u * u, u * u / 2.0], axis=-1)
    first = np.stack([u - 1.0, 1.0 - 2.0 * u, u], axis=-1)
    second = np.stack([zero + 1.0, zero - 2.0, zero + 1.0], axis=-1)
    return np.stack([value, first, second], axis=-2)


_RULE = np.moveaxis(basis(PLACES), 0, -1)
"""`(derivative, coefficient, places)`"""


def on_windows(rows: Numbers, c: Numbers) -> Numbers:
    """Rows `(3, m, intervals)` times the three coefficients of each interval, out of `c` `(intervals + 2,)`."""
    return np.asarray(np.einsum("imk,ik->mk", rows, np.array([c[:-2], c[1:-1], c[2:]])))


@dataclass(frozen=True, slots=True, eq=False)
class Limited:
    """The limits as rows for the coefficients of y, `(3, m, intervals)` with m = places x rows, places first.

    `acceleration` in between `-below` and `above` `(m, intervals)`; `jerk` within 1 / sqrt(y); `speed` up to 1.
    """

    acceleration: Numbers
    above: Numbers
    below: Numbers
    jerk: Numbers
    speed: Numbers
    value: Numbers
    """`(3, places, intervals)` rows of y itself."""
    h: Numbers
    """`(intervals,)` [s] that each interval counts for the duration; less where the initial law is too fast."""
    starts: Places
    """Where each path begins among the intervals."""

    @classmethod
    def of(cls, initial: InitialLaw, bounds: PathLimits) -> "Limited":
        """The limits along one path."""
        k, places = initial.intervals, len(PLACES)
        s, *derivatives = initial.at(np.arange(k), np.broadcast_to(PLACES[:, None], (places, k)))
        around = initial.places(np.arange(k), np.broadcast_to(_AROUND[:, None], (len(_AROUND), k)))
        rows = bounds.rows(s.ravel(), around, _neighbours(s))

        def by_interval(values: Numbers) -> Numbers:
            """Values `(places x intervals, rows)` as `(places, rows, intervals)`."""
            return np.ascontiguousarray(np.swapaxes(values.reshape(places, k, -1), 1, 2))

        h, affine = initial.h, rows.affine
        by_a, by_b = by_interval(affine.a), by_interval(affine.b)
        first, second, third = (by_interval(each) for each in (rows.first_jerk, rows.second_jerk, rows.third_jerk))
        v, a, j = (each[:, None] for each in derivatives)
        accelerations = by_b * v**2 + by_a * a, by_a * v / (2.0 * h)
        jerks = (
            third * v**3 + 3.0 * second * v * a + first * j,
            1.5 / h * (second * v**2 + first * a),
            first * v / (2.0 * h**2),
        )
        squared = derivatives[0].ravel() ** 2
        faster = squared / np.maximum(rows.fastest, 1e-12 * squared + 1e-300)
        return cls(
            _sum_of(accelerations),
            by_interval(affine.above).reshape(-1, k),
            by_interval(affine.below).reshape(-1, k),
            _sum_of(jerks),
            faster.reshape(places, k) * _RULE[0][..., None],
            np.repeat(_RULE[0][..., None], k, axis=2),
            h * initial.rates,
            np.zeros(1, dtype=np.intp),
        )

    @classmethod
    def joined(cls, parts: list["Limited"]) -> "Limited":
        """Paths one after the other; two intervals without limits and without duration keep their rates apart."""

        def join(name: str, value: float) -> Numbers:
            arrays = []
            for part in parts:
                array: Numbers = getattr(part, name)
                arrays += [array, np.full((*array.shape[:-1], 2), value)]
            return np.concatenate(arrays[:-1], axis=-1)

        rows = [join("acceleration", 0.0), join("above", 1.0), join("below", 1.0), join("jerk", 0.0)]
        rows += [join("speed", 0.0), join("value", 1.0), join("h", 0.0)]
        starts = np.cumsum([0, *[len(part.h) + 2 for part in parts[:-1]]])
        return cls(rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6], starts)

    @property
    def rows(self) -> int:
        """At each place."""
        return int(self.jerk.shape[1]) // len(PLACES)

    def tightened(self, excess: Numbers) -> "Limited":
        """The same with the limits of speed, acceleration and jerk divided by `excess` `(3, intervals)`."""
        speed, acceleration, jerk = excess
        return Limited(
            self.acceleration * acceleration,
            self.above,
            self.below,
            self.jerk * jerk,
            self.speed * speed**2,
            self.value,
            self.h,
            self.starts,
        )

    def part(self, intervals: Places, starts: Places) -> "Limited":
        """Those of some intervals `(k,)`, out of which paths begin at `starts`."""
        return Limited(
            self.acceleration[..., intervals],
            self.above[:, intervals],
            self.below[:, intervals],
            self.jerk[..., intervals],
            self.speed[..., intervals],
            self.value[..., intervals],
            self.h[intervals],
            starts,
        )

    def use(self, c: Numbers) -> tuple[Numbers, Numbers, Numbers]:
        """What a timing uses of each limit: speed `(places, intervals)`, acceleration and jerk `(m, intervals)`.

        Negative where it is the lower bound that is close.
        """
        y = on_windows(self.value, c)
        acceleration = on_windows(self.acceleration, c)
        acceleration /= np.where(acceleration > 0.0, self.above, self.below)
        jerk = on_windows(self.jerk, c)
        jerk.reshape(len(y), -1, y.shape[1])[...] *= np.sqrt(y)[:, None]
        return np.sqrt(on_windows(self.speed, c)), acceleration, jerk

    def excess(self, c: Numbers) -> Numbers:
        """The most that a timing uses in each interval `(3, intervals)` of speed, acceleration and jerk."""
        return np.stack([np.abs(each).max(axis=0) for each in self.use(c)])


def easing(use: Numbers) -> Numbers:
    """What the coefficients of y are multiplied by `(intervals + 2,)` to lower the rate where limits are exceeded.

    It is lowered smoothly around such a place. `use` `(3, intervals)` is what is used of speed, acceleration and jerk.
    """
    rate = (use ** (1.0 / np.arange(1.0, 4.0))[:, None]).max(axis=0)
    dip = np.pad(2.0 * _FIRMLY * np.log(np.maximum(rate, 1.0)), _EASED + 1 + _EASED // 2, mode="edge")
    dip = (np.lib.stride_tricks.sliding_window_view(dip, len(_DIP)) * _DIP).max(axis=1)
    return np.asarray(np.exp(-np.convolve(dip, _SMOOTHED, mode="valid")))


def _neighbours(s: Numbers) -> Numbers:
    """The places before and after each place `(2, places x intervals)`; `s` `(places, intervals)` rises."""
    every = np.append(s[:-1].T.ravel(), s[-1, -1])
    here = np.arange(len(every) - 1).reshape(-1, len(s) - 1).T
    index = np.append(here.ravel(), here[-1] + 1)
    return np.stack([every[np.maximum(index - 1, 0)], every[np.minimum(index + 1, len(every) - 1)]])


def _sum_of(terms: tuple[Numbers, ...]) -> Numbers:
    """Terms `(places, rows, intervals)` times the basis: `(3, places x rows, intervals)`."""
    total = np.einsum("tip,tprk->iprk", _RULE[: len(terms)], np.stack(terms))
    return np.asarray(total).reshape(3, -1, terms[0].shape[2])
