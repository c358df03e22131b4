"""How much of its limits of speed, acceleration and jerk the TCP uses, where these hold.

Along its way it has the acceleration v' and the jerk v'' of its speed v, and of its angular speed |w| likewise: with
u = w / |w| and the part a of w' across u

    |w|' = u w'   and   |w|'' = u w'' + a^2 / |w|

and across its way the acceleration that is a for v.

Inside a piece the joints are a polynomial in time and the TCP's twist J q' is smooth, however tightly the path
bends: it is the joints' jerk that steps at the knots. So the twist's derivatives in a piece are those of the polynomial
through a few places of it.
"""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.model.description import PathSpeeds
from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.affine import Numbers
from robot_agent.trajectory.timing.path_limits import TcpSpeeds

Flags = NDArray[np.bool_]
Places = NDArray[np.intp]

_SLOWEST = np.array([[1e-3], [np.radians(1.0)]])
"""[m/s], [rad/s]: a TCP that is slower reverses; there the last term is that of this speed."""
_STILL = 1e-12
_FACTORIALS = np.array([1.0, 2.0, 6.0])[:, None, None]
"""What makes derivatives of the coefficients of powers."""
_CLOSE, _CLOSE_SLOW, _SLOW_M_S = 0.8, 0.4, 0.01
"""Of a limit: the twists at the knots tell it to some per cent, and to a half where the TCP is so slow that it may
reverse."""
_PLACES = np.linspace(0.0, 1.0, 5)
"""Of a piece, through whose twists a polynomial is laid."""
_FINELY = np.linspace(0.0, 1.0, 17)
"""Where it is looked at: where a turn reverses, |w|'' has a peak some ms wide."""
_BORDERS = np.concatenate([[0.0], (_FINELY[1:] + _FINELY[:-1]) / 2.0, [1.0]])
"""Between these the speed is the one of the place: whatever cap holds there."""
_KEPT = 1.0003
"""A speed that is exceeded by less, with Jacobians that change evenly from knot to knot, is not looked at closer."""


def _of_places(order: int) -> Numbers:
    """What the derivative of that order is `(17, 5)` of the values at the places."""
    powers = np.arange(len(_PLACES))
    factors = np.prod([powers - k for k in range(order)], axis=0)
    rows = factors * _FINELY[:, None] ** np.maximum(powers - order, 0)
    return np.asarray(rows @ np.linalg.inv(_PLACES[:, None] ** powers))


_DERIVATIVES = [_of_places(order) for order in range(3)]


def tcp_use(model: Model, pieces: Pieces, held: Flags, limits: PathSpeeds) -> Numbers:
    """Speed, acceleration and jerk `(3, pieces)` of the TCP in each piece, in shares of their limits.

    The speed's limit is the one at which the acceleration across the way reaches its own. 0 in pieces where the limits
    do not hold, `held` `(pieces,)`.
    """
    return _limit_use(model, pieces, held, limits, _jacobians(model, pieces, held))


def speed_use(model: Model, pieces: Pieces, held: Flags, speeds: TcpSpeeds) -> Numbers:
    """The most `(pieces,)` that the TCP uses of its speeds in each piece `held` `(pieces,)`; 0 in the others."""
    return _speed_use(model, pieces, held, speeds, _jacobians(model, pieces, held))


def near_use(model: Model, pieces: Pieces, held: Flags, limits: PathSpeeds, speeds: TcpSpeeds) -> Numbers:
    """As `tcp_use`, the first row with `speed_use` where `speeds` hold, but only in pieces that come close to a limit.

    For cubic pieces, the last of which ends at rest.
    """
    looked_at = held | speeds.hold
    if not looked_at.any():
        return np.zeros((3, len(held)))
    beside = np.convolve(looked_at, np.ones(3))[1:-1] > 0.0
    at_knots = _jacobians(model, pieces, beside)
    near_limit, fast = _close(pieces, held, limits, speeds, at_knots)
    used = _limit_use(model, pieces, near_limit, limits, at_knots)
    used[0] = np.maximum(used[0], _speed_use(model, pieces, fast, speeds, at_knots))
    return used


def _limit_use(model: Model, pieces: Pieces, held: Flags, limits: PathSpeeds, at_knots: Numbers) -> Numbers:
    used, which = np.zeros((3, len(held))), np.flatnonzero(held)
    if len(which):
        v, a, j = _looked_at(model, pieces, which, 3, at_knots)
        used[:, which] = _shares(v, a, j, limits).max(axis=1)
    return used


def _speed_use(model: Model, pieces: Pieces, held: Flags, speeds: TcpSpeeds, at_knots: Numbers) -> Numbers:
    used, which = np.zeros(len(held)), np.flatnonzero(held)
    if len(which):
        (twist,) = _looked_at(model, pieces, which, 1, at_knots)
        share = np.sqrt((twist**2).sum(axis=-2)) / speeds.between(which, _BORDERS)
        used[which] = share.max(axis=(0, 1))
    return used


def _jacobians(model: Model, pieces: Pieces, held: Flags) -> Numbers:
    """The TCP's Jacobians `(6, n, pieces + 1)` at the knots of the pieces `held` `(pieces,)`; 0 at the others."""
    at = np.flatnonzero(np.append(held, False) | np.append(False, held))
    found = np.zeros((6, pieces.coefficients.shape[2], len(pieces.knots)))
    if len(at):
        found[..., at] = np.moveaxis(model.jacobian(pieces.position(pieces.knots[at])), 0, -1)
    return found


