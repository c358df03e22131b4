"""Motions along the short lines of a CAM program, where the robot can reach them."""

import numpy as np
from scipy.spatial.transform import Rotation

from robot_agent.paths import Line, Sequence
from robot_agent.trajectory import Motion, plan
from tests.unit.random_moves import LIMITS, MODEL, START
from tests.unit.robot_agent.paths.cam_lines import CamLines

HERE = MODEL.forward(START)


def at_the_robot(lines: CamLines) -> CamLines:
    turned = lines.rotations * lines.rotations[0].inv() * Rotation.from_matrix(HERE[:3, :3])
    return CamLines(HERE[:3, 3] + lines.places - lines.places[0], turned)


def motion_of(lines: list[Line], start: np.ndarray = START) -> Motion:
    return plan(MODEL, Sequence(lines), LIMITS, start=start)
