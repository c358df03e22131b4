"""Six axes with a spherical wrist: axes Z Y Y X Y X; at joints zero the arm points along +X of the base.

Lengths are named by the joint that the link leads to and the axis along which it is measured: a1z, a2x, a2z, a3z, a4x,
a4z, a5x, a6x. The flange looks along its own +X.
"""

from itertools import product
from typing import ClassVar

import numpy as np

from cell.geometry import check_poses
from cell.geometry.arrays import Array
from robot_agent.kinematics.errors import BadInput, BadModel
from robot_agent.kinematics.model import Model
from robot_agent.kinematics.six_axis_inverse import LENGTHS, Lengths, solve_arm, solve_wrist
from robot_agent.kinematics.solutions import Solutions
from robot_agent.kinematics.turns import nearest_turn
from robot_agent.model.description import RobotDescription

AXES = (2, 1, 1, 0, 1, 0)
"""Column of each joint's own frame that is its axis."""


class SixAxis(Model):
    """See the module; branches FRONT/BACK (J1) x UP/DOWN (elbow) x POSITIVE/NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = tuple(
        map("/".join, product(("FRONT", "BACK"), ("UP", "DOWN"), ("POSITIVE", "NEGATIVE")))
    )

    def __init__(self, description: RobotDescription) -> None:
        self._lengths = _lengths(description)
        super().__init__(description)
        self._reach_m = self._capsule_reach()

    @property
    def reach_m(self) -> float:
        return self._reach_m

    def links(self, q: Array) -> Array:
        q = self.check_joints(q)
        joints = q.reshape(-1, 6).T
        cosines, sines = np.cos(joints), np.sin(joints)
        frames = np.zeros((joints.shape[1], 7, 4, 4))
        frames[:, :, 3, 3] = 1
        frames[:, 0] = np.eye(4)
        axes = [np.tile(column[:, None], joints.shape[1]) for column in np.eye(3)]
        origin = np.zeros((3, joints.shape[1]))
        for i, (axis, (along_x, along_z)) in enumerate(zip(AXES, self._lengths.offsets, strict=True)):
            origin = origin + along_x * axes[0] + along_z * axes[2]
            second, third = (axis + 1) % 3, (axis + 2) % 3
            u, v = axes[second], axes[third]
            axes[second] = cosines[i] * u + sines[i] * v
            axes[third] = cosines[i] * v - sines[i] * u
            for column in range(3):
                frames[:, i + 1, :3, column] = axes[column].T
            frames[:, i + 1, :3, 3] = origin.T
        return frames.reshape(*q.shape[:-1], 7, 4, 4)

    def jacobian(self, q: Array) -> Array:
        frames = self.links(q)[..., 1:, :3, :]
        axes = np.stack([frames[..., i, :, axis] for i, axis in enumerate(AXES)], axis=-2)
        arms = frames[..., -1:, :, 3] - frames[..., 3]
        columns = np.concatenate([np.cross(axes, arms), axes], axis=-1)
        return np.swapaxes(columns, -1, -2)

    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        poses = check_poses(poses, "poses")
        leading = poses.shape[:-2]
        held = self._held(near, leading)
        # (row, column, pose), so that each element is one contiguous array over all poses.
        rows = np.ascontiguousarray(poses[..., :3, :].reshape(-1, 12).T).reshape(3, 4, -1)
        arm = solve_arm(rows, self._lengths, held[0])
        wrist = solve_wrist(rows, arm, held[3])
        count = rows.shape[2]
        joints, in_limits = np.empty((count, 4, 2, 6)), np.ones((count, 4, 2), dtype=bool)
        for i, angles in enumerate((arm.j1, arm.j2, arm.j3, *wrist.angles)):
            turned, inside = nearest_turn(angles, held[i], *self.limits.position[i])
            # (2 or 4 or 4 x 2 distinct values, pose) into the eight slots of each pose.
            joints[..., i] = _into_slots(turned)
            in_limits &= _into_slots(inside)
        valid = np.repeat((arm.excess == 0).T, 2, axis=-1)
        joints[~valid] = np.nan
        shape = (*leading, 8)
        return Solutions(
            joints=joints.reshape(*shape, 6),
            valid=np.repeat(valid, 2, axis=-1).reshape(shape),
            in_limits=(in_limits & valid[..., None]).reshape(shape),
            singular=np.repeat((wrist.singular | arm.singular).T & valid, 2, axis=-1).reshape(shape),
            excess_m=np.repeat(arm.excess.T, 4, axis=-1).reshape(shape),
            branches=self.branches,
            complete=True,
        )

    def _held(self, near: Array | None, leading: tuple[int, ...]) -> Array:
        """`near` as `(6, 1)` or `(6, poses)`."""
        if near is None:
            return np.zeros((6, 1))
        near = self.check_joints(near, "near")
        if near.ndim == 1:
            return near[:, None]
        if near.shape[:-1] != leading:
            raise BadInput("near", f"shape {near.shape}", f"(6,) or {(*leading, 6)}")
        return np.ascontiguousarray(near.reshape(-1, 6).T)

    def _capsule_reach(self) -> float:
        """Triangle inequality over the pieces of the arm that do not change their length."""
        g = self._lengths
        shoulder = float(np.hypot(g.a2x, g.a1z + g.a2z))
        elbow = shoulder + g.a3z
        wrist = elbow + g.forearm
        start = (0.0, abs(g.a1z), shoulder, elbow, elbow + float(np.hypot(g.a4x, g.a4z)), wrist, wrist)
        reach = 0.0
        for capsule in self.description.capsules:
            for end in (capsule.start_m, capsule.end_m):
                # Axis 6 runs through the wrist centre, so flange and tool stay at one distance from it.
                point = np.add(end, (g.a6x, 0, 0)) if capsule.link == 6 else np.array(end)
                reach = max(reach, start[capsule.link] + float(np.linalg.norm(point)) + capsule.radius_m)
        return reach


def _into_slots(values: np.ndarray) -> np.ndarray:
    """`(2, p)` FRONT/BACK, `(4, p)` with elbow, or `(4, 2, p)` with wrist -> broadcasting with `(p, 4, 2)`."""
    if values.ndim == 3:
        return np.moveaxis(values, -1, 0)
    if len(values) == 2:
        return np.repeat(values.T, 2, axis=-1)[..., None]
    return values.T[..., None]


def _lengths(description: RobotDescription) -> Lengths:
    """The lengths of a six-axis arm, or `BadModel` with all that is wrong."""
    given, capsules = description.geometry, description.capsules
    problems = [f"length {name} is missing" for name in LENGTHS if name not in given]
    problems += [f"length {name} is unknown, allowed {', '.join(LENGTHS)}" for name in given if name not in LENGTHS]
    if len(description.joint_names) != 6:
        problems.append(f"found {len(description.joint_names)} joints, allowed 6")
    if not capsules:
        problems.append("found no capsules, allowed at least one: a robot without a body would be nowhere")
    problems += [
        f"capsule {i} is on link {c.link}, allowed 0 to 6" for i, c in enumerate(capsules) if c.link not in range(7)
    ]
    if not problems:
        lengths = Lengths(**given)
        if lengths.a3z > 0 and lengths.forearm > 0:
            return lengths
        problems.append("upper arm (a3z) and forearm (a4z, a4x + a5x) must be longer than zero")
    raise BadModel(description.name, tuple(problems))
