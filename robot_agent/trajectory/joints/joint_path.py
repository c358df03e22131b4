"""What the joints do along a path, whatever move it comes from: the geometry that is timed.

The parameter is the length of the joints' own way, each joint weighted by its speed limit [s]: no joint moves faster
by it than its limit. It never stalls, not even where the TCP turns on the spot or the wrist is nearly singular, and
two paths join smoothly exactly where tangent and curvature by it agree: that is what the joints feel.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from robot_agent.paths.transition import Transition
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.joints.tcp_way import continued

Numbers = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Stretch:
    """Up to parameter `end`: move `move`, its caps, and whether the limits of the TCP's path hold."""

    end: float
    move: int
    joint_speed: float
    """Fraction of the joints' speed limits."""
    speed_m_s: float
    rotation_rad_s: float
    on_path: bool
    joint_rad_s: float = np.inf
    """Cap on the speed of the joints that turn, the root of the sum of their squares."""
    inner: Numbers = field(default_factory=lambda: np.zeros(0))
    """`(k,)` rising parameters at which the k moves before `move` end, which have the same caps."""

    @property
    def capped(self) -> bool:
        """Whether the TCP has a cap of its own."""
        return min(self.speed_m_s, self.rotation_rad_s) < np.inf

    @property
    def caps(self) -> tuple[float | bool, ...]:
        """What holds along it."""
        return self.joint_speed, self.speed_m_s, self.rotation_rad_s, self.on_path, self.joint_rad_s

    @property
    def first_move(self) -> int:
        """The first of its moves."""
        return self.move - len(self.inner)

    @property
    def ends(self) -> Numbers:
        """`(k + 1,)` where its moves end, the last one `move`."""
        return np.append(self.inner, self.end)

    def numbered(self, moves: int) -> "Stretch":
        """The same with so many moves before its own; fewer, where they are negative, and those are left out."""
        move = max(self.move + moves, 0)
        return replace(self, move=move, inner=self.inner[max(len(self.inner) - move, 0) :])

    def later(self, parameter: float) -> "Stretch":
        """The same with so much of the parameter before it."""
        return replace(self, end=self.end + parameter, inner=self.inner + parameter)


@dataclass(frozen=True, slots=True, eq=False)
class JointPath:
    """`pieces` over the parameter: `n` joints, then the TCP's way [m] and turn [rad] (constant where unused)."""

    pieces: Pieces
    stretches: tuple[Stretch, ...]
    curvature: Numbers
    """`(k, 2)` parameter and curvature [1/m] of the TCP's way, rising."""
    transitions: tuple[Transition, ...]
    """Between its moves, and a stop in front of them."""
    corner_lengths: tuple[float, float]
    """Parameters of the first move's end and the last move's start: a corner takes at most half of these moves."""
    round_m: float | None
    """Of the corner after this path, as in the move."""
    stops_for: str = ""
    """Why the robot stops at its end, whatever comes after it; empty where that decides."""

    @property
    def length(self) -> float:
        return self.pieces.duration_s

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.pieces.coefficients.shape[2]) - 2

    def end(self) -> Numbers:
        """Joints `(n,)` at the end."""
        return self.pieces.position(np.array(self.length))[: self.joints]

    def state(self, at: float) -> Numbers:
        """Value, first and second derivative `(3, n)` of the joints."""
        return self.pieces.shape(np.array(at))[:3, : self.joints]

    def later(self, moves: int) -> "JointPath":
        """The same with so many moves before its own; fewer, where they are negative, and those are left out."""
        return replace(
            self,
            stretches=tuple(each.numbered(moves) for each in self.stretches),
            transitions=tuple(each.shifted(moves) for each in self.transitions),
        )

    def part(self, first: float, last: float) -> "JointPath":
        """The path from parameter `first` to `last`."""
        ends = [
            replace(
                each, end=min(each.end, last) - first, inner=np.minimum(each.inner[each.inner > first], last) - first
            )
            for each in self.stretches
        ]
        kept = [each for k, each in enumerate(ends) if each.end > (0.0 if k == 0 else max(ends[k - 1].end, 0.0))]
        inside = (self.curvature[:, 0] >= first) & (self.curvature[:, 0] <= last)
        curvature = self.curvature[inside] - np.array([first, 0.0])
        head, tail = self.corner_lengths
        return replace(
            self,
            pieces=self.pieces.part(first, last),
            stretches=tuple(kept),
            curvature=curvature,
            corner_lengths=(head - first, tail - first),
        )


def share_on_path(stretches: Sequence[Stretch], first: Numbers, last: Numbers) -> Numbers:
    """In what share of the stretches between parameters `first` and `last` `(k,)` the limits of the TCP hold."""
    low, high = (np.searchsorted([each.end for each in stretches[:-1]], at, side="right") for at in (first, last))
    before = np.cumsum([0, *(each.on_path for each in stretches)])
    return np.asarray((before[high + 1] - before[low]) / (high + 1 - low))


def least_between(values: Numbers, ends: Numbers, first: Numbers, last: Numbers) -> Numbers:
    """The least `(k, m)` of `values` `(stretches, m)` in all stretches between parameters `first` and `last` `(k,)`.

    `ends` `(stretches - 1,)` are the parameters at which one stretch passes into the next.
    """
    low, high = (np.searchsorted(ends, at, side="right") for at in (first, last))
    least = values.take(low, axis=0)
    several = np.flatnonzero(high > low)
    if len(several):
        padded = np.concatenate([values, np.full_like(values[:1], np.inf)])
        borders = np.stack([low[several], high[several] + 1], axis=1).ravel()
        least[several] = np.minimum.reduceat(padded, borders, axis=0)[::2]
    return least


def joined(first: JointPath, second: JointPath) -> JointPath:
    """Both paths one after the other."""
    offset = first.length
    later = [each.later(offset) for each in second.stretches]
    return JointPath(
        continued(first.pieces, second.pieces, first.joints),
        (*first.stretches, *later),
        np.concatenate([first.curvature, second.curvature + np.array([offset, 0.0])]),
        (*first.transitions, *second.transitions),
        (first.corner_lengths[0], second.corner_lengths[1] + offset),
        second.round_m,
        second.stops_for,
    )
