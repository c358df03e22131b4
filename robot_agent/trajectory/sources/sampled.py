"""A block's states as a motion and a segment: what the agent's timeline, body and gateway know how to take."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.trajectory.governor.segment import RESTING_SAMPLES, Segment
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.motion import Motion
from robot_agent.trajectory.sources.states import States


def sampled(
    model: Model, states: States, nominal: int, before: NDArray[np.float64], cycle_s: float, ruled_by: str
) -> tuple[Motion, Segment]:
    """Consecutive states that end at rest, the state joined first, as a motion whose tau is the time since then.

    `nominal` is the number of states after the first one that come before the ramp, `before` `(2, n)` the joints
    commanded in the two ticks before the first state.
    """
    moving = np.flatnonzero((states.q != states.q[-1]).any(axis=1))
    rest = int(moving[-1]) + 1 if len(moving) else 0
    states = states.first(rest + RESTING_SAMPLES)
    ticks = np.arange(states.count)
    tau = np.minimum(ticks, rest) * cycle_s
    rate = np.where(ticks < rest, 1.0, 0.0)
    segment = Segment(
        tau, rate, np.zeros_like(rate), states.q, states.qd, min(nominal, rest), ruled_by, before, cycle_s
    )
    if rest == 0:
        pieces = Pieces.standing(states.q[0])
    else:
        knots = slice(0, rest + 1)
        pieces = Pieces.through(tau[knots], states.q[knots], states.qd[knots], states.qdd[knots])
    end = np.array([pieces.duration_s])
    motion = Motion(model, pieces, end, np.unique(np.append(0.0, end)), (), cycle_s)
    return motion, segment


def states_from(motion: Motion, segment: Segment, index: int) -> States:
    """What a segment of `motion` commands from its sample `index` on, as states."""
    part = segment.remainder(index, segment.ruled_by)
    rate, slope = part.rate[:, None], part.rate_dot[:, None]
    qdd = motion.qdd(part.tau) * rate**2 + motion.qd(part.tau) * slope
    return States(part.q, part.qd, qdd)
