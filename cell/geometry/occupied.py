"""Whether the space that a robot may occupy touches a solid: the one rule that manager and agents share."""

from enum import Enum
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from cell.geometry.arrays import Array, Flags
from cell.geometry.box import Box, capsule_box_distance
from cell.geometry.solid import Solid

_ROUNDING = 1e-9
"""What only rounding decides is looked at exactly."""


class SpaceOf(Enum):
    """What of a robot a space or a zone is about."""

    BODY = "body"
    TCP = "tcp"


class OccupiedSpace(Protocol):
    """What the rule needs to know of a robot's published body (`cell.messages.Body`)."""

    @property
    def known(self) -> bool: ...
    @property
    def base(self) -> tuple[float, float, float]: ...
    @property
    def reach_m(self) -> float: ...
    @property
    def radii_m(self) -> NDArray[np.float32]: ...
    @property
    def poses(self) -> NDArray[np.float32]: ...
    @property
    def growth_m(self) -> NDArray[np.float32]: ...
    @property
    def tcp_m(self) -> NDArray[np.float32]: ...


def body_touches(body: OccupiedSpace, solid: Solid, of: SpaceOf = SpaceOf.BODY) -> bool:
    """True when any capsule of any pose, grown by that pose's growth, touches the solid; or, of the TCP, any ball.

    A ball is the TCP of a pose with that pose's growth. A body that is not known, has no poses, or does not say where
    its TCP is, counts as its whole reach: a sphere around its base.
    """
    told = body.poses if of is SpaceOf.BODY else body.tcp_m
    if not body.known or len(told) == 0:
        return bool(capsules_touch(np.array([body.base, body.base]), np.array(body.reach_m), solid))
    grown = body.growth_m[:, None].astype(float)
    if of is SpaceOf.TCP:
        return _any_capsule_touches(np.repeat(told[:, None, None].astype(float), 2, axis=2), grown, solid)
    grown = body.radii_m + grown
    return _any_capsule_touches(body.poses.astype(float), grown, solid)


def capsules_touch(points: Array, radii: Array, solid: Solid) -> Flags:
    """Whether each capsule touches the solid: `(...)`; end points `(..., 2, 3)` in world, radii broadcast with `(...)`.

    It does exactly where its distance is at most 0. That is worked out only where its bounding sphere comes near the
    box around the solid.
    """
    points = np.asarray(points, dtype=float)
    radii = np.broadcast_to(radii, points.shape[:-2])
    touches = np.asarray(_gaps(points, radii, solid) <= 0.0)
    if touches.any():
        touches[touches] = _touch(points[touches], radii[touches], solid)
    return touches


def _any_capsule_touches(points: Array, radii: Array, solid: Solid) -> bool:
    """Whether one of many capsules touches the solid.

    Most are decided by their ends: one whose end is in the solid touches it, and one touches nothing whose bounding box
    along the axes of the box around the solid is away from that by more than its radius. The others are worked out.
    """
    box = solid.bounds()
    if box is None:
        return bool(_touch(points, radii, solid).any())
    half = box.size / 2.0
    ends = (points - box.pose_world_box[:3, 3]) @ box.pose_world_box[:3, :3]
    if box is solid:
        outside = np.maximum(np.abs(ends) - half, 0.0)
        away = np.einsum("...k,...k", outside, outside)
        if (np.minimum(away[..., 0], away[..., 1]) < (radii * (1.0 - _ROUNDING)) ** 2).any():
            return True
    start, end = ends[..., 0, :], ends[..., 1, :]
    apart = np.maximum(np.maximum(np.minimum(start, end), -np.maximum(start, end)) - half, 0.0)
    gaps = np.einsum("...k,...k", apart, apart) - (radii * (1.0 + _ROUNDING)) ** 2
    near = gaps <= 0.0
    if not near.any():
        return False
    nearest = np.unravel_index(int(gaps.argmin()), gaps.shape)
    return bool(_touch(points[nearest], radii[nearest], solid).any() or _touch(points[near], radii[near], solid).any())


def _touch(points: Array, radii: Array, solid: Solid) -> Flags:
    """By the exact distance; a box is not asked for the depth of what is inside, which takes it ten times as long."""
    if isinstance(solid, Box):
        return np.asarray(capsule_box_distance(points, radii, solid) <= 0.0)
    return np.asarray(solid.capsule_distance(points, radii) <= 0.0)


def _gaps(points: Array, radii: Array, solid: Solid) -> Array:
    """Distance `(...)` [m] of each capsule's bounding sphere from the box around the solid, or somewhat less."""
    start, end = points[..., 0, :], points[..., 1, :]
    way = end - start
    bound = np.sqrt(np.einsum("...k,...k", way, way)) / 2.0 + radii
    box = solid.bounds()
    if box is None:
        return np.asarray(-bound)
    outside = np.abs(((start + end) / 2.0 - box.pose_world_box[:3, 3]) @ box.pose_world_box[:3, :3]) - box.size / 2.0
    np.maximum(outside, 0.0, out=outside)
    return np.asarray(np.sqrt(np.einsum("...k,...k", outside, outside)) - bound * (1.0 + _ROUNDING))
