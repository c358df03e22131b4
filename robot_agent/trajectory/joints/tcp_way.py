"""The TCP's way and turn along joints that are given as a curve."""

import numpy as np
from numpy.typing import NDArray

from robot_agent.kinematics import Model
from robot_agent.trajectory.joints.pieces import Pieces

Numbers = NDArray[np.float64]

_PARTS = 32
_SLOW = 1e-3
"""[m] of the TCP's way per unit of the joints' way: below it turns on the spot."""
_STILL = 1e-12


def with_tcp(model: Model, joints: Pieces) -> tuple[Pieces, Numbers]:
    """A curve of the joints in one piece with the TCP's way [m] and turn [rad] as two more columns.

    Also `(k, 2)` parameter and curvature [1/m] of its way, 0 where it has none.
    """
    s = np.linspace(0.0, joints.duration_s, _PARTS + 1)
    q, first, second, _ = joints.shape(s)
    jacobian = model.jacobian(q)
    drift = model.jacobian_derivative(q, first) @ first[..., None]
    twist, growth = (jacobian @ first[..., None])[..., 0], (jacobian @ second[..., None] + drift)[..., 0]
    halves = twist.reshape(-1, 2, 3)
    way = np.linalg.norm(halves, axis=2)
    change = (halves * growth.reshape(-1, 2, 3)).sum(axis=2) / np.maximum(way, _STILL)
    step = float(s[1])
    grown = step * (way[1:] + way[:-1]) / 2.0 + step**2 * (change[:-1] - change[1:]) / 12.0
    covered = np.concatenate([np.zeros((1, 2)), np.cumsum(grown, axis=0)])
    across = np.linalg.norm(np.cross(twist[:, :3], growth[:, :3]), axis=1)
    curvature = np.where(way[:, 0] > _SLOW, across / np.maximum(way[:, 0], _SLOW) ** 3, 0.0)
    states = [np.column_stack(each) for each in ((q, covered), (first, way), (second, change))]
    return Pieces.through(s, *states), np.column_stack([s, curvature])


def without_tcp(joints: Pieces) -> Pieces:
    """The same columns and knots where no limit of the TCP holds: its way and turn stay at 0."""
    s = np.linspace(0.0, joints.duration_s, _PARTS + 1)
    return Pieces.through(s, *(np.column_stack([each, np.zeros((len(s), 2))]) for each in joints.shape(s)[:3]))


def continued(first: Pieces, second: Pieces, joints: int) -> Pieces:
    """Both one after the other; columns after the first `joints` go on from where they are."""
    later = second.coefficients.copy()
    gap = first.position(first.knots[-1:]) - second.position(np.zeros(1))
    later[:, 0, joints:] += gap[:, joints:]
    return Pieces.joined([first, Pieces(second.knots, later)])
