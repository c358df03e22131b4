"""Time along a line: an S-curve in its length, slowed down until every joint keeps its limits."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import KinematicsError, Model, Reason, TrackError
from robot_agent.paths import Line, LineGeometry
from robot_agent.trajectory.errors import PlanError
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.pieces import Pieces
from robot_agent.trajectory.s_curve import SCurve, s_curve

SLOWEST = 20.0
"""A line whose joints would stretch it to more than this many times its own duration is refused."""
_DEVIATION = 1e-7
"""Largest distance [m] and angle [rad] between the joints' curve and the line."""
_ATTEMPTS = 16
_SHORTEST_PIECE_S = 5e-4
_STEP_RAD = 1e-5
_ORDERS = np.array([1.0, 2.0, 3.0])
_MUCH_LONGER = f"more than {SLOWEST:.0f} times as long"
_HINT = "use a joint move here, or move the line away from the singular pose"
_OUT_OF_REACH = (None, "move the line into the robot's reach")
_TRACKING = {
    Reason.TOO_FAR: _OUT_OF_REACH,
    Reason.TOO_NEAR: _OUT_OF_REACH,
    Reason.JOINT_LIMIT: ("position", "move the line, or begin it with other joints after a joint move"),
    Reason.BRANCH_CHANGE: ("velocity", _HINT),
    Reason.TILTED: (None, "give the target an orientation that the robot can take"),
    Reason.NOT_FOUND: _OUT_OF_REACH,
}
"""The limit that a line breaks where its poses have no continuous joints, and what to do."""


def plan_line(
    model: Model, block: Line, index: int, limits: Limits, start: NDArray[np.float64], cycle_s: float
) -> Pieces:
    """Joints over time on the line from joints `start` `(n,)`, from rest to rest. Raises PlanError.

    All of the line is slowed down by one factor k, which scales its speed by k, its acceleration by k^2 and its jerk by
    k^3: the profile keeps its shape, so one look at the unscaled profile gives k.
    """
    if block.target_pose.shape != (4, 4) or not np.isfinite(block.target_pose).all():
        raise PlanError(index, block.line, "the target is not a finite pose", "check the target's values")
    geometry = LineGeometry.between(model.forward(start), block.target_pose)
    if geometry.is_empty:
        return Pieces.standing(start)
    timing = _LineTiming(model, block, index, limits, start, geometry)
    free, rate, piece_s = timing.free_limits(), 1.0, cycle_s
    for _ in range(_ATTEMPTS):
        profile = s_curve(1.0, *(free * rate**_ORDERS))
        knots = _knots(profile, piece_s)
        pieces = timing.follow(profile, knots, rate)
        if timing.deviation(pieces, profile) > _DEVIATION:
            piece_s /= 2.0
            continue
        k = timing.fitting_rate(pieces, rate)
        if k > 0.999:
            return pieces.slower(k)
        rate *= k * 0.9995
    hint = "split the line, or use a joint move here"
    raise PlanError(index, block.line, "the joints cannot follow this line closely enough", hint)


def _knots(profile: SCurve, piece_s: float) -> NDArray[np.float64]:
    """Times `(p + 1,)` at most `piece_s` apart, on the jerk steps of the profile unless that makes tiny pieces."""
    steps = profile.starts[1:-1]
    count = max(2, math.ceil(profile.duration_s / piece_s))
    even = np.linspace(0.0, profile.duration_s, count + 1)[1:-1]
    far = np.abs(even[:, None] - steps).min(axis=1) >= min(_SHORTEST_PIECE_S, piece_s / 4.0)
    inner = np.sort(np.concatenate([steps, even[far]]))
    kept, shortest = [0.0], min(_SHORTEST_PIECE_S, piece_s / 8.0)
    for knot in inner:
        if knot - kept[-1] >= shortest and profile.duration_s - knot >= shortest:
            kept.append(float(knot))
    return np.array([*kept, profile.duration_s])


