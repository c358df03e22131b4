"""Six axes with a spherical wrist: axes Z Y Y X Y X; at joints zero the arm points along +X of the base.

Lengths are named by the joint that the link leads to and the axis along which it is measured: a1z, a2x, a2z, a3z, a4x,
a4z, a5x, a6x. The flange looks along its own +X.
"""

from itertools import product
from typing import ClassVar

import numpy as np

from cell.geometry import check_poses
from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Step
from robot_agent.kinematics.errors import BadModel
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.six_axis_inverse import Arm, Lengths, Wrist, solve_arm, solve_wrist
from robot_agent.kinematics.six_axis_single import Ranges, solve_one
from robot_agent.kinematics.solutions import Solutions
from robot_agent.kinematics.turns import nearest_turn
from robot_agent.model.description import RobotDescription

AXES = (2, 1, 1, 0, 1, 0)
"""Axis of each joint in its own frame."""


class SixAxis(SerialModel):
    """See the module; branches FRONT/BACK (J1) x UP/DOWN (elbow) x POSITIVE/NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = tuple(
        map("/".join, product(("FRONT", "BACK"), ("UP", "DOWN"), ("POSITIVE", "NEGATIVE")))
    )

    def __init__(self, description: RobotDescription) -> None:
        self._lengths = _lengths(description)
        offsets = [(along_x, 0.0, along_z) for along_x, along_z in self._lengths.offsets]
        super().__init__(description, Chain(tuple(map(Step, AXES, offsets))))
        self._ranges: Ranges = [(lower, upper) for lower, upper in self.limits.position.tolist()]

    def singularity(self, q: Array) -> SingularityDistance:
        q, g = self.check_joints(q), self._lengths
        rest = np.arctan2(g.a4x + g.a5x, g.a4z)
        wrist = g.a2x + g.a3z * np.sin(q[..., 1]) + g.forearm * np.sin(q[..., 1] + q[..., 2] + rest)
        measures = (
            np.abs(wrist) / (abs(g.a2x) + g.a3z + g.forearm),
            np.abs(np.sin(q[..., 2] + rest)),
            np.abs(np.sin(q[..., 4])),
        )
        return SingularityDistance(("shoulder", "elbow", "wrist"), np.stack(measures, axis=-1))

    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        poses = check_poses(poses, "poses")
        leading = poses.shape[:-2]
        held = self.held(near, leading)
        if not leading:
            return self._single(poses, held[:, 0])
        # (row, column, pose), so that each element is one contiguous array over all poses.
        rows = np.ascontiguousarray(poses[..., :3, :].reshape(-1, 12).T).reshape(3, 4, -1)
        arm = solve_arm(rows, self._lengths, held[0])
        wrist = solve_wrist(rows, arm, held[3])
        return self._in_slots(arm, wrist, held, leading)

    def _single(self, pose: Array, held: Array) -> Solutions:
        slots = solve_one(pose.tolist(), self._lengths, held.tolist(), self._ranges)
        return Solutions(
            joints=np.array(slots.joints),
            valid=np.array(slots.valid),
            in_limits=np.array(slots.in_limits),
            singular=np.array(slots.singular),
            excess_m=np.array(slots.excess_m),
            branches=self.branches,
            complete=True,
            tilt_rad=np.zeros(()),
        )

    def _in_slots(self, arm: Arm, wrist: Wrist, held: Array, leading: tuple[int, ...]) -> Solutions:
        """As `solutions.finished`; each angle is brought to its turn once, not once for every slot that has it."""
        count = arm.j1.shape[1]
        joints, inside = np.empty((6, 2, 2, 2, count)), np.ones((2, 2, 2, count), dtype=bool)
        valid = arm.excess == 0
        missing = np.where(valid, 0.0, np.nan)[:, None]
        negative = np.stack([wrist.j4 + wrist.half_turn, -wrist.j5, wrist.j6 + wrist.half_turn])
        if wrist.singular.any():
            negative[1][wrist.singular] *= -1
        positive = (wrist.j4, wrist.j5, wrist.j6)
        for i, angles in enumerate((arm.j1[:, None, None], arm.j2[:, :, None], arm.j3[:, :, None])):
            turned, fits = nearest_turn(angles, held[i], *self.limits.position[i])
            np.add(turned, missing[:, :, None], out=joints[i])
            inside &= fits
        for i, both in enumerate(zip(positive, negative, strict=True), 3):
            for slot, angles in enumerate(both):
                turned, fits = nearest_turn(angles, held[i], *self.limits.position[i])
                np.add(turned, missing, out=joints[i, :, :, slot])
                inside[:, :, slot] &= fits
        inside &= valid[:, None, None]
        singular = (wrist.singular | arm.singular) & valid[:, None]

        def slots(values: np.ndarray) -> np.ndarray:
            """`(2, 1 or 2, 1 or 2, p)` -> `(..., 8)`."""
            return np.broadcast_to(values, (2, 2, 2, count)).reshape(8, count).T.reshape(*leading, 8)

        return Solutions(
            joints=joints.reshape(6, 8, count).transpose(2, 1, 0).reshape(*leading, 8, 6),
            valid=slots(valid[:, None, None]),
            in_limits=slots(inside),
            singular=slots(singular[:, :, None]),
            excess_m=slots(arm.excess[:, None, None]),
            branches=self.branches,
            complete=True,
            tilt_rad=np.zeros(leading),
        )

    def _capsule_reach(self) -> float:
        """Triangle inequality over the pieces of the arm that do not change their length."""
        g = self._lengths
        shoulder = float(np.hypot(g.a2x, g.a1z + g.a2z))
        elbow = shoulder + g.a3z
        wrist = elbow + g.forearm
        start = (0.0, abs(g.a1z), shoulder, elbow, elbow + float(np.hypot(g.a4x, g.a4z)), wrist, wrist)
        reach = 0.0
        for capsule in self.body:
            for end in (capsule.start_m, capsule.end_m):
                # Axis 6 runs through the wrist centre, so flange and tool stay at one distance from it.
                point = np.add(end, (g.a6x, 0, 0)) if capsule.link == 6 else np.array(end)
                reach = max(reach, start[capsule.link] + float(np.linalg.norm(point)) + capsule.radius_m)
        return reach


def _lengths(description: RobotDescription) -> Lengths:
    """The lengths of a six-axis arm, or `BadModel` with all that is wrong."""
    lengths = Lengths(**checked_lengths(description, positive=("a3z",)))
    if lengths.forearm > 0:
        return lengths
    raise BadModel(description.name, ("the forearm (a4z, a4x + a5x) must be longer than zero",))
