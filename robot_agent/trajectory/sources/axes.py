"""Along what a robot is jogged: its joints one by one, or its tool along and about the axes of a frame."""

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cell.geometry import quaternion
from cell.messages import JogFrame
from robot_agent.kinematics import Model
from robot_agent.trajectory.limits import Limits
from robot_agent.trajectory.sources.states import JointState, States
from robot_agent.trajectory.sources.tcp import joint_speeds, joints_along

Numbers = NDArray[np.float64]
_SHARE_ON_A_WAY = 0.25
"""Of the joints' speeds, on the way to a point."""


class Axes(Protocol):
    """`m` coordinates in which a jog is one of them changing."""

    acceleration: Numbers
    """`(m,)` what a plan may use, as `jerk`."""
    jerk: Numbers

    def motion(self, state: JointState) -> tuple[Numbers, Numbers]:
        """Velocity and acceleration `(m,)` of the coordinates."""

    def lead(self, state: JointState, index: int) -> Numbers:
        """Joint speeds `(n,)` for a unit speed of one coordinate. Raises `NoDirection`."""

    def states(self, state: JointState, course: Numbers) -> States:
        """Joint states for `course` `(3, k, m)`: positions counted from `state`, velocities, accelerations.

        Raises `NoDirection` and `robot_agent.kinematics.TrackError`.
        """

    def goal(self, state: JointState, index: int, distance: float) -> Numbers:
        """The place `distance` away along one coordinate, for `missing`."""

    def missing(self, state: JointState, index: int, goal: Numbers) -> float:
        """How far `goal` still is along the coordinate."""


class JointAxes:
    """Each joint is a coordinate."""

    def __init__(self, limits: Limits) -> None:
        self.acceleration = limits.both_ways
        self.jerk = limits.jerk

    def motion(self, state: JointState) -> tuple[Numbers, Numbers]:
        return state.qd, state.qdd

    def lead(self, state: JointState, index: int) -> Numbers:
        return np.asarray(np.eye(len(state.q))[index])

    def states(self, state: JointState, course: Numbers) -> States:
        return States(state.q + course[0], course[1], course[2])

    def goal(self, state: JointState, index: int, distance: float) -> Numbers:
        return np.array(state.q[index] + distance)

    def missing(self, state: JointState, index: int, goal: Numbers) -> float:
        return float(goal - state.q[index])


class WayAxes:
    """One coordinate: the straight way of all joints from where the robot rests to a goal, in rad and m together."""

    def __init__(self, limits: Limits, start: Numbers, goal: Numbers) -> None:
        """`start` and `goal` `(n,)` are joints."""
        self.length = float(np.linalg.norm(goal - start))
        self._goal = goal
        self._along = (goal - start) / self.length if self.length > 0.0 else np.zeros_like(goal)
        shares = np.maximum(np.abs(self._along), 1e-9)
        self.speed = _SHARE_ON_A_WAY * float((limits.velocity / shares).min())
        self.acceleration = np.array([(limits.both_ways / shares).min()])
        self.jerk = np.array([(limits.jerk / shares).min()])

    def motion(self, state: JointState) -> tuple[Numbers, Numbers]:
        return np.array([state.qd @ self._along]), np.array([state.qdd @ self._along])

    def lead(self, state: JointState, index: int) -> Numbers:  # noqa: ARG002
        return self._along

    def states(self, state: JointState, course: Numbers) -> States:
        q, qd, qdd = (course[order] * self._along for order in range(3))
        return States(state.q + q, qd, qdd)

    def goal(self, state: JointState, index: int, distance: float) -> Numbers:  # noqa: ARG002
        return self._goal

    def missing(self, state: JointState, index: int, goal: Numbers) -> float:  # noqa: ARG002
        return float((goal - state.q) @ self._along)