@dataclass(frozen=True, slots=True, eq=False)
class _LineTiming:
    model: Model
    block: Line
    index: int
    limits: Limits
    start: NDArray[np.float64]
    geometry: LineGeometry

    def free_limits(self) -> NDArray[np.float64]:
        """Speed, acceleration and jerk `(3,)` of the path parameter without the joints; the slower of both rules."""
        path, length, angle = self.limits.path, self.geometry.length_m, self.geometry.angle
        speed = path.speed_m_s if self.block.speed_m_s is None else min(path.speed_m_s, self.block.speed_m_s)
        linear = np.array([speed, path.acceleration_m_s2, path.jerk_m_s3])
        angular = np.array([path.angular_speed_rad_s, path.angular_acceleration_rad_s2, path.angular_jerk_rad_s3])
        by_length = linear / length if length > 0.0 else np.full(3, np.inf)
        by_angle = angular / angle if angle > 0.0 else np.full(3, np.inf)
        return np.minimum(by_length, by_angle)

    def follow(self, profile: SCurve, knots: NDArray[np.float64], rate: float) -> Pieces:
        """The joints' curve through the exact states at `knots`; refuses joints that are far too fast."""
        u, speed, acceleration, _ = profile.at(knots)
        poses = self.geometry.poses(u)
        q = self._track(poses)
        tangent, curvature = self._derivatives(q, poses)
        qd = tangent * speed[:, None]
        excess = np.abs(qd) / self.limits.velocity
        if excess.max() > SLOWEST * rate:
            row, joint = np.unravel_index(int(np.argmax(excess)), excess.shape)
            found = float(abs(qd[row, joint])) / rate
            raise self._too_fast(int(joint), found, poses[row])
        return Pieces.through(knots, q, qd, curvature * speed[:, None] ** 2 + tangent * acceleration[:, None])

    def deviation(self, pieces: Pieces, profile: SCurve) -> float:
        """Largest distance [m] or angle [rad] from the line in the middle between knots."""
        middle = (pieces.knots[:-1] + pieces.knots[1:]) / 2.0
        away = self.model.forward(pieces.position(middle)) - self.geometry.poses(profile.at(middle)[0])
        turned = np.linalg.norm(away[:, :3, :3], axis=(1, 2)) / math.sqrt(2.0)
        return float(max(np.linalg.norm(away[:, :3, 3], axis=1).max(), turned.max()))

    def fitting_rate(self, pieces: Pieces, rate: float) -> float:
        """Largest factor (at most 1) at which velocity, acceleration and jerk of every joint fit.

        `rate` is how much slower than its own limits the line already is. Raises PlanError when that gets too slow.
        """
        allowed = np.stack([self.limits.velocity, self.limits.acceleration, self.limits.jerk])
        ratio = allowed / np.maximum(pieces.peaks(), 1e-12)
        factor = ratio ** (1.0 / _ORDERS)[:, None]
        order, joint = np.unravel_index(int(np.argmin(factor)), factor.shape)
        if rate * factor[order, joint] * SLOWEST < 1.0:
            limit = ("velocity", "acceleration", "jerk")[order]
            reason = f"the {limit} limit of joint {self.model.joint_names[joint]} would make the line {_MUCH_LONGER}"
            raise self._refusal(reason, _HINT, self.model.joint_names[joint], limit)
        return min(1.0, float(factor[order, joint]))

    def _track(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        try:
            q = self.model.track(poses, start=self.start)
        except TrackError as error:
            pose = poses[error.index]
            limit, hint = _TRACKING[error.reason]
            raise self._refusal(str(error.violation), hint, error.joint, limit, pose) from error
        except KinematicsError as error:
            raise self._refusal(str(error), _HINT) from error
        gap = np.abs(q[0] - self.start)
        if gap.max() > 1e-7:
            name = self.model.joint_names[int(np.argmax(gap))]
            reason = f"the line would begin with a jump of joint {name}, the start is a singular pose"
            raise self._refusal(reason, _HINT, name, "velocity", poses[0])
        q = q.copy()
        q[0] = self.start
        return q

    def _derivatives(
        self, q: NDArray[np.float64], poses: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """First and second derivative `(m, n)` of the joints by the path parameter.

        The twist along a line is constant, so J q' = twist and J q'' = -J' q', with J' along the path from the
        Jacobian on both sides of each point.
        """
        jacobian = self.model.jacobian(q)
        twist = np.broadcast_to(self.geometry.twist, (len(q), 6))
        tangent = self._solve(jacobian, twist, poses)
        step = _STEP_RAD / np.maximum(np.abs(tangent).max(axis=1), 1e-12)[:, None]
        ahead, behind = self.model.jacobian(q + step * tangent), self.model.jacobian(q - step * tangent)
        change = ((ahead - behind) @ tangent[..., None])[..., 0] / (2.0 * step)
        return tangent, self._solve(jacobian, -change, poses)

    def _solve(
        self, jacobian: NDArray[np.float64], twist: NDArray[np.float64], poses: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Joint velocities `(m, n)` for twists `(m, 6)`; least squares for robots with fewer than six joints."""
        matrix, right = jacobian, twist[..., None]
        if self.model.n != 6:
            transposed = np.swapaxes(jacobian, -1, -2)
            matrix, right = transposed @ jacobian, transposed @ right
        singular = np.linalg.cond(matrix) > 1e12
        if singular.any():
            reason = "the line passes exactly through a singular pose, where a joint would have to turn instantly"
            raise self._refusal(reason, _HINT, limit="velocity", pose=poses[int(np.argmax(singular))])
        return np.asarray(np.linalg.solve(matrix, right)[..., 0])

    def _too_fast(self, joint: int, found: float, pose: NDArray[np.float64]) -> PlanError:
        name, allowed = self.model.joint_names[joint], float(self.limits.velocity[joint])
        speeds = f"{math.degrees(found):.0f} deg/s, allowed {math.degrees(allowed):.0f}"
        reason = f"joint {name} would have to turn at {speeds}; the line would take {_MUCH_LONGER}"
        return self._refusal(reason, _HINT, name, "velocity", pose)

    def _refusal(
        self,
        reason: str,
        hint: str,
        joint: str | None = None,
        limit: str | None = None,
        pose: NDArray[np.float64] | None = None,
    ) -> PlanError:
        return PlanError(self.index, self.block.line, reason, hint, joint, limit, pose)
