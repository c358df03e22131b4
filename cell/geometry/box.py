"""An oriented box and its exact distance from capsules."""

from dataclasses import dataclass, replace

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.errors import GeometryError, WrongShape
from cell.geometry.pose import check_poses, pose_from
from cell.geometry.segment import least_height

_THINNEST_M = 1e-9
"""Of a box about points in one plane."""


@dataclass(frozen=True, slots=True, eq=False)
class Box:
    """A solid box: full edge lengths along its own axes, and the pose of its centre in world."""

    size: Array
    """`(3,)` [m]."""
    pose_world_box: Array
    """`(4, 4)`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", np.asarray(self.size, dtype=float))
        if self.size.shape != (3,):
            raise WrongShape("box size", self.size.shape, "(3,)")
        if not (np.isfinite(self.size).all() and (self.size > 0).all()):
            raise GeometryError(f"box size: found {self.size.tolist()} m, allowed are three lengths above zero")
        object.__setattr__(self, "pose_world_box", check_poses(self.pose_world_box, "pose of the box"))

    @classmethod
    def at(
        cls,
        size_m: tuple[float, float, float],
        position_m: tuple[float, float, float],
        quaternion_xyzw: tuple[float, float, float, float],
    ) -> "Box":
        """A box from the plain numbers of a zone's settings or message."""
        return cls(np.array(size_m), pose_from(np.array(position_m), np.array(quaternion_xyzw)))

    @classmethod
    def about(cls, points: Array, pose_world_axes: Array) -> "Box":
        """The least box along the axes of a pose `(4, 4)` that holds points `(p, 3)` [m] in these axes."""
        low, high = points.min(axis=0), points.max(axis=0)
        pose = pose_world_axes.copy()
        pose[:3, 3] += pose[:3, :3] @ ((low + high) / 2.0)
        return cls(np.maximum(high - low, _THINNEST_M), pose)

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:  # noqa: ARG002
        """As `Solid`; see `capsule_box_distance`. Below minus the radius: the depth of the axis."""
        points = np.asarray(points, dtype=float)
        distance = np.asarray(capsule_box_distance(points, np.zeros(points.shape[:-2]), self))
        inside = distance == 0.0
        if inside.any():
            local = (points[inside] - self.pose_world_box[:3, 3]) @ self.pose_world_box[:3, :3]
            distance[inside] = np.minimum(
                least_height(np.concatenate([local, -local], axis=-1) - np.tile(self.size / 2.0, 2)), 0.0
            )
        return np.asarray(distance - radii)

    def bounds(self) -> "Box":
        """As `Solid`."""
        return self

    def moved_to(self, pose_world_solid: Array) -> "Box":
        """As `Solid`."""
        return replace(self, pose_world_box=pose_world_solid)


def point_box_distance(points: Array, box: Box) -> Array:
    """Distance `(...)` [m] of points `(..., 3)` in world from the solid box; 0 inside."""
    outside = np.abs((points - box.pose_world_box[:3, 3]) @ box.pose_world_box[:3, :3]) - box.size / 2
    distance: Array = np.linalg.norm(np.maximum(outside, 0), axis=-1)
    return distance


def capsule_box_distance(points: Array, radii: Array, box: Box) -> Array:
    """Distance of capsules from the solid box: `(...)` [m]; a capsule touches the box exactly where it is <= 0.

    `points`: `(..., 2, 3)` end points in world [m]; `radii`: broadcasts with `(...)` [m]. The value is the distance of
    the axis minus the radius. So below zero it is no penetration depth: a capsule whose axis enters the box has minus
    its radius.

    Exact: along the axis, p(t) = a + t d, the squared distance f(t) = sum over k of max(|p_k| - h_k, 0)^2 is convex and
    its derivative is piecewise linear with breaks where p_k = +-h_k. The least t lies between the last break with a
    negative and the first with a positive derivative, on a straight line.
    """
    points = np.asarray(points, dtype=float)
    if points.shape[-2:] != (2, 3):
        raise WrongShape("capsule end points", points.shape, "(..., 2, 3)")
    half = box.size / 2
    ends = (points - box.pose_world_box[:3, 3]) @ box.pose_world_box[:3, :3]
    start, direction = ends[..., 0, :], ends[..., 1, :] - ends[..., 0, :]
    share = _closest_share(start, direction, half)
    outside = np.abs(start + share[..., None] * direction) - half
    distance: Array = np.linalg.norm(np.maximum(outside, 0), axis=-1)
    return distance - radii


def _closest_share(start: Array, direction: Array, half: Array) -> Array:
    """Share of the way from start to end, `(...)` in 0 to 1, where the segment is closest to the box at the origin."""
    moving = np.abs(direction) > np.finfo(float).tiny * 1e8
    divisor = np.where(moving, direction, 1.0)
    breaks = np.empty((*start.shape[:-1], 8))
    breaks[..., 0], breaks[..., 1] = 0.0, 1.0
    np.divide(half - start, divisor, out=breaks[..., 2:5])
    np.divide(-half - start, divisor, out=breaks[..., 5:])
    np.minimum(np.maximum(breaks, 0.0, out=breaks), 1.0, out=breaks)
    breaks[..., 2:] *= np.concatenate([moving, moving], axis=-1)
    at_break = start[..., None, :] + breaks[..., None] * direction[..., None, :]
    at_break -= np.minimum(np.maximum(at_break, -half), half)
    slope = np.einsum("...bk,...k->...b", at_break, direction)
    falls, rises = slope <= 0, slope >= 0
    below, above = np.where(falls, breaks, 0.0).max(axis=-1), np.where(rises, breaks, 1.0).min(axis=-1)
    slope_below = np.where(falls, slope, -np.inf).max(axis=-1)
    slope_above = np.where(rises, slope, np.inf).min(axis=-1)
    return _zero_between(below, above, slope_below, slope_above)


def _zero_between(below: Array, above: Array, slope_below: Array, slope_above: Array) -> Array:
    """Where the straight line between two breaks is zero; the end itself where one side has no break."""
    falling_only, rising_only = ~np.isfinite(slope_above), ~np.isfinite(slope_below)
    low = np.where(rising_only, 0.0, slope_below)
    high = np.where(falling_only, 0.0, slope_above)
    rise = high - low
    share = below + (above - below) * np.where(rise > 0, -low / np.where(rise > 0, rise, 1.0), 0.0)
    return np.where(rising_only, 0.0, np.where(falling_only, 1.0, share))
