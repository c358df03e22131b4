"""The limits of a joint path in the form that timing needs: affine in acceleration and squared speed.

Along a path with parameter s every joint moves with q' s_dot, q' s_ddot + q'' s_dot^2 and
q' s_dddot + 3 q'' s_dot s_ddot + q''' s_dot^3; the TCP's way and turn are two more coordinates of the same form.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joints.joint_path import JointPath, Numbers, least_between
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.affine import Affine, Scaled
from robot_agent.trajectory.timing.timed import Timed

_NARROW = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """The limits at `k` places of a path."""

    affine: Scaled
    first_jerk: Numbers
    second_jerk: Numbers
    third_jerk: Numbers
    """`(k, rows)` derivatives by the parameter, divided by the limits of jerk."""
    fastest: Numbers
    """`(k,)` bound on s_dot^2."""


class PathLimits:
    """The limits along one path."""

    def __init__(self, path: JointPath, limits: Limits) -> None:
        self.path, self.limits = path, limits
        tcp = limits.path
        self._ends = np.array([each.end for each in path.stretches[:-1]])
        linear = [tcp.speed_m_s, tcp.acceleration_m_s2, tcp.jerk_m_s3]
        angular = [tcp.angular_speed_rad_s, tcp.angular_acceleration_rad_s2, tcp.angular_jerk_rad_s3]
        tables = []
        lowest, highest = limits.acceleration_bounds
        for order, joints in ((0, limits.velocity), (1, highest), (1, -lowest), (2, limits.jerk)):
            rows = []
            for each in path.stretches:
                own = np.array([linear[order], angular[order]]) if each.on_path else np.full(2, np.inf)
                caps = np.array([each.speed_m_s, each.rotation_rad_s])
                share = each.joint_speed if order == 0 else 1.0
                rows.append(np.concatenate([share * joints, np.minimum(own, caps) if order == 0 else own]))
            tables.append(np.array(rows))
        velocity, above, below, jerk = tables
        one = np.ones_like(above)
        self._scaled, self._per_jerk = Affine(one, one, np.zeros(1), -below, above).scaled(), 1.0 / jerk
        self._turning = np.flatnonzero(limits.turning)
        joint = [each.joint_rad_s for each in path.stretches]
        lateral = [tcp.acceleration_m_s2 if each.on_path else np.inf for each in path.stretches]
        self._speeds = np.column_stack([velocity, joint, lateral])
        """By stretch: limits of the speeds of joints, way and turn, of the joints' own speed; lateral acceleration."""

    def rows(self, at: Numbers, around: Numbers | None = None, wide: Numbers | None = None) -> Rows:
        """The rows at parameters `at` `(k,)`.

        With borders `around` `(places + 1, m)` of the parts in which `at` lies, `m` for each place, the third
        derivative is its mean in these: what jerk a motion has that is looked at no closer. Where that of the TCP
        steps it is the larger one of both sides. With `wide` `(2, k)` the bound on the speed is the least of all
        stretches between, however short they are.
        """
        first, second, third = self.path.pieces.slopes(at)
        if around is not None:
            third = self._third_around(at, around, second, third)
        stretch = np.searchsorted(self._ends, at, side="right")
        fastest = self._fastest(at, first, *((at, at) if wide is None else wide))
        tables = self._scaled.a, self._scaled.above, self._scaled.below, self._per_jerk
        scale, above, below, per_jerk = (each.take(stretch, axis=0) for each in tables)
        affine = Scaled(first * scale, second * scale, above, below)
        return Rows(affine, first * per_jerk, second * per_jerk, third * per_jerk, fastest)

    def _third_around(self, at: Numbers, around: Numbers, second: Numbers, third: Numbers) -> Numbers:
        """Third derivatives `(k, n + 2)` as `rows` describes them."""
        bends, joints = self.path.pieces.bends(around), self.path.joints
        mean = _rise(np.diff(bends, axis=0), np.diff(around, axis=0), third.reshape(bends[1:].shape))
        here, s = second.reshape(mean.shape)[..., joints:], at.reshape(mean.shape[:2])
        tcp, own = bends[..., joints:], mean[..., joints:]
        before, after = _rise(here - tcp[:-1], s - around[:-1], own), _rise(tcp[1:] - here, around[1:] - s, own)
        mean[..., joints:] = np.where(np.abs(before) > np.abs(after), before, after)
        return mean.reshape(third.shape)

    def speeds(self, first: Numbers, last: Numbers) -> Numbers:
        """What the speeds of joints, TCP's way and turn, and the joints' own speed may be `(k, n + 3)`.

        The least of all stretches between parameters `first` and `last` `(k,)`.
        """
        return least_between(self._speeds[:, :-1], self._ends, first, last)

    def _fastest(self, at: Numbers, slopes: Numbers, first: Numbers, last: Numbers) -> Numbers:
        """The bound `(k,)` on the squared rate of the parameter by all stretches between `first` and `last` `(k,)`.

        `slopes` `(k, n + 2)` is the path's first derivative at parameters `at`.
        """
        allowed = least_between(self._speeds, self._ends, first, last)
        with np.errstate(divide="ignore"):
            fastest = ((allowed[:, :-2] / np.abs(slopes)) ** 2).min(axis=1)
            turning = (slopes[:, self._turning] ** 2).sum(axis=1)
            fastest = np.minimum(fastest, allowed[:, -2] ** 2 / np.maximum(turning, 1e-300))
            if len(self.path.curvature):
                bend = np.interp(at, self.path.curvature[:, 0], self.path.curvature[:, 1])
                fastest = np.minimum(fastest, allowed[:, -1] / (slopes[:, -2] ** 2 * bend))
        return np.asarray(fastest)


