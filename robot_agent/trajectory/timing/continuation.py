"""A state of a motion, and what is left of that motion: where another one goes on from."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from robot_agent.paths.transition import Transition
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.timed import FilterInput

_STEP_S = 0.002
_MOST_EVEN = 8000
_KNOT_S = 1e-9
"""What is left of a motion begins with a knot that was not there before."""
_STANDING = 1e-6
"""Rate of the parameter below which the robot stands."""


@dataclass(frozen=True, slots=True, eq=False)
class LastRun:
    """The part of a motion that another may replace: from `begins` [s] of the motion to its end."""

    path: JointPath
    times: Numbers
    """`(k,)` [s] since `begins` at which `parameters` `(k,)` of the path are passed."""
    parameters: Numbers
    begins: float
    raw: FilterInput | None = None
    """What the filter was given; None without one."""

    def later(self, seconds: float, moves: int) -> "LastRun":
        """The same in a motion that has so much more before it."""
        return replace(self, path=self.path.later(moves), begins=self.begins + seconds)


@dataclass(frozen=True, slots=True, eq=False)
class PathUnderWay:
    """A path under way. Its moves count from the one that runs."""

    path: JointPath
    """From this state on, up to where the motion comes to rest."""
    joints: Numbers
    """`(3, n)` position, velocity and acceleration."""
    rate: Numbers
    """`(2,)` first and second derivative of the path's parameter by time."""
    known: Numbers
    """`(2, k)` rising parameters of the path and the squares of the rate that the motion has there."""
    after_s: float = 0.0
    """Time [s] from the state that was asked for to this one."""
    raw: FilterInput | None = None
    """What the filter was given up to here, at its own time `raw_s`: joints and rate are those in front of it."""
    raw_s: float = 0.0

    @classmethod
    def on(cls, run: LastRun, left: Pieces, t: float, at_s: float, first: int) -> Self:
        """The state at time `t` [s] of `left`, which is time `at_s` of a run; `first` is the number of its move."""
        path = run.path
        times = _times(left.knots, t)
        q = left.shape(times)
        s, rate, change = _along(path, q, np.interp(times + (at_s - t), run.times, run.parameters))
        rest = path.part(float(s[0]), path.length)
        head, tail = rest.corner_lengths
        rest = replace(
            rest,
            stretches=tuple(each.numbered(-first) for each in rest.stretches),
            corner_lengths=(max(head, 0.0), max(tail, 0.0)),
            transitions=tuple(each.shifted(-first) for each in rest.transitions if each.before >= first),
        )
        known = np.stack([np.maximum.accumulate(s - s[0]), rate**2])
        return cls(rest, q[:3, 0], np.array([rate[0], change[0]]), known)

    @property
    def stands(self) -> bool:
        """Whether the path begins at rest."""
        return bool(self.rate[0] <= _STANDING)


@dataclass(frozen=True, slots=True, eq=False)
class Continuation:
    """What `plan` needs to go on from a state of a motion. All times [s] count from the state."""

    left: Pieces
    """What is left of the motion, as it is."""
    ends: Numbers
    """`(moves,)` when each move that is not finished ends."""
    rests: Numbers
    """When the motion rests, its end the last."""
    transitions: tuple[Transition, ...]
    """Of its moves that are not finished."""
    free_s: float
    """Until then the motion stays as it is: up to its last rest but the end, or to its end."""
    run: LastRun | None
    """What may be replaced by a longer motion from then on; None where that begins at rest, at the end."""
    at_s: float
    """The time of the run at `free_s`."""
    first: int
    """The number of the first move that is not finished."""

    @property
    def filter_s(self) -> float:
        """The window of the filter that may go on; 0 without one."""
        return 0.0 if self.run is None or self.run.raw is None else self.run.raw.window_s

    def going(self, wait_s: float) -> PathUnderWay | None:
        """The path under way `wait_s` [s] after `free_s`; None where it is left no more, or not yet moving.

        After a filter it is under way a little later, at a knot of the joints' curve, where the state is exact.
        """
        t, at_s = self.free_s + wait_s, self.at_s + wait_s
        if self.run is None or t >= self.left.duration_s:
            return None
        raw = self.run.raw
        if raw is None:
            going = replace(PathUnderWay.on(self.run, self.left, t, at_s, self.first), after_s=t)
            return going if at_s == 0.0 or not going.stands else None
        later_s = 0.0 if at_s == 0.0 else float(self.left.knots[np.searchsorted(self.left.knots, max(t, _KNOT_S))]) - t
        raw_s = raw.entered_s(at_s + later_s)
        if raw_s >= raw.pieces.duration_s:
            return None
        run = replace(self.run, times=raw.times, parameters=raw.parameters)
        going = PathUnderWay.on(run, raw.pieces.part(raw_s, raw.pieces.duration_s), 0.0, raw_s, self.first)
        going = replace(going, after_s=t + later_s, raw=raw, raw_s=raw_s)
        return going if raw_s == 0.0 or not going.stands else None


def _times(knots: Numbers, first: float) -> Numbers:
    """Times `(k,)` [s] from `first` to the last knot: evenly apart, or of a slow motion its knots and their middles."""
    last = float(knots[-1])
    if last - first <= _MOST_EVEN * _STEP_S:
        return np.append(np.arange(first, last, _STEP_S), last)
    borders = np.concatenate([[first], knots[(knots > first) & (knots < last)], [last]])
    return np.sort(np.append(borders, (borders[:-1] + borders[1:]) / 2.0))


def _along(path: JointPath, states: Numbers, s: Numbers) -> tuple[Numbers, Numbers, Numbers]:
    """Parameter, its rate and the rate's slope `(k,)` of what the joints do along the path.

    `states` are value and derivatives `(4, k, n)` of the joints by time, `s` `(k,)` is near to the parameter.
    """
    q, qd, qdd, _ = states
    for _ in range(4):
        place, tangent = path.pieces.shape(s)[:2, :, : path.joints]
        s = np.clip(s + _share(q - place, tangent), 0.0, path.length)
    _, tangent, bend = path.pieces.shape(s)[:3, :, : path.joints]
    rate = _share(qd, tangent)
    return s, rate, _share(qdd - bend * (rate**2)[:, None], tangent)


def _share(vector: Numbers, tangent: Numbers) -> Numbers:
    """How many times each tangent `(k, n)` is contained in each vector `(k, n)`: least squares."""
    return np.asarray((vector * tangent).sum(axis=1) / (tangent**2).sum(axis=1))
