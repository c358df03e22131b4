"""Six axes with a spherical wrist: axes Z Y Y X Y X; at joints zero the arm points along +X of the base.

Lengths are named by the joint that the link leads to and the axis along which it is measured: a1z, a2x, a2z, a3z, a4x,
a4z, a5x, a6x. The flange looks along its own +X.
"""

from itertools import product
from struct import Struct
from typing import ClassVar

import numpy as np

from cell.geometry import pose_rows
from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Step
from robot_agent.kinematics.errors import BadModel
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.six_axis_inverse import Lengths, solve_arm, solve_wrist
from robot_agent.kinematics.families.six_axis_single import SingleInverse
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.solutions import Solutions
from robot_agent.model.description import RobotDescription

AXES = (2, 1, 1, 0, 1, 0)
"""Axis of each joint in its own frame."""
NO_TURNS = [0.0] * 6
PACKED = Struct("48d8d8?8?8?")
"""Joints, excess, valid, in limits, singular of the eight slots of one pose: one block of memory with five arrays in it
takes a fraction of the time of five lists made arrays."""


class SixAxis(ClosedForm, SerialModel):
    """See the module; branches FRONT/BACK (J1) x UP/DOWN (elbow) x POSITIVE/NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = tuple(
        map("/".join, product(("FRONT", "BACK"), ("UP", "DOWN"), ("POSITIVE", "NEGATIVE")))
    )

    slots: ClassVar[tuple[int, ...]] = (2, 2, 2)

    def __init__(self, description: RobotDescription) -> None:
        self._lengths = _lengths(description)
        offsets = [(along_x, 0.0, along_z) for along_x, along_z in self._lengths.offsets]
        super().__init__(description, Chain(tuple(map(Step, AXES, offsets))))
        self._single = SingleInverse(self._lengths, self.limits.position.tolist())

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
        poses = np.asarray(poses, dtype=float)
        if poses.shape != (4, 4):
            return super().inverse(poses, near)
        rows = pose_rows(poses, "poses")
        slots = self._single.solve(rows, NO_TURNS if near is None else self.check_one(near, "near"))
        block = bytearray(PACKED.pack(*slots.joints, *slots.excess_m, *slots.valid, *slots.in_limits, *slots.singular))
        return Solutions(
            joints=np.ndarray((8, 6), float, block),
            valid=np.ndarray(8, bool, block, 448),
            in_limits=np.ndarray(8, bool, block, 456),
            singular=np.ndarray(8, bool, block, 464),
            excess_m=np.ndarray(8, float, block, 384),
            branches=self.branches,
            complete=True,
            tilt_rad=np.zeros(()),
        )

    def branches_of(self, elements: Array, held: Array) -> Raw:
        arm = solve_arm(elements, self._lengths, held[0])
        wrist = solve_wrist(elements, arm, held[3])
        return Raw(
            joints=(arm.j1[:, None, None], *arm.j23[:, :, :, None], *wrist.j456),
            excess_m=arm.excess[:, None, None],
            singular=(wrist.singular | arm.singular)[:, :, None],
        )


def _lengths(description: RobotDescription) -> Lengths:
    """The lengths of a six-axis arm, or `BadModel` with all that is wrong."""
    lengths = Lengths(**checked_lengths(description, positive=("a3z",)))
    if lengths.forearm > 0:
        return lengths
    raise BadModel(description.name, ("the forearm (a4z, a4x + a5x) must be longer than zero",))
