"""The limits of a joint path in the form that timing needs: affine in acceleration and squared speed.

Along a path with parameter s every joint moves with q' s_dot, q' s_ddot + q'' s_dot^2 and
q' s_dddot + 3 q'' s_dot s_ddot + q''' s_dot^3; the TCP's way and turn are two more coordinates of the same form.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.trajectory.joints.joint_path import JointPath, Numbers
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.timing.affine import Affine, Scaled

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
        self._path = path
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
        self._velocity, above, below, jerk = tables
        one = np.ones_like(above)
        self._scaled, self._per_jerk = Affine(one, one, np.zeros(1), -below, above).scaled(), 1.0 / jerk
        self._turning = np.flatnonzero(limits.turning)
        self._joint = np.array([each.joint_rad_s for each in path.stretches])
        self._lateral = np.array([tcp.acceleration_m_s2 if each.on_path else np.inf for each in path.stretches])

    def rows(self, at: Numbers, around: Numbers | None = None, wide: Numbers | None = None) -> Rows:
        """The rows at parameters `at` `(k,)`.

        With borders `around` `(places + 1, m)` of the parts in which `at` lies, `m` for each place, the third
        derivative is its mean in these: what jerk a motion has that is looked at no closer. Where that of the TCP
        steps it is the larger one of both sides. With `wide` `(2, k)` the
        bound on the speed is the least of all stretches between.
        """
        first, second, third = self._path.pieces.slopes(at)
        if around is not None:
            third = self._third_around(at, around, second, third)
        stretch = np.searchsorted(self._ends, at, side="right")
        fastest = self._fastest(at, first, stretch)
        for each in () if wide is None else np.searchsorted(self._ends, wide, side="right"):
            other = np.flatnonzero(each != stretch)
            if len(other):
                fastest[other] = np.minimum(fastest[other], self._fastest(at[other], first[other], each[other]))
        tables = self._scaled.a, self._scaled.above, self._scaled.below, self._per_jerk
        scale, above, below, per_jerk = (each.take(stretch, axis=0) for each in tables)
        affine = Scaled(first * scale, second * scale, above, below)
        return Rows(affine, first * per_jerk, second * per_jerk, third * per_jerk, fastest)

    def _third_around(self, at: Numbers, around: Numbers, second: Numbers, third: Numbers) -> Numbers:
        """Third derivatives `(k, n + 2)` as `rows` describes them."""
        bends, joints = self._path.pieces.bends(around), self._path.joints
        mean = _rise(np.diff(bends, axis=0), np.diff(around, axis=0), third.reshape(bends[1:].shape))
        here, s = second.reshape(mean.shape)[..., joints:], at.reshape(mean.shape[:2])
        tcp, own = bends[..., joints:], mean[..., joints:]
        before, after = _rise(here - tcp[:-1], s - around[:-1], own), _rise(tcp[1:] - here, around[1:] - s, own)
        mean[..., joints:] = np.where(np.abs(before) > np.abs(after), before, after)
        return mean.reshape(third.shape)

    def _fastest(self, at: Numbers, first: Numbers, stretch: NDArray[np.intp]) -> Numbers:
        """The bound `(k,)` on the squared rate of the parameter with the limits of `stretch` `(k,)`.

        `first` `(k, n + 2)` is the path's first derivative there.
        """
        with np.errstate(divide="ignore"):
            fastest = ((self._velocity.take(stretch, axis=0) / np.abs(first)) ** 2).min(axis=1)
            turning = (first[:, self._turning] ** 2).sum(axis=1)
            fastest = np.minimum(fastest, self._joint[stretch] ** 2 / np.maximum(turning, 1e-300))
            if len(self._path.curvature):
                bend = np.interp(at, self._path.curvature[:, 0], self._path.curvature[:, 1])
                fastest = np.minimum(fastest, self._lateral[stretch] / (first[:, -2] ** 2 * bend))
        return np.asarray(fastest)


def _rise(change: Numbers, width: Numbers, otherwise: Numbers) -> Numbers:
    """Changes `(..., rows)` by their widths `(...)`; `otherwise` where these are none."""
    far = (width > _NARROW)[..., None]
    return np.where(far, change / np.where(far, width[..., None], 1.0), otherwise)
