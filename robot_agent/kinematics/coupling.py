"""Joints and axes: what the motors turn, and what the links do, where gears couple one to the other."""

from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array


@dataclass(frozen=True, slots=True, eq=False)
class Coupling:
    """joints = C axes, with C `(n, n)` lower triangular.

    An off-diagonal entry says how far a joint turns per unit of another axis although its own motor stands. The source
    is always the axis, never the joint: with J4 -> J5 and J5 -> J6 given, axis 4 moves J6 only if J4 -> J6 says so.
    Frigeni, equations 3-16 and 4-34, generalised.
    """

    joints_per_axis: Array
    axes_per_joint: Array

    @classmethod
    def of(cls, matrix: Array | None, count: int) -> "Coupling":
        """From C; None means that each joint is its own axis."""
        forward = np.eye(count) if matrix is None else np.asarray(matrix, dtype=float)
        return cls(forward, np.linalg.inv(forward))

    def joints(self, axes: Array) -> Array:
        """Axes `(..., n)` -> joints `(..., n)`; positions, speeds or accelerations."""
        return np.asarray(axes @ self.joints_per_axis.T)

    def axes(self, joints: Array) -> Array:
        """Joints `(..., n)` -> axes `(..., n)`; positions, speeds or accelerations."""
        return np.asarray(joints @ self.axes_per_joint.T)

    def axis_torques(self, joint_torques: Array) -> Array:
        """Torques or forces at the joints `(..., n)` -> at the axes: the transpose, since both do the same work."""
        return np.asarray(joint_torques @ self.joints_per_axis)

    def joint_torques(self, axis_torques: Array) -> Array:
        """Torques or forces at the axes `(..., n)` -> at the joints."""
        return np.asarray(axis_torques @ self.axes_per_joint)
