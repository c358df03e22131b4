"""Six-axis cobot with three parallel axes: axes Z Y Y Y Z Y; the flange looks along its own +Y.

Lengths are named by the joint that carries the link and the axis along which it is measured: a1y, a1z, a2x, a2y, a3x,
a3y, a4z, a5y. Frigeni, appendix, with (A-35), (A-39), (A-41) and (A-46) corrected: the horizontal part of the arm is
signed, and the elbow's sign is the other one.
"""

from dataclasses import dataclass
from itertools import product
from typing import ClassVar

import numpy as np
from pydantic import BaseModel, Field

from cell.config.units import STRICT, Length, PositiveLength
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.chain import Chain, Joint
from robot_agent.kinematics.families.closed_form import ClosedForm, Raw
from robot_agent.kinematics.families.six_axis_inverse import SIDE, SINGULAR_RADIUS_M, SINGULAR_SINE
from robot_agent.kinematics.families.triangle import beyond, beyond_reach, elbow_triangle
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.model.description import RobotDescription
from robot_agent.model.families import ClosedFormFile, family

ELBOW_SIGN = np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None, None]
"""For LEFT, RIGHT x UP, DOWN; seen from above the shoulder UP is the same elbow for both."""

HALF_TURN = np.array([[0.0], [np.pi]])
"""Of J6, for the POSITIVE and the NEGATIVE wrist."""


class CobotGeometry(BaseModel):
    """Lengths of a cobot with three parallel axes; at joints zero the arm along +X, the flange looks along +Y."""

    model_config = STRICT
    a1y: Length = Field(description="axis 1 to axis 2, along Y")
    a1z: Length = Field(description="base to axis 2, along Z")
    a2x: PositiveLength = Field(description="upper arm: axis 2 to axis 3, along X")
    a2y: Length = Field(description="axis 2 to axis 3, along Y; usually negative")
    a3x: PositiveLength = Field(description="forearm: axis 3 to axis 4, along X")
    a3y: Length = Field(description="axis 3 to axis 4, along Y")
    a4z: Length = Field(description="axis 4 to axis 6, along Z; usually negative")
    a5y: Length = Field(description="axis 5 to the flange, along Y")


