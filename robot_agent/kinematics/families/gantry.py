"""Gantry: three axes that slide along -Y, +X and +Z of the base, and a wrist Z Y Z.

One length, a6z: from the wrist centre to the flange. After a thesis on the CANopen control of a six-axis FESTO gantry
(its modified Denavit-Hartenberg table), whose Jacobian has sin q5 where sin q4 belongs.
"""

from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT, Length
from cell.geometry.arrays import Array
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.six_axis_inverse import SINGULAR_SINE
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import ClosedFormFile, family

BASE_TO_SLIDES = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
"""Turned by -90 deg about Z, the slides are along X, Y, Z."""


class GantryGeometry(BaseModel):
    """Length of a gantry with a wrist Z Y Z; its slides are along -Y, +X and +Z of the base."""

    model_config = STRICT
    a6z: Length = Field(description="wrist centre to the flange, along Z")


@family(
    "gantry",
    "A gantry with three slides and a wrist.",
    ClosedFormFile[GantryGeometry],
    joints="PPPRRR",
    links="base 1 2 3 4 5 flange",
)
class Gantry(ClosedForm, SerialModel):
    """See the module; branches POSITIVE and NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = ("POSITIVE", "NEGATIVE")

    slots: ClassVar[tuple[int, ...]] = (2,)

    def __init__(self, description: RobotDescription) -> None:
        self._a6z = checked_lengths(description)["a6z"]
        end = np.eye(4)
        end[2, 3] = self._a6z
        slides = (
            Joint(0, linear=True, rotation=BASE_TO_SLIDES),
            Joint(1, linear=True),
            Joint(2, linear=True),
        )
        super().__init__(description, Chain((*slides, Joint(2), Joint(1), Joint(2)), end))

    def singularity(self, q: Array) -> SingularityDistance:
        return SingularityDistance(("wrist",), np.abs(np.sin(self.check_joints(q)[..., 4:5])))

    def branches_of(self, elements: Array, held: Array) -> Raw:
        x, y, z = elements[:3, 3] - self._a6z * elements[:3, 2]
        # The rows of the rotation as the slides see it.
        r1, r2, r3 = -elements[1], elements[0], elements[2]
        straight = np.sqrt(r1[2] * r1[2] + r2[2] * r2[2]) < SINGULAR_SINE
        j4 = np.where(straight, held[3], np.arctan2(r2[2], r1[2]))
        cos4, sin4 = np.cos(j4), np.sin(j4)
        j5 = np.arctan2(cos4 * r1[2] + sin4 * r2[2], r3[2])
        # Second row of Rz(J4)^T R is (sin J6, cos J6, 0): well conditioned for every J5.
        j6 = np.arctan2(cos4 * r2[0] - sin4 * r1[0], cos4 * r2[1] - sin4 * r1[1])
        half_turn = np.where(straight, 0.0, np.pi)
        return Raw(
            joints=(
                -y,
                x,
                z,
                np.stack([j4, j4 + half_turn]),
                np.stack([j5, np.where(straight, j5, -j5)]),
                np.stack([j6, j6 + half_turn]),
            ),
            excess_m=np.zeros(len(x)),
            singular=straight,
        )
