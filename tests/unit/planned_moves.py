"""Moves of the six-axis arm, planned from where it works."""

import numpy as np

from cell.geometry import from_xyz_abc
from robot_agent.paths import Move, Sequence
from robot_agent.trajectory import Motion, plan
from tests.unit.random_moves import LIMITS, MODEL, START

HERE = MODEL.forward(START)


def at(x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 0.0, turn_deg: float = 0.0) -> np.ndarray:
    """A pose beside the start, turned about the vertical."""
    pose = HERE.copy()
    pose[:3, :3] = from_xyz_abc(np.array([0, 0, 0, 0, 0, np.radians(turn_deg)]))[:3, :3] @ HERE[:3, :3]
    pose[:3, 3] += np.array([x_mm, y_mm, z_mm]) / 1000.0
    return pose


def planned(*moves: Move) -> Motion:
    return plan(MODEL, Sequence(moves), LIMITS, start=START)


def beside(joints: np.ndarray, x_mm: float, y_mm: float, z_mm: float, turn_deg: float = 0.0) -> np.ndarray:
    """A pose beside that of joints, turned about the vertical."""
    pose, moved = MODEL.forward(joints), at(x_mm, y_mm, z_mm, turn_deg)
    pose[:3, :3] = moved[:3, :3] @ HERE[:3, :3].T @ pose[:3, :3]
    pose[:3, 3] += moved[:3, 3] - HERE[:3, 3]
    return pose