@family(
    "cobot",
    "A six-axis cobot with three parallel axes.",
    ClosedFormFile[CobotGeometry],
    joints="RRRRRR",
    links="base 1 2 3 4 5 flange",
)
class Cobot(ClosedForm, SerialModel):
    """See the module; branches LEFT/RIGHT (J1) x UP/DOWN (elbow) x POSITIVE/NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = tuple(
        map("/".join, product(("LEFT", "RIGHT"), ("UP", "DOWN"), ("POSITIVE", "NEGATIVE")))
    )

    slots: ClassVar[tuple[int, ...]] = (2, 2, 2)

    def __init__(self, description: RobotDescription) -> None:
        g = self._lengths = checked_lengths(description, positive=("a2x", "a3x"))
        steps = (
            Joint(2),
            Joint(1, (0, g["a1y"], g["a1z"])),
            Joint(1, (g["a2x"], g["a2y"], 0)),
            Joint(1, (g["a3x"], g["a3y"], 0)),
            Joint(2, (0, 0, g["a4z"])),
            Joint(1, (0, g["a5y"], 0)),
        )
        self._aside = g["a1y"] + g["a2y"] + g["a3y"]
        super().__init__(description, Chain(steps))

    def singularity(self, q: Array) -> SingularityDistance:
        q, g = self.check_joints(q), self._lengths
        j2, j23 = q[..., 1], q[..., 1] + q[..., 2]
        along = g["a2x"] * np.cos(j2) + g["a3x"] * np.cos(j23) + g["a4z"] * np.sin(j23 + q[..., 3])
        measures = (
            np.abs(along) / (g["a2x"] + g["a3x"] + abs(g["a4z"])),
            np.abs(np.sin(q[..., 2])),
            np.abs(np.sin(q[..., 4])),
        )
        return SingularityDistance(("shoulder", "elbow", "wrist"), np.stack(measures, axis=-1))

    def branches_of(self, elements: Array, held: Array) -> Raw:
        g = self._lengths
        j1, cos1, sin1, on_axis, inside_cylinder = self._shoulder(elements, held[0])
        # Rows of the pose in the plane of the arm, `(column, side, pose)`: ahead and aside; up is the same for both.
        x, y, up = elements[0, :, None], elements[1, :, None], elements[2]
        ahead, aside = cos1 * x + sin1 * y, cos1 * y - sin1 * x
        wrist = _wrist(aside, held[5])
        x4_ahead, z4_ahead = wrist.frame_4(ahead)
        x4_up, z4_up = wrist.frame_4(up)
        along = (ahead[3] - g["a5y"] * ahead[1])[:, None] - g["a4z"] * z4_ahead
        height = up[3] - g["a5y"] * up[1] - g["a1z"] - g["a4z"] * z4_up
        squared = along * along + height * height
        missing = beyond_reach(np.sqrt(squared), g["a2x"], g["a3x"])
        turn = wrist.turn_within_rounding(missing * np.sqrt(squared), g["a4z"] * (along * x4_ahead + height * x4_up))
        if turn.any():
            x4_ahead, z4_ahead = x4_ahead - turn * z4_ahead, z4_ahead + turn * x4_ahead
            x4_up, z4_up = x4_up - turn * z4_up, z4_up + turn * x4_up
            along = (ahead[3] - g["a5y"] * ahead[1])[:, None] - g["a4z"] * z4_ahead
            height = up[3] - g["a5y"] * up[1] - g["a1z"] - g["a4z"] * z4_up
            squared = along * along + height * height
        triangle = elbow_triangle(squared, g["a2x"], g["a3x"])
        j2 = -np.arctan2(height, along)[:, None] - ELBOW_SIGN * triangle.at_joint[:, None]
        j3 = ELBOW_SIGN * (np.pi - triangle.at_elbow)[:, None]
        j4 = np.arctan2(-x4_up, x4_ahead)[:, None] - j2 - j3
        excess = np.where(inside_cylinder < 0, inside_cylinder, beyond_reach(np.sqrt(squared), g["a2x"], g["a3x"]))
        return Raw(
            joints=(j1[:, None, None], j2, j3, j4, wrist.j5[:, None], wrist.turned_j6(turn)[:, None]),
            excess_m=excess[:, None],
            singular=(wrist.straight | on_axis)[:, None, None],
        )

    def _shoulder(self, elements: Array, held_j1: Array) -> tuple[Array, Array, Array, Flags, Array]:
        """J1, its cosine and sine `(side, pose)`; whether it is free; how far [m] the wrist is inside the cylinder that
        it cannot enter (< 0)."""
        x, y = elements[:2, 3] - self._lengths["a5y"] * elements[:2, 1]
        radius, aside = np.sqrt(x * x + y * y), self._aside
        # The wrist is `ahead` in the plane of the arm and `aside` of it: J1 turns that onto (x, y).
        ahead = SIDE * np.sqrt(np.maximum((radius - abs(aside)) * (radius + abs(aside)), 0))
        cos1, sin1 = ahead * x + aside * y, ahead * y - aside * x
        j1, length = np.arctan2(sin1, cos1), np.sqrt(cos1 * cos1 + sin1 * sin1)
        length += length == 0
        cos1, sin1 = cos1 / length, sin1 / length
        on_axis = (radius < SINGULAR_RADIUS_M) & (abs(aside) < SINGULAR_RADIUS_M)
        if on_axis.any():
            j1 = np.where(on_axis, held_j1, j1)
            cos1, sin1 = np.where(on_axis, np.cos(j1), cos1), np.where(on_axis, np.sin(j1), sin1)
        return j1, cos1, sin1, on_axis, -beyond(abs(aside) - radius)


_ROUNDING = 4e-15
"""Of what a pose says about J6, times the sine of J5."""
_STRAIGHT = 4e-10
"""A lower sine counts as this one: frame 4 is turned by small angles only."""


@dataclass(frozen=True, slots=True, eq=False)
class Wrist:
    """Joints 5 and 6; both wrists have one J5 and J6 where J6 is free."""

    j5: Array
    """`(side, wrist, pose)`, POSITIVE and NEGATIVE."""
    j6: Array
    straight: Flags
    """`(side, pose)`: J6 is free and holds its value."""
    positive: tuple[Array, Array, Array, Array]
    """Cosine and sine of J5 and of J6 `(side, pose)`, POSITIVE."""
    sign: Array
    """`(wrist, 1)` or `(side, wrist, pose)`: what turns the axes of frame 4 over for the NEGATIVE wrist."""

    def frame_4(self, row: Array) -> tuple[Array, Array]:
        """X and Z axis of frame 4 `(side, wrist, pose)` in a row of the pose `(column, side or none, pose)`."""
        cos5, sin5, cos6, sin6 = self.positive
        x = cos5 * (cos6 * row[0] + sin6 * row[2]) - sin5 * row[1]
        z = cos6 * row[2] - sin6 * row[0]
        return self.sign * x[:, None], self.sign * z[:, None]

    def turn_within_rounding(self, missing: Array, gained: Array) -> Array:
        """By which angle `(side, wrist, pose)` frame 4 has to turn for the elbow to reach, where J6 leaves that open.

        The reach misses `missing` and gains `gained` by the angle. The nearer J5 is to 0, the less the pose says about
        J6: what an arm that is stretched misses by the rounding of J6 is none. 0 where that is not so.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            turn = np.where(missing == 0.0, 0.0, missing / gained)
        return np.where(np.abs(turn) * np.maximum(self.positive[1], _STRAIGHT)[:, None] < _ROUNDING, turn, 0.0)

    def turned_j6(self, turn: Array) -> Array:
        """J6 with frame 4 turned by small angles `(side, wrist, pose)` where J5 is as good as 0 or a half turn."""
        return np.asarray(self.j6 - self.positive[0][:, None] * turn)


def _wrist(aside: Array, held_j6: Array) -> Wrist:
    """From the row aside of the arm's plane, (sin J5 cos J6, cos J5, sin J5 sin J6) `(column, side, pose)`."""
    sin5, cos5 = np.sqrt(aside[0] * aside[0] + aside[2] * aside[2]), aside[1]
    straight = sin5 < SINGULAR_SINE
    divisor = sin5 + straight
    cos6, sin6, j6 = aside[0] / divisor, aside[2] / divisor, np.arctan2(aside[2], aside[0])
    sign, half_turn = SIDE, HALF_TURN
    if straight.any():
        j6, sin5 = np.where(straight, held_j6, j6), np.where(straight, 0.0, sin5)
        cos6, sin6 = np.where(straight, np.cos(j6), cos6), np.where(straight, np.sin(j6), sin6)
        one = straight[:, None]
        sign, half_turn = np.where(one, 1.0, SIDE), np.where(one, 0.0, HALF_TURN)
    j5 = sign * np.arctan2(sin5, cos5)[:, None]
    return Wrist(j5, j6[:, None] + half_turn, straight, (cos5, sin5, cos6, sin6), sign)
