"""Six-axis cobot with three parallel axes: axes Z Y Y Y Z Y; the flange looks along its own +Y.

Lengths are named by the joint that the link leads to and the axis along which it is measured: a1y, a1z, a2x, a2y, a3x,
a3y, a4z, a5y. Frigeni, appendix, with (A-35), (A-39), (A-41) and (A-46) corrected: the horizontal part of the arm is
signed, and the elbow's sign is the other one.
"""

from itertools import product
from typing import ClassVar

import numpy as np

from cell.geometry import check_poses
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.chain import Chain, Step
from robot_agent.kinematics.problems import checked_lengths
from robot_agent.kinematics.serial import SerialModel
from robot_agent.kinematics.singularity import SingularityDistance
from robot_agent.kinematics.six_axis_inverse import SINGULAR_RADIUS_M, SINGULAR_SINE
from robot_agent.kinematics.solutions import Raw, Solutions, finished
from robot_agent.kinematics.triangle import beyond, beyond_reach, elbow_triangle
from robot_agent.model.description import RobotDescription

ELBOW_SIGN = np.array([[1.0, -1.0], [-1.0, 1.0]])[:, :, None, None]
"""For LEFT, RIGHT x UP, DOWN; seen from above the shoulder UP is the same elbow for both."""


class Cobot(SerialModel):
    """See the module; branches LEFT/RIGHT (J1) x UP/DOWN (elbow) x POSITIVE/NEGATIVE (sign of J5)."""

    branches: ClassVar[tuple[str, ...]] = tuple(
        map("/".join, product(("LEFT", "RIGHT"), ("UP", "DOWN"), ("POSITIVE", "NEGATIVE")))
    )

    def __init__(self, description: RobotDescription) -> None:
        g = self._lengths = checked_lengths(description, positive=("a2x", "a3x"))
        steps = (
            Step(2),
            Step(1, (0, g["a1y"], g["a1z"])),
            Step(1, (g["a2x"], g["a2y"], 0)),
            Step(1, (g["a3x"], g["a3y"], 0)),
            Step(2, (0, 0, g["a4z"])),
            Step(1, (0, g["a5y"], 0)),
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

    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        poses = check_poses(poses, "poses")
        leading = poses.shape[:-2]
        held = self.held(near, leading)
        # (row, column, pose), so that each element is one contiguous array over all poses.
        rows = np.ascontiguousarray(poses[..., :3, :].reshape(-1, 12).T).reshape(3, 4, -1)
        g = self._lengths
        j1, on_axis, inside_cylinder = self._shoulder(rows, held[0])
        cos1, sin1 = np.cos(j1), np.sin(j1)
        # Rows of the pose in the plane of the arm, `(side, column, pose)`: ahead, aside, and rows[2] up.
        ahead = cos1[:, None] * rows[0] + sin1[:, None] * rows[1]
        aside = cos1[:, None] * rows[1] - sin1[:, None] * rows[0]
        j5, j6, straight = _wrist(aside, held[5])
        (c5, s5), (c6, s6) = (np.cos(j5), np.sin(j5)), (np.cos(j6), np.sin(j6))

        def in_plane(row: Array) -> tuple[Array, Array]:
            """Axes x and z of frame 4 in a row `(side or 1, column, pose)`, each `(side, wrist, pose)`."""
            r = row[:, None]
            return c5 * c6 * r[:, :, 0] - s5 * r[:, :, 1] + c5 * s6 * r[:, :, 2], c6 * r[:, :, 2] - s6 * r[:, :, 0]

        (x4_ahead, z4_ahead), (x4_up, z4_up) = in_plane(ahead), in_plane(rows[2:])
        along = (ahead[:, 3] - g["a5y"] * ahead[:, 1])[:, None] - g["a4z"] * z4_ahead
        up = rows[2, 3] - g["a5y"] * rows[2, 1] - g["a4z"] * z4_up - g["a1z"]
        span = np.hypot(along, up)
        triangle = elbow_triangle(span, g["a2x"], g["a3x"])
        j2 = -np.arctan2(up, along)[:, None] - ELBOW_SIGN * triangle.at_joint[:, None]
        j3 = ELBOW_SIGN * (np.pi - triangle.at_elbow)[:, None]
        j4 = np.arctan2(-x4_up, x4_ahead)[:, None] - j2 - j3
        excess = np.where(inside_cylinder < 0, inside_cylinder, beyond_reach(span, g["a2x"], g["a3x"]))
        slots = (2, 2, 2, rows.shape[2])
        raw = Raw(
            joints=[
                np.broadcast_to(values, slots).reshape(8, -1)
                for values in (j1[:, None, None], j2, j3, j4, j5[:, None], j6[:, None])
            ],
            excess_m=np.broadcast_to(excess[:, None], slots).reshape(8, -1),
            singular=np.broadcast_to((straight | on_axis)[:, None, None], slots).reshape(8, -1),
        )
        return finished(self, raw, held, leading)

    def _shoulder(self, rows: Array, held_j1: Array) -> tuple[Array, Flags, Array]:
        """J1 `(side, pose)`; whether it is free; how far [m] the wrist is inside the cylinder it cannot enter (< 0)."""
        x, y = (rows[i, 3] - self._lengths["a5y"] * rows[i, 1] for i in (0, 1))
        radius = np.hypot(x, y)
        on_axis = (radius < SINGULAR_RADIUS_M) & (abs(self._aside) < SINGULAR_RADIUS_M)
        aside = abs(self._aside)
        opening = np.arctan2(self._aside, np.sqrt(np.maximum((radius - aside) * (radius + aside), 0)))
        direction = np.arctan2(y, x)
        left = np.where(on_axis, held_j1, direction - opening)
        right = np.where(on_axis, held_j1, direction + opening + np.pi)
        return np.stack([left, right]), on_axis, -beyond(aside - radius)


def _wrist(aside: Array, held_j6: Array) -> tuple[Array, Array, Flags]:
    """J5 and J6 `(side, wrist, pose)` from (s5 c6, c5, s5 s6), and whether J6 is free `(side, pose)`."""
    sine = np.hypot(aside[:, 0], aside[:, 2])
    straight = sine < SINGULAR_SINE
    j6 = np.where(straight, held_j6, np.arctan2(aside[:, 2], aside[:, 0]))
    j5 = np.arctan2(np.where(straight, 0.0, sine), aside[:, 1])
    half_turn = np.where(straight, 0.0, np.pi)
    return (
        np.stack([j5, np.where(straight, j5, -j5)], axis=1),
        np.stack([j6, j6 + half_turn], axis=1),
        straight,
    )