class ToolAxes:
    """X, Y, Z of the tool's TCP along the axes of a frame, and its turns about them; without a tool, of the flange."""

    def __init__(
        self, model: Model, limits: Limits, frame: JogFrame | Numbers, pose_world_base: Numbers | None = None
    ) -> None:
        """`frame` may be the rotation `(3, 3)` of any frame in the robot's base.

        `pose_world_base` `(4, 4)` is the pose of the robot's base in world, for that frame.
        """
        path = limits.path
        self._model = model
        self._frame = frame
        self._rotation_base_world = np.eye(3) if pose_world_base is None else pose_world_base[:3, :3].T
        self.acceleration = np.repeat([path.acceleration_m_s2, path.angular_acceleration_rad_s2], 3)
        self.jerk = np.repeat([path.jerk_m_s3, path.angular_jerk_rad_s3], 3)

    def motion(self, state: JointState) -> tuple[Numbers, Numbers]:
        jacobian = self._model.jacobian(state.q)
        v, w = np.split(jacobian @ state.qd, 2)
        bend = self._model.jacobian_derivative(state.q, state.qd) @ state.qd
        a, turn = np.split(jacobian @ state.qdd + bend, 2)
        to_frame = self._rotation_base_frame(state).T
        return np.append(to_frame @ v, to_frame @ w), np.append(to_frame @ a, to_frame @ turn)

    def lead(self, state: JointState, index: int) -> Numbers:
        axis = self._rotation_base_frame(state)[:, index % 3]
        twist = np.append(axis, np.zeros(3)) if index < 3 else np.append(np.zeros(3), axis)
        q = state.q[None]
        return np.asarray(joint_speeds(self._model, q, self._model.jacobian(q), twist[None])[0])

    def states(self, state: JointState, course: Numbers) -> States:
        from_frame = self._rotation_base_frame(state).T
        moved, v, a = (course[order, :, :3] @ from_frame for order in range(3))
        turned, w, turn = (course[order, :, 3:] @ from_frame for order in range(3))
        start = self._model.forward(state.q)
        tcp = np.repeat(start[None], len(moved), axis=0)
        tcp[:, :3, 3] += moved
        tcp[:, :3, :3] = _orientations(start[:3, :3], turned)
        return joints_along(self._model, tcp, np.hstack([v, w]), np.hstack([a, turn]), state.q)

    def goal(self, state: JointState, index: int, distance: float) -> Numbers:
        goal = self._model.forward(state.q).copy()
        axis = self._rotation_base_frame(state)[:, index % 3]
        if index < 3:
            goal[:3, 3] += distance * axis
        else:
            goal[:3, :3] = turn_by(distance * axis) @ goal[:3, :3]
        return goal

    def missing(self, state: JointState, index: int, goal: Numbers) -> float:
        here = self._model.forward(state.q)
        axis = self._rotation_base_frame(state)[:, index % 3]
        if index < 3:
            return float((goal[:3, 3] - here[:3, 3]) @ axis)
        x, y, z, w = quaternion.from_matrix(goal[:3, :3] @ here[:3, :3].T)
        return float(2.0 * np.arctan2(np.array([x, y, z]) @ axis, w))

    def _rotation_base_frame(self, state: JointState) -> Numbers:
        match self._frame:
            case np.ndarray() as rotation:
                return rotation
            case JogFrame.BASE:
                return np.eye(3)
            case JogFrame.WORLD:
                return self._rotation_base_world
            case JogFrame.TOOL:
                return np.asarray(self._model.forward(state.q)[:3, :3])


def turn_by(vectors: Numbers) -> Numbers:
    """Rotation matrices `(..., 3, 3)` of rotation vectors `(..., 3)` [rad]."""
    angle = np.linalg.norm(vectors, axis=-1, keepdims=True)
    half = np.append(vectors * np.sinc(angle / (2.0 * np.pi)) / 2.0, np.cos(angle / 2.0), axis=-1)
    return quaternion.to_matrix(half)


def _orientations(start: Numbers, turned: Numbers) -> Numbers:
    """Orientations `(k, 3, 3)` after turns that add up to `turned` `(k, 3)` [rad] in base, one small turn each."""
    turns = turn_by(np.diff(turned, axis=0, prepend=np.zeros((1, 3))))
    result = np.empty_like(turns)
    here = start
    for k, turn in enumerate(turns):
        here = turn @ here
        result[k] = here
    return result
