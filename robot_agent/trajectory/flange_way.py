"""What the flange does along joints that are given as a curve."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.trajectory.pieces import Pieces

Numbers = NDArray[np.float64]

_PARTS = 32
_SLOW = 1e-3
"""[m] of the flange's way per unit of the joints' way: below it turns on the spot."""


def with_flange(model: Model, joints: Pieces) -> tuple[Pieces, Numbers]:
    """A curve of the joints in one piece with the flange's way [m] and turn [rad] as two more columns.

    Also `(k, 2)` parameter and curvature [1/m] of the flange's way, 0 where it has none.
    """
    s = np.linspace(0.0, joints.duration_s, _PARTS + 1)
    q, first, second, _ = joints.shape(s)
    twist = (model.jacobian(q) @ first[..., None])[..., 0]
    step = float(s[1])
    bent = np.gradient(twist, step, axis=0, edge_order=2)
    way = np.stack([np.linalg.norm(twist[:, :3], axis=1), np.linalg.norm(twist[:, 3:], axis=1)], axis=1)
    change = np.gradient(way, step, axis=0, edge_order=2)
    grown = step * (way[1:] + way[:-1]) / 2.0 + step**2 * (change[:-1] - change[1:]) / 12.0
    covered = np.concatenate([np.zeros((1, 2)), np.cumsum(grown, axis=0)])
    across = np.linalg.norm(np.cross(twist[:, :3], bent[:, :3]), axis=1)
    curvature = np.where(way[:, 0] > _SLOW, across / np.maximum(way[:, 0], _SLOW) ** 3, 0.0)
    states = [np.column_stack(each) for each in ((q, covered), (first, way), (second, change))]
    return Pieces.through(s, *states), np.column_stack([s, curvature])
