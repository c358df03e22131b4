"""A planned motion: joints over planned time tau, at rest at both ends."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.paths.transition import Transition
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.continuation import Continuation, LastRun

_STEP_M = 0.004
"""A small part of what a published body is grown by, and of the distance at which a robot stops in front of a zone."""
_EXACT_S = 1e-7
_NODES, _WEIGHTS = (values / 2.0 for values in np.polynomial.legendre.leggauss(4))


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """What `plan` returns. All methods take tau `(...)` [s] of any shape and answer for each element.

    Before tau 0 and after `duration_s` the robot stands; velocity and acceleration there are zero.
    """

    model: Model
    pieces: Pieces
    ends: NDArray[np.float64]
    """`(moves,)` tau at which each move ends; with a round edge, in its middle."""
    rests: NDArray[np.float64]
    """Rising values of tau at which the plan itself is at rest, the end among them. The first is always 0, where a
    motion that goes on from another one is moving."""
    transitions: tuple[Transition, ...]
    """How each move meets the one before it, by their order.

    A move of no length meets nothing, nor does one that was added while the joints all but rested."""
    cycle_s: float
    filter_deviation_m: float = 0.0
    """How far at most the filter on the axes takes the TCP off the path."""
    last: LastRun | None = None
    """What a longer motion may replace; None where each joint goes by itself."""

    @property
    def duration_s(self) -> float:
        return self.pieces.duration_s

    @property
    def grid(self) -> NDArray[np.float64]:
        """`(m,)` tau from 0 to exactly the end, a cycle apart, or farther where the joints move slowly.

        From one to the next no point of the robot then goes farther than some `_STEP_M`: a slow motion has as many as
        its way needs, however long it lasts.
        """
        knots = self.pieces.knots
        taus = np.sort(np.concatenate([knots, (knots[:-1] + knots[1:]) / 2.0]))
        lever_m = np.where(self.model.linear, 1.0, self.model.reach_m)
        way_m = (np.abs(np.diff(self.q(taus), axis=0)) * lever_m).sum(axis=1)
        steps = np.append(0.0, np.cumsum(np.minimum(np.diff(taus) / self.cycle_s, way_m / _STEP_M)))
        even = np.linspace(0.0, steps[-1], max(2, math.ceil(steps[-1] - 1e-9) + 1))
        grid: NDArray[np.float64] = np.interp(even, steps, taus)
        grid[0] = 0.0  # where the motion begins with standing
        return grid

    def q(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joints `(..., n)` [rad or m]."""
        return self.pieces.position(tau)

    def qd(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joint velocities `(..., n)` at rate 1."""
        velocity: NDArray[np.float64] = self.pieces.derivatives(tau)[0]
        return velocity

    def qdd(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Joint accelerations `(..., n)` at rate 1."""
        acceleration: NDArray[np.float64] = self.pieces.derivatives(tau)[1]
        return acceleration

    def pose(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """TCP poses `(..., 4, 4)` in the robot base."""
        return self.model.forward(self.q(tau))

    def tcp_speed(self, tau: NDArray[np.float64]) -> NDArray[np.float64]:
        """Speed `(...)` [m/s] of the TCP at rate 1, which moves and path limits speak of."""
        velocity = (self.model.jacobian(self.q(tau))[..., :3, :] @ self.qd(tau)[..., None])[..., 0]
        return np.asarray(np.linalg.norm(velocity, axis=-1))

    def state(self, tau: float) -> Continuation:
        """The state at `tau` [s] for `plan(..., start=...)`: a motion that goes on from there."""
        tau, end = min(max(float(tau), 0.0), self.duration_s), self.duration_s
        begins = end if self.last is None else self.last.begins
        first = int(np.searchsorted(self.ends, tau, side="right"))
        return Continuation(
            left=self.pieces.part(tau, end),
            ends=self.ends[first:] - tau,
            rests=self.rests[self.rests > tau] - tau,
            transitions=tuple(each.shifted(-first) for each in self.transitions if each.before >= first),
            free_s=max(begins - tau, 0.0),
            run=self.last,
            at_s=max(tau - begins, 0.0),
            first=first,
        )

    def move_at(self, tau: NDArray[np.float64]) -> NDArray[np.int64]:
        """Index `(...)` of the move that tau lies in; its end belongs to a move, its start to the one before."""
        return np.minimum(np.searchsorted(self.ends, tau, side="left"), len(self.ends) - 1)


def move_lengths(motion: Motion) -> NDArray[np.float64]:
    """`(moves, 3)`: way of the TCP [m], its rotation [rad], and way of the joints that turn [rad].

    The joints' way is the root of the sum of the squares, as the cap `FJ` counts it. Source: Frigeni, Industrial
    Robotics Control, (7-47) to (7-49); the printed (7-49) gives half the angle.
    """
    knots = np.unique(np.concatenate([motion.pieces.knots, motion.ends]))
    covered = _covered(motion, knots)
    reached = np.concatenate([np.zeros((1, 3)), np.cumsum(covered, axis=0)])
    at_ends = reached[np.searchsorted(knots, motion.ends)]
    return np.diff(at_ends, axis=0, prepend=0.0)


def tau_before(motion: Motion, move: int, way_m: float) -> float:
    """Where on a move the TCP has this way [m] to go to its end, as tau [s]; its beginning where it is shorter."""
    begin, end = 0.0 if move == 0 else float(motion.ends[move - 1]), float(motion.ends[move])
    inner = motion.pieces.knots[(motion.pieces.knots > begin) & (motion.pieces.knots < end)]
    knots = np.concatenate([[begin], inner, [end]])
    left_m = np.cumsum(_covered(motion, knots)[::-1, 0])[::-1]
    if way_m >= left_m[0]:
        return begin
    piece = int(np.searchsorted(-left_m, -way_m, side="left")) - 1
    low, high = float(knots[piece]), float(knots[piece + 1])
    beyond_m = way_m - (float(left_m[piece + 1]) if piece + 1 < len(left_m) else 0.0)
    last = high
    while high - low > _EXACT_S:
        middle = (low + high) / 2.0
        farther = float(_covered(motion, np.array([middle, last]))[0, 0]) > beyond_m
        low, high = (middle, high) if farther else (low, middle)
    return low


def _covered(motion: Motion, knots: NDArray[np.float64]) -> NDArray[np.float64]:
    """`(m - 1, 3)`: what `move_lengths` tells, between rising taus `(m,)` [s] with none of the motion's in between."""
    width = np.diff(knots)
    t = knots[:-1, None] + width[:, None] * (0.5 + _NODES)
    q, qd = motion.q(t), motion.qd(t)
    twist = (motion.model.jacobian(q) @ qd[..., None])[..., 0]
    linear = motion.model.description.linear
    turning = ~np.array(linear) if linear else np.ones(motion.model.n, dtype=np.bool_)
    rates = [np.linalg.norm(each, axis=-1) for each in (twist[..., :3], twist[..., 3:], qd[..., turning])]
    covered: NDArray[np.float64] = (np.stack(rates, axis=-1) * _WEIGHTS[:, None]).sum(axis=1) * width[:, None]
    return covered
