"""How much of its limits of acceleration and jerk the flange uses along its way, where these hold.

Along its way it has the acceleration v' and the jerk v'' of its speed v, and of its angular speed |w| likewise:

    |w|' = u w'   and   |w|'' = u w'' + (|w'|^2 - (u w')^2) / |w|   with u = w / |w|
"""

import numpy as np

from robot_agent.trajectory.affine import Numbers
from robot_agent.trajectory.joint_path import JointPath
from robot_agent.trajectory.law import Fitted
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.pieces import Pieces

_STILL = 1e-12
SLOWEST_RAD_S = float(np.radians(1.0))
"""Where the flange turns slower than this, its turn reverses: there the last term is that of this angular speed."""


def flange_use(path: JointPath, fitted: Fitted, limits: Limits) -> Numbers:
    """Acceleration and jerk `(2, pieces)` of the flange in each piece, in shares of their limits."""
    own, used = limits.path, np.zeros((2, len(fitted.interval)))
    if fitted.flange is None or path.flange is None:
        return used
    acceleration, jerk = _in_pieces(fitted.flange)
    acceleration = np.abs(acceleration) / np.array([own.acceleration_m_s2, own.angular_acceleration_rad_s2])
    used[0] = acceleration.max(axis=1)
    allowed = np.array([own.jerk_m_s3, own.angular_jerk_rad_s3])
    first, last = _at_ends(jerk, path.flange.shares_at(fitted.timed.parameters), fitted.timed.pieces)
    used[1] = np.maximum(np.abs(first) / allowed, np.abs(last) / allowed).max(axis=1)
    return used * _on_path(path, fitted)


def _in_pieces(flange: Pieces) -> tuple[Numbers, Numbers]:
    """Acceleration at the end and jerk in the middle `(pieces, 2)` of way and turn."""
    c1, c2, c3 = (flange.coefficients[:, power] for power in (1, 2, 3))
    h = np.diff(flange.knots)[:, None]
    growths = [(2.0 * c2 + 6.0 * place * h * c3)[:, 1:] for place in (0.5, 1.0)]
    spins = [(c1 + place * h * (2.0 * c2 + 3.0 * place * h * c3))[:, 1:] for place in (0.5, 1.0)]
    speeds = [np.sqrt((spin**2).sum(axis=1)) for spin in spins]
    middle, end = (
        (spin * growth).sum(axis=1) / np.maximum(speed, _STILL)
        for spin, growth, speed in zip(spins, growths, speeds, strict=True)
    )
    across = (growths[0] ** 2).sum(axis=1) - middle**2
    turning = (spins[0] * 6.0 * c3[:, 1:]).sum(axis=1) / np.maximum(speeds[0], _STILL)
    turning += across / np.maximum(speeds[0], SLOWEST_RAD_S)
    acceleration = np.column_stack([(2.0 * c2 + 6.0 * h * c3)[:, 0], end])
    return acceleration, np.column_stack([6.0 * c3[:, 0], turning])


def _at_ends(jerk: Numbers, shares: Numbers, joints: Pieces) -> tuple[Numbers, Numbers]:
    """Jerk of way and turn at the beginning and at the end of each piece `(pieces, 2)`, out of that in the middle.

    It is what the joints' jerk, constant in a piece, takes of it, `shares` `(pieces + 1, 2, n)` at the knots, and a
    rest that is smooth.
    """
    third = 6.0 * joints.coefficients[:, 3, :, None]
    own = [(each @ third)[..., 0] for each in (shares[:-1], shares[1:])]
    rest = np.pad(jerk - (own[0] + own[1]) / 2.0, ((2, 2), (0, 0)), mode="edge")
    at_knots = (7.0 * (rest[1:-2] + rest[2:-1]) - rest[:-3] - rest[3:]) / 12.0
    return at_knots[:-1] + own[0], at_knots[1:] + own[1]


def _on_path(path: JointPath, fitted: Fitted) -> Numbers:
    """1 for each piece `(pieces,)` in which the limits of the flange hold, else 0."""
    ends = np.array([each.end for each in path.stretches[:-1]])
    held = np.array([each.on_path for each in path.stretches])
    at = held[np.searchsorted(ends, fitted.timed.parameters, side="right")]
    return np.asarray(at[:-1] | at[1:], dtype=np.float64)
