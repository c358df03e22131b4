"""From paths and their timing to a motion: when each move ends, and where the robot rests."""

from dataclasses import dataclass
from typing import Self

import numpy as np

from robot_agent.kinematics import Model
from robot_agent.paths.transition import Transition, in_order
from robot_agent.trajectory.joints.joint_path import JointPath, Numbers
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.timing.continuation import Continuation, LastRun
from robot_agent.trajectory.timing.independent import Independent
from robot_agent.trajectory.timing.timed import Timed

_STANDING = 1e-12
"""Squared joint speed below which the time of passing a place says nothing."""
_MOST_STEPS = 8
_EXACT_S = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Kept:
    """What comes before the new runs as it is: its curve, when its moves end, its rests, how its moves meet."""

    pieces: Pieces
    ends: Numbers
    """`(moves,)`, also of those that end in the first of the runs: these are looked up there."""
    rests: Numbers
    transitions: tuple[Transition, ...]

    @classmethod
    def nothing(cls, q: Numbers) -> Self:
        """From rest at joints `q` `(n,)`."""
        return cls(Pieces.standing(q), np.zeros(0), np.zeros(1), ())

    @classmethod
    def of(cls, start: Continuation, until_s: float) -> Self:
        """What is left of a motion, for `until_s` [s] from the state on."""
        rests = start.rests[start.rests <= until_s]
        return cls(start.left.part(0.0, until_s), start.ends, np.append(0.0, rests), start.transitions)


def assembled(
    model: Model, kept: Kept, moves: int, runs: list[JointPath | Independent], timed: list[Timed], cycle_s: float
) -> Motion:
    """The motion through all `runs`, timed, after what is kept; `moves` is how many there are, the kept ones too."""
    begins = end = kept.pieces.duration_s
    ends = np.append(kept.ends, np.full(moves - len(kept.ends), -1.0))
    rests, transitions = kept.rests.tolist(), list(kept.transitions)
    for run, time in zip(runs, timed, strict=True):
        begins = end
        if isinstance(run, JointPath):
            inside = np.concatenate([stretch.ends for stretch in run.stretches])[:-1]
            numbers = [np.arange(each.first_move, each.move + 1) for each in run.stretches]
            ends[np.concatenate(numbers)[:-1]] = begins + _passing(run, time, inside)
        end = begins + time.pieces.duration_s
        ends[run.stretches[-1].move] = end
        rests.append(end)
        transitions += run.transitions
    ends = np.maximum.accumulate(np.maximum(ends, 0.0))  # a move of no length ends where the one before it does
    parts = [kept.pieces, *(time.pieces for time in timed)]
    pieces = Pieces.joined([part for part in parts if part.duration_s > 0.0] or [kept.pieces])
    deviation_m = max((time.deviation_m for time in timed), default=0.0)
    last = None
    if runs and isinstance(path := runs[-1], JointPath):
        last = LastRun(path, timed[-1].times, timed[-1].parameters, begins, timed[-1].raw)
    return Motion(model, pieces, ends, np.array(rests), in_order(transitions), cycle_s, deviation_m, last)


def _passing(path: JointPath, timed: Timed, parameters: Numbers) -> Numbers:
    """Times `(m,)` [s] at which parameters `(m,)` are passed: interpolated, then by Newton on the joints' way."""
    places = path.pieces.position(parameters)[:, : path.joints]
    t = np.interp(parameters, timed.parameters, timed.times)
    for _ in range(_MOST_STEPS):
        velocity = timed.pieces.derivatives(t)[0]
        missing, squared = ((each * velocity).sum(axis=1) for each in (places - timed.pieces.position(t), velocity))
        step = np.where(squared > _STANDING, missing / np.maximum(squared, _STANDING), 0.0)
        t = np.clip(t + step, 0.0, timed.pieces.duration_s)
        if (np.abs(step) < _EXACT_S).all():
            break
    return np.asarray(t)