def _looked_at(model: Model, pieces: Pieces, which: Places, orders: int, at_knots: Numbers) -> list[Numbers]:
    """Twist and derivatives, so many in all and `(17, 2, 3, k)` each, at places of pieces `which` `(k,)`."""
    h = np.diff(pieces.knots)[which]
    q, qd = pieces.with_slope(pieces.knots[which] + _PLACES[:, None] * h)
    inside = np.moveaxis(model.jacobian(q[1:-1]), (0, 1), (-2, -1))
    ends = (at_knots[:, :, None, each] for each in (which, which + 1))
    jacobian = np.concatenate([next(ends), inside, next(ends)], axis=2)
    twist = np.einsum("dnpk,pkn->pdk", jacobian, qd).reshape(len(_PLACES), -1)
    shape = len(_FINELY), 2, 3, len(which)
    return [(rows @ twist).reshape(shape) / h**order for order, rows in enumerate(_DERIVATIVES[:orders])]


def _close(
    pieces: Pieces, held: Flags, limits: PathSpeeds, speeds: TcpSpeeds, at_knots: Numbers
) -> tuple[Flags, Flags]:
    """Which pieces `(pieces,)` come so close to a limit of the TCP that they need to be looked at.

    First those `held` `(pieces,)` that come near to a limit of acceleration or jerk, then those that may exceed one of
    `speeds`. What the joints' jerk takes of the TCP's is known on both sides of each knot, the rest of it is smooth and
    told by the twists at the knots: `at_knots` are the Jacobians of these pieces and of those beside them.
    """
    h = np.diff(pieces.knots)
    rates = np.ascontiguousarray(pieces.coefficients[:, 1:4].transpose(1, 2, 0)) * _FACTORIALS
    begin, end = _twists(at_knots[..., :-1], rates), _twists(at_knots[..., 1:], rates)
    twist = np.append(begin[0], np.zeros((2, 3, 1)), axis=-1)
    after, before = begin[2], end[2]
    slope, width = np.diff(twist) / h, h[1:] + h[:-1]
    change = (h[:-1] * slope[..., 1:] + h[1:] * slope[..., :-1]) / width
    rest = (2.0 * np.diff(slope) - h[1:] * after[..., 1:] - h[:-1] * before[..., :-1]) / width
    change, rest = (np.concatenate([each[..., :1], each, each[..., -1:]], axis=-1) for each in (change, rest))
    first = _shares(twist[..., :-1], change[..., :-1], rest[..., :-1] + after, limits)
    last = _shares(twist[..., 1:], change[..., 1:], rest[..., 1:] + before, limits)
    speed = np.sqrt((twist[0] ** 2).sum(axis=0))
    enough = np.where(np.minimum(speed[:-1], speed[1:]) < _SLOW_M_S, _CLOSE_SLOW, _CLOSE)
    near_limit = held & (np.maximum(first, last).max(axis=0) > enough)
    return near_limit, speeds.hold & (_fastest(begin, end, h) > _KEPT * speeds.least).any(axis=0)


def _fastest(begin: Numbers, end: Numbers, h: Numbers) -> Numbers:
    """Speed and angular speed `(2, pieces)` at most in each cubic piece of `h` `(pieces,)` [s], nearly.

    `begin` and `end` `(3, 2, 3, pieces)` are what the Jacobians at its two knots make of the joints' derivatives at its
    beginning; between the knots they change evenly.
    """
    change = end - begin
    speeding, rest = h * h / 2.0, h * change[1]
    powers = begin[0], h * begin[1] + change[0], speeding * begin[2] + rest, speeding * change[2]
    square = np.zeros((2, len(h)))
    for x in _PLACES:
        twist = powers[0] + x * (powers[1] + x * (powers[2] + x * powers[3]))
        square = np.maximum(square, (twist**2).sum(axis=-2))
    return np.sqrt(square)


def _twists(jacobian: Numbers, rates: Numbers) -> Numbers:
    """`(6, n, k)` times `(m, n, k)` as `(m, 2, 3, k)`: arithmetic on many short vectors takes longer."""
    return np.asarray(np.einsum("dnk,mnk->mdk", jacobian, rates)).reshape(len(rates), 2, 3, -1)


def _shares(twist: Numbers, change: Numbers, jerk: Numbers, limits: PathSpeeds) -> Numbers:
    """Shares `(3, ..., k)` of the limits that a twist `(..., 2, 3, k)` uses with its two derivatives."""
    speed = np.sqrt((twist**2).sum(axis=-2))
    u = twist / np.maximum(speed, _STILL)[..., None, :]
    along = (u * change).sum(axis=-2)
    across = ((change - u * along[..., None, :]) ** 2).sum(axis=-2)
    turned = (u * jerk).sum(axis=-2) + across / np.maximum(speed, _SLOWEST)
    allowed = np.array([limits.acceleration_m_s2, limits.angular_acceleration_rad_s2])[:, None]
    jerk_allowed = np.array([limits.jerk_m_s3, limits.angular_jerk_rad_s3])[:, None]
    used = (np.abs(along) / allowed).max(axis=-2), (np.abs(turned) / jerk_allowed).max(axis=-2)
    return np.stack([across[..., 0, :] ** 0.25 / np.sqrt(limits.acceleration_m_s2), *used])
