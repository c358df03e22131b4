"""Palletizer: four axes and a parallelogram that keeps the hand level; axes Z Y Y (passive Y) Z.

Lengths are named by the joint that the link leads to and the axis along which it is measured: a1x, a1z, a2z, a3x, a4x,
a4z. J3 is the angle between the links; the motor of axis 3 tilts the forearm against the base, which is the coupling
J2 -> J3 of -1 in the robot file. Frigeni, appendix (A-80, A-94), which gives FRONT/UP only.
"""

from collections.abc import Iterator
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.document import Document
from cell.config.problem import Problem
from cell.config.units import STRICT, Length, PositiveLength
from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.six_axis_inverse import Lengths, solve_arm
from robot_agent.kinematics.families.upright import heading, tilt
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.reach import Places, placed, points, together, turned
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import ClosedFormFile, family
from robot_agent.model.robot_file import RobotFile

MIXING = np.array([[1.0, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, -1, -1, 0], [0, 0, 0, 1]])
"""The passive wrist turns against J2 and J3."""


class PalletizerGeometry(BaseModel):
    """Lengths of a palletizer; at joints zero upper arm up, forearm along +X, the hand always level."""

    model_config = STRICT
    a1x: Length = Field(description="axis 1 to axis 2, along X")
    a1z: Length = Field(description="base to axis 2, along Z")
    a2z: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along Z")
    a3x: PositiveLength = Field(description="forearm: axis 3 to the hand, along X")
    a4x: Length = Field(description="hand to the flange, along X")
    a4z: Length = Field(description="hand to the flange, along Z; usually negative")


def _parallelogram(document: Document, _robot: RobotFile) -> Iterator[Problem]:
    if "coupling" not in document.keys(()):
        allowed = "coupling: {J3: {J2: -1}} for a parallelogram driven from the base, {} for a motor at the elbow"
        yield document.problem(("coupling",), "nothing", allowed)


@family(
    "palletizer",
    "A palletizer with four axes and a hand that stays level.",
    ClosedFormFile[PalletizerGeometry],
    joints="RRRR",
    links="base 1 2 3 hand flange",
    check=_parallelogram,
)
class Palletizer(ClosedForm, SerialModel):
    """See the module; branches FRONT/BACK (J1) x UP/DOWN (elbow). Limits usually leave FRONT/UP."""

    branches: ClassVar[tuple[str, ...]] = ("FRONT/UP", "FRONT/DOWN", "BACK/UP", "BACK/DOWN")

    slots: ClassVar[tuple[int, ...]] = (2, 2)

    def __init__(self, description: RobotDescription) -> None:
        g = self._lengths = checked_lengths(description, positive=("a2z", "a3x"))
        steps = (
            Joint(2),
            Joint(1, (g["a1x"], 0, g["a1z"])),
            Joint(1, (0, 0, g["a2z"])),
            Joint(1, (g["a3x"], 0, 0)),
            Joint(2, (g["a4x"], 0, g["a4z"])),
        )
        # The hand stays level, so the flange is a fixed way ahead of the wrist and above it: part of the shoulder.
        self._arm = Lengths(
            a1z=g["a1z"] + g["a4z"], a2x=g["a1x"] + g["a4x"], a2z=0, a3z=g["a2z"], a4x=g["a3x"], a4z=0, a5x=0, a6x=0
        )
        super().__init__(description, Chain(steps), MIXING)

    def singularity(self, q: Array) -> SingularityDistance:
        q, arm = self.check_joints(q), self._arm
        j23 = q[..., 1] + q[..., 2]
        radius = arm.a2x + arm.a3z * np.sin(q[..., 1]) + arm.a4x * np.cos(j23)
        measures = np.abs(radius) / (abs(arm.a2x) + arm.a3z + arm.a4x), np.abs(np.cos(q[..., 2]))
        return SingularityDistance(("shoulder", "elbow"), np.stack(measures, axis=-1))

    def _places(self, link: int, at: Array) -> Places:
        """After the forearm nothing turns but the flange: the hand is carried along, level."""
        if link < 4:
            return super()._places(link, at)
        g = self._lengths
        forearm = placed(turned(points(np.array([[g["a3x"], 0.0, 0.0]])), 1), np.array([0.0, 0.0, g["a2z"]]))
        hand = points(at)
        if link == 5:
            hand = placed(turned(hand, 2), np.array([g["a4x"], 0.0, g["a4z"]]))
        shoulder = np.array([g["a1x"], 0.0, g["a1z"]])
        return turned(placed(together(turned(forearm, 1), hand), shoulder), 2)

    def branches_of(self, elements: Array, held: Array) -> Raw:
        arm = solve_arm(elements, self._arm, held[0])
        j1 = arm.j1[:, None]
        return Raw(
            joints=(j1, *arm.j23, heading(elements) - j1),
            excess_m=arm.excess[:, None],
            singular=arm.singular,
            tilt_rad=tilt(elements),
        )