@dataclass(frozen=True, slots=True, eq=False)
class TcpSpeeds:
    """What the TCP's speed and angular speed may be while joints over time go along a path."""

    bounds: PathLimits
    timed: Timed
    least: Numbers
    """`(2, pieces)` in all of a piece; infinite where there is neither cap nor limit."""

    @classmethod
    def of(cls, bounds: PathLimits, timed: Timed) -> "TcpSpeeds":
        """Along the path of `bounds`."""
        return cls(bounds, timed, bounds.speeds(timed.parameters[:-1], timed.parameters[1:])[:, -3:-1].T)

    @property
    def hold(self) -> NDArray[np.bool_]:
        """`(pieces,)` where there is one."""
        return np.asarray(np.isfinite(self.least).any(axis=0))

    def between(self, which: NDArray[np.intp], shares: Numbers) -> Numbers:
        """`(m, 2, k)` in pieces `which` `(k,)`, between one of `shares` `(m + 1,)` of their time and the next."""
        s = self._parameters(which, shares[:, None])
        allowed = self.bounds.speeds(s[:-1].ravel(), s[1:].ravel())[:, -3:-1]
        return np.asarray(np.swapaxes(allowed.reshape(len(s) - 1, -1, 2), 1, 2))

    def _parameters(self, which: NDArray[np.intp], x: Numbers) -> Numbers:
        """Parameters `(m, k)` of the path at shares `x` `(m, 1)` of the time of pieces `(k,)`: rising cubics.

        By it, which is the joints' own weighted way, the joints have a speed of 1.
        """
        pieces, first, last = self.timed.pieces, self.timed.parameters[which], self.timed.parameters[which + 1]
        h = np.diff(pieces.knots)[which]
        rates = pieces.coefficients[:, 1] / self.bounds.limits.velocity
        rate = np.append(np.linalg.norm(rates, axis=1), 0.0)
        way, begin, end = last - first, rate[which] * h, rate[which + 1] * h
        y = 1.0 - x
        s = first + way * x * x * (3.0 - 2.0 * x) + x * y * (begin * y - end * x)
        return np.clip(np.maximum.accumulate(s, axis=0), first, last)


def _rise(change: Numbers, width: Numbers, otherwise: Numbers) -> Numbers:
    """Changes `(..., rows)` by their widths `(...)`; `otherwise` where these are none."""
    far = (width > _NARROW)[..., None]
    return np.where(far, change / np.where(far, width[..., None], 1.0), otherwise)
