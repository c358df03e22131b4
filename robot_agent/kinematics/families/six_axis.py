"""Six axes with a spherical wrist: axes Z Y Y X Y X; at joints zero the arm points along +X of the base.

Lengths are named by the joint that the link leads to and the axis along which it is measured: a1z, a2x, a2z, a3z, a4x,
a4z, a5x, a6x. The flange looks along its own +X.
"""

import math
from collections.abc import Iterator
from itertools import product
from struct import Struct
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.problem import Problem
from cell.config.units import STRICT, Length, PositiveLength
from cell.geometry import pose_rows
from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.errors import BadModel
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.six_axis_inverse import Lengths, solve_arm, solve_wrist, with_j4_held
from robot_agent.kinematics.families.six_axis_single import SingleInverse
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.solutions import Solutions
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import ClosedFormFile, family

AXES = (2, 1, 1, 0, 1, 0)
"""Axis of each joint in its own frame."""
NO_TURNS = [0.0] * 6
PACKED = Struct("48d8d8?8?8?")
"""Joints, excess, valid, in limits, singular of the eight slots of one pose: one block of memory with five arrays in it
takes a fraction of the time of five lists made arrays."""


class SixAxisGeometry(BaseModel):
    """Lengths of a six-axis arm with a spherical wrist; at joints zero upper arm up, forearm and flange along +X."""

    model_config = STRICT
    a1z: Length = Field(description="base to axis 1, along Z")
    a2x: Length = Field(description="axis 1 to axis 2, along X")
    a2z: Length = Field(description="axis 1 to axis 2, along Z")
    a3z: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along Z")
    a4x: Length = Field(description="axis 3 to axis 4, along X")
    a4z: Length = Field(description="axis 3 to axis 4, along Z")
    a5x: Length = Field(description="axis 4 to the wrist centre, along X")
    a6x: Length = Field(description="wrist centre to the flange, along X")


def _forearm(document: Document, robot: ClosedFormFile[SixAxisGeometry]) -> Iterator[Problem]:
    lengths = robot.geometry
    if math.hypot(lengths.a4z, lengths.a4x + lengths.a5x) == 0:
        yield document.problem(("geometry",), "a forearm of length 0", "a4x + a5x or a4z other than 0", at_key=True)


@family(
    "six_axis",
    "A six-axis arm with a spherical wrist.",
    ClosedFormFile[SixAxisGeometry],
    joints="RRRRRR",
    links="base 1 2 3 4 5 flange",
    check=_forearm,
)
class SixAxis(ClosedForm, SerialModel):
    """See the module; branches FRONT/BACK (J1) x UP/DOWN (elbow) x POSITIVE/NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = tuple(
        map("/".join, product(("FRONT", "BACK"), ("UP", "DOWN"), ("POSITIVE", "NEGATIVE")))
    )

    slots: ClassVar[tuple[int, ...]] = (2, 2, 2)

    def __init__(self, description: RobotDescription) -> None:
        self._lengths = _lengths(description)
        offsets = [(along_x, 0.0, along_z) for along_x, along_z in self._lengths.offsets]
        super().__init__(description, Chain(tuple(map(Joint, AXES, offsets))))
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
        rows = pose_rows(self.flange_at(poses), "poses")
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
        arm = with_j4_held(elements, solve_arm(elements, self._lengths, held[0]), self._lengths, held[3])
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
