"""Where the flange of the example arm is, by its six turns one after another: an oracle for paths that are played."""

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_CHAIN: tuple[tuple[tuple[float, float, float], int], ...] = (
    ((0.0, 0.0, 0.65), 2),
    ((0.4, 0.0, 0.68), 1),
    ((0.0, 0.0, 1.1), 1),
    ((0.766, 0.0, 0.23), 0),
    ((0.345, 0.0, 0.0), 1),
    ((0.244, 0.0, 0.0), 0),
)
"""Of `cell_configs/models/six_axis.yaml` and the arm of `pick_and_place`: the way [m] from the joint before, and the
axis that a joint turns about."""


def turned(axis: int, angles: Numbers) -> Numbers:
    """Rotations `(..., 3, 3)` about x, y or z (0 to 2) by angles `(...)` [rad]."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    made = np.zeros((*np.shape(angles), 3, 3))
    made[..., axis, axis] = 1.0
    made[..., first, first] = made[..., second, second] = np.cos(angles)
    made[..., second, first] = np.sin(angles)
    made[..., first, second] = -np.sin(angles)
    return made


def flange(q: Numbers) -> tuple[Numbers, Numbers]:
    """Places `(n, 3)` [m] and rotations `(n, 3, 3)` in the robot's base, of joints `(n, 6)` [rad]."""
    place, rotation = np.zeros((len(q), 3)), np.broadcast_to(np.eye(3), (len(q), 3, 3))
    for joint, (way, axis) in enumerate(_CHAIN):
        place = place + rotation @ np.array(way)
        rotation = rotation @ turned(axis, q[:, joint])
    return place, rotation


def tcp(q: Numbers, ahead_m: float = 0.0) -> Numbers:
    """Places `(n, 3)` [m] of a TCP that is so far in front of the flange, along its x axis."""
    place, rotation = flange(q)
    return place + ahead_m * rotation[..., 0]
