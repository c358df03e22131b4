"""Where a robot stands: on the floor, at a wall, or on an external axis that carries it; and its TCP in world."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cell.geometry import check_poses, inverse
from cell.geometry.arrays import Array
from robot_agent.kinematics.errors import BadInput
from robot_agent.kinematics.model import Model


class Carrier(Protocol):
    """What a robot's base is mounted on."""

    def base_of(self, external: Array) -> Array:
        """Position of the external axis `(...)` [rad or m] -> pose of the robot's base in world `(..., 4, 4)`."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Fixed:
    """A zero frame that does not move; the external axis does not matter."""

    pose_world_base: Array

    def base_of(self, external: Array) -> Array:
        at = _checked(external)
        return np.array(np.broadcast_to(self.pose_world_base, (*at.shape, 4, 4)))


@dataclass(frozen=True, slots=True, eq=False)
class LinearTrack:
    """A track that carries the robot along the X axis of its own frame."""

    pose_world_track: Array
    """`(4, 4)`"""
    pose_carriage_base: Array
    """`(4, 4)`: pose of the robot's base on the carriage; the carriage is at the track's frame when its axis is 0."""

    def base_of(self, external: Array) -> Array:
        at = _checked(external)
        poses = np.array(np.broadcast_to(self.pose_world_track @ self.pose_carriage_base, (*at.shape, 4, 4)))
        poses[..., :3, 3] += at[..., None] * self.pose_world_track[:3, 0]
        return poses


@dataclass(frozen=True, slots=True, eq=False)
class Turntable:
    """A table that turns the robot about the Z axis of its own frame."""

    pose_world_table: Array
    """`(4, 4)`"""
    pose_plate_base: Array
    """`(4, 4)`: pose of the robot's base on the plate, which is at the table's frame when its axis is 0."""

    def base_of(self, external: Array) -> Array:
        at = _checked(external)
        turn = np.zeros((*at.shape, 4, 4))
        turn[..., 0, 0] = turn[..., 1, 1] = np.cos(at)
        turn[..., 1, 0] = np.sin(at)
        turn[..., 0, 1] = -turn[..., 1, 0]
        turn[..., 2, 2] = turn[..., 3, 3] = 1
        return np.asarray(self.pose_world_table @ turn @ self.pose_plate_base)


def tcp_in_world(model: Model, carrier: Carrier, q: Array, external: Array) -> Array:
    """Joints `(..., n)` and external axis `(...)` -> pose of the mounted tool's TCP in world `(..., 4, 4)`."""
    return np.asarray(carrier.base_of(external) @ model.forward(q))


def tcp_in_base(carrier: Carrier, pose_world_tcp: Array, external: Array) -> Array:
    """TCP poses in world `(..., 4, 4)` and external axis `(...)` -> in base, for `Model.inverse` and `solve`.

    Raises:
        cell.geometry.GeometryError: the poses are none.
        BadInput: the external axis is not finite.
    """
    poses = check_poses(pose_world_tcp, "TCP poses")
    return np.asarray(inverse(carrier.base_of(external)) @ poses)


def _checked(external: Array) -> Array:
    at = np.asarray(external, dtype=float)
    if not np.isfinite(at).all():
        raise BadInput("external axis", "a value that is not finite", "finite values")
    return at
