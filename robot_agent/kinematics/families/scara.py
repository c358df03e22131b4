"""SCARA: two arms in the plane, a spindle that slides and turns; axes Z Z, slide Z, Z. The base frame is at link 1.

Lengths: a1x and a2x the arms, a1z and a2z their heights, a4z the lift of the spindle per turn of J4 (0: no screw).
Frigeni, appendix, with (A-55) and (A-70) corrected: the lift is a4z per turn.
"""

from collections.abc import Sequence
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT, Length, PositiveLength
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.six_axis_inverse import SINGULAR_RADIUS_M
from robot_agent.kinematics.families.triangle import beyond_reach, elbow_triangle
from robot_agent.kinematics.families.upright import heading, tilt
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.turns import TURN, nearest_turn
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import ClosedFormFile, family

ELBOW_SIGN = np.array([1.0, -1.0])[:, None]


class ScaraGeometry(BaseModel):
    """Lengths of a SCARA; at joints zero both arms along +X. The base frame is at link 1, its column is below."""

    model_config = STRICT
    a1x: PositiveLength = Field(description="arm 1: axis 1 to axis 2, along X")
    a1z: Length = Field(description="base to arm 2, along Z")
    a2x: PositiveLength = Field(description="arm 2: axis 2 to the spindle, along X")
    a2z: Length = Field(description="arm 2 to the end of the spindle at J3 = 0, along Z; usually negative")
    a4z: Length = Field(description="lift of the spindle per turn of J4; 0 without a screw")


@family(
    "scara",
    "A SCARA.",
    ClosedFormFile[ScaraGeometry],
    joints="RRPR",
    links="base 1 2 3 flange",
)
class Scara(ClosedForm, SerialModel):
    """See the module; branches RIGHT (J2 positive) and LEFT."""

    branches: ClassVar[tuple[str, ...]] = ("RIGHT", "LEFT")

    slots: ClassVar[tuple[int, ...]] = (2,)

    def __init__(self, description: RobotDescription) -> None:
        g = self._lengths = checked_lengths(description, positive=("a1x", "a2x"))
        self._lift = g["a4z"] / TURN
        mixing = np.eye(4)
        mixing[2, 3] = self._lift
        steps = (
            Joint(2),
            Joint(2, (g["a1x"], 0, g["a1z"])),
            Joint(2, (g["a2x"], 0, g["a2z"]), linear=True),
            Joint(2),
        )
        super().__init__(description, Chain(steps), mixing)

    def singularity(self, q: Array) -> SingularityDistance:
        return SingularityDistance(("elbow",), np.abs(np.sin(self.check_joints(q)[..., 1:2])))

    def branches_of(self, elements: Array, held: Array) -> Raw:
        g = self._lengths
        x, y, z = elements[:3, 3]
        squared = x * x + y * y
        span = np.sqrt(squared)
        on_axis = span < SINGULAR_RADIUS_M
        triangle = elbow_triangle(squared, g["a1x"], g["a2x"])
        j1 = np.where(on_axis, held[0], np.arctan2(y, x)) - ELBOW_SIGN * np.where(on_axis, 0.0, triangle.at_joint)
        j2 = ELBOW_SIGN * (np.pi - triangle.at_elbow)
        j4, j3 = self._spindle(heading(elements) - j1 - j2, z - g["a1z"] - g["a2z"], held[3])
        return Raw(
            joints=(j1, j2, j3, j4),
            excess_m=beyond_reach(span, g["a1x"], g["a2x"]),
            singular=on_axis,
            tilt_rad=tilt(elements),
        )

    def continuous(self, joints: Array) -> Array:
        """As for every model; a turn of J4 also lifts the spindle, which J3 takes back."""
        unwrapped = super().continuous(joints)
        unwrapped[:, 2] -= self._lift * (unwrapped[:, 3] - joints[:, 3])
        return unwrapped

    def _placed(self, raw: Raw, held: Sequence[Array] | Array, valid: Flags, out: Array) -> Flags:
        """As for every model; J4 stays at the turn with which J3 was worked out."""
        return super()._placed(raw, [*held[:3], raw.joints[3]], valid, out)

    def _spindle(self, turn: Array, height: Array, held_j4: Array) -> tuple[Array, Array]:
        """J4 and J3 for a heading `turn` [rad] and a height [m], `(branch, pose)`.

        The turn of J4 is chosen first, since J3 follows from it: the one nearest to the held value that keeps J3 inside
        its limits too, where there is one.
        """
        (lower3, upper3), (lower4, upper4) = self.limits.position[2:]
        j4, _ = nearest_turn(turn, held_j4, lower4, upper4)
        if self._lift != 0:
            ends = np.stack([(height - upper3) / self._lift, (height - lower3) / self._lift])
            both, fits_both = nearest_turn(
                turn, held_j4, np.maximum(ends.min(axis=0), lower4), np.minimum(ends.max(axis=0), upper4)
            )
            j4 = np.where(fits_both, both, j4)
        return j4, height - self._lift * j4
