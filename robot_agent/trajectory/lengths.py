"""How far a motion goes: the flange's way, its rotation and the joints' way, for each block."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.motion import Motion

_NODES, _WEIGHTS = (values / 2.0 for values in np.polynomial.legendre.leggauss(4))


def lengths(motion: Motion) -> NDArray[np.float64]:
    """`(blocks, 3)`: way of the flange [m], its rotation [rad], and way of the joints that turn [rad].

    The joints' way is the root of the sum of the squares, as the cap `FJ` counts it. Source: Frigeni, Industrial
    Robotics Control, (7-47) to (7-49); the printed (7-49) gives half the angle.
    """
    knots = np.unique(np.concatenate([motion.pieces.knots, motion.ends]))
    width = np.diff(knots)
    t = knots[:-1, None] + width[:, None] * (0.5 + _NODES)
    q, qd = motion.q(t), motion.qd(t)
    twist = (motion.model.jacobian(q) @ qd[..., None])[..., 0]
    linear = motion.model.description.linear
    turning = ~np.array(linear) if linear else np.ones(motion.model.n, dtype=np.bool_)
    rates = [np.linalg.norm(each, axis=-1) for each in (twist[..., :3], twist[..., 3:], qd[..., turning])]
    covered = (np.stack(rates, axis=-1) * _WEIGHTS[:, None]).sum(axis=1) * width[:, None]
    reached = np.concatenate([np.zeros((1, 3)), np.cumsum(covered, axis=0)])
    at_ends = reached[np.searchsorted(knots, motion.ends)]
    return np.diff(at_ends, axis=0, prepend=0.0)
