"""The limits of a joint path in the form that timing needs: affine in acceleration and squared speed.

Along a path with parameter s every joint moves with q' s_dot, q' s_ddot + q'' s_dot^2 and
q' s_dddot + 3 q'' s_dot s_ddot + q''' s_dot^3; the flange's way and turn are two more coordinates of the same form.
"""

from dataclasses import dataclass

import numpy as np

from robot_agent.trajectory.joint_path import JointPath, Numbers
from robot_agent.trajectory.limits import Limits


@dataclass(frozen=True, slots=True, eq=False)
class Rows:
    """Derivatives by the parameter `(k, rows)`, divided by the limits of acceleration or, where it says so, of jerk."""

    first: Numbers
    second: Numbers
    first_jerk: Numbers
    second_jerk: Numbers
    third_jerk: Numbers
    fastest: Numbers
    """`(k,)` bound on s_dot^2."""


class PathLimits:
    """The limits along one path."""

    def __init__(self, path: JointPath, limits: Limits) -> None:
        self._path = path
        flange = limits.path
        self._ends = np.array([each.end for each in path.stretches[:-1]])
        linear = [flange.speed_m_s, flange.acceleration_m_s2, flange.jerk_m_s3]
        angular = [flange.angular_speed_rad_s, flange.angular_acceleration_rad_s2, flange.angular_jerk_rad_s3]
        tables = []
        for order, joints in enumerate((limits.velocity, limits.acceleration, limits.jerk)):
            rows = []
            for each in path.stretches:
                own = np.array([linear[order], angular[order]]) if each.on_path else np.full(2, np.inf)
                caps = np.array([each.speed_m_s, each.rotation_rad_s])
                share = each.joint_speed if order == 0 else 1.0
                rows.append(np.concatenate([share * joints, np.minimum(own, caps) if order == 0 else own]))
            tables.append(np.array(rows))
        self._velocity, self._acceleration, self._jerk = tables
        self._turning = np.flatnonzero(limits.turning)
        self._joint = np.array([each.joint_rad_s for each in path.stretches])
        self._lateral = np.array([flange.acceleration_m_s2 if each.on_path else np.inf for each in path.stretches])

    def rows(self, at: Numbers) -> Rows:
        """The rows at parameters `at` `(k,)`."""
        _, first, second, third = self._path.pieces.shape(at)
        stretch = np.searchsorted(self._ends, at, side="right")
        acceleration, jerk = self._acceleration[stretch], self._jerk[stretch]
        with np.errstate(divide="ignore"):
            fastest = ((self._velocity[stretch] / np.abs(first)) ** 2).min(axis=1)
            turning = (first[:, self._turning] ** 2).sum(axis=1)
            fastest = np.minimum(fastest, self._joint[stretch] ** 2 / np.maximum(turning, 1e-300))
            if len(self._path.curvature):
                bend = np.interp(at, self._path.curvature[:, 0], self._path.curvature[:, 1])
                way = first[:, -2] ** 2 * bend
                fastest = np.minimum(fastest, self._lateral[stretch] / way)
        return Rows(first / acceleration, second / acceleration, first / jerk, second / jerk, third / jerk, fastest)
