"""Solids that a capsule keeps away from: what they have in common, and the round and the endless ones."""

from dataclasses import dataclass, replace
from typing import Protocol, Self

import numpy as np

from cell.geometry.arrays import Array
from cell.geometry.box import Box
from cell.geometry.errors import GeometryError, WrongShape
from cell.geometry.pose import check_poses

_STEPS = 60
"""To the place on an axis that is nearest to a cylinder: some ten do, and halves alone would."""
_STEP_M = 1e-13
"""A shorter one is the last."""


class Solid(Protocol):
    """A closed body in world."""

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:
        """Distance `(...)` [m] of capsules, end points `(..., 2, 3)` in world; at most 0 exactly where they touch.

        Below zero it is less the deeper the capsule is, but for meshes that do not close. What is farther than `within`
        [m] may be told as that; it is below zero where only what is deeper counts, and broadcasts with `(...)`.
        """
        ...

    def bounds(self) -> Box | None:
        """A box that holds the solid, not always the least one; None where none does."""
        ...


class PlacedSolid(Solid, Protocol):
    """A solid that has a pose."""

    def moved_to(self, pose_world_solid: Array) -> Self:
        """The same at another pose `(4, 4)` in world."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Sphere:
    """A ball: `centre` `(3,)` in world and its radius [m]."""

    centre: Array
    radius: float

    def __post_init__(self) -> None:
        _check_length("sphere", "radius", self.radius)

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:  # noqa: ARG002
        """As `Solid`; exact, and below zero the depth along the line to the centre."""
        start, way = _axes(points)
        square = np.einsum("...k,...k", way, way)
        along = np.einsum("...k,...k", self.centre - start, way)
        share = np.clip(along / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
        away = start + share[..., None] * way - self.centre
        return np.asarray(np.linalg.norm(away, axis=-1) - radii - self.radius)

    def bounds(self) -> Box:
        """As `Solid`."""
        pose = np.eye(4)
        pose[:3, 3] = self.centre
        return Box(np.full(3, 2.0 * self.radius), pose)

    def moved_to(self, pose_world_solid: Array) -> Self:
        """As `Solid`."""
        return replace(self, centre=pose_world_solid[:3, 3])


@dataclass(frozen=True, slots=True, eq=False)
class Cylinder:
    """A round column about Z of its pose, which is at half its length [m]."""

    radius: float
    length: float
    pose_world_cylinder: Array
    """`(4, 4)`."""

    def __post_init__(self) -> None:
        _check_length("cylinder", "radius", self.radius)
        _check_length("cylinder", "length", self.length)
        object.__setattr__(self, "pose_world_cylinder", check_poses(self.pose_world_cylinder, "pose of the cylinder"))

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:
        """As `Solid`. Below minus the radius: the depth of the axis."""
        start, way = _axes((np.asarray(points) - self._centre) @ self.pose_world_cylinder[:3, :3])
        distance = self._least_height(start, way)
        near = (distance > 0.0) & (distance < radii + within)
        if near.any():
            distance[near] = self._from_axes(start[near], way[near])
        return np.asarray(distance - radii)

    def _from_axes(self, start: Array, way: Array) -> Array:
        """Distance of axes outside: it is convex along them, so its least place is where its slope changes its sign.

        That is looked for by Newton's steps, and by halves where these lead out of the part in which it is.
        """
        low, high = np.zeros(len(start)), np.ones(len(start))
        high[self._slope(start, way)[0] >= 0.0], low[self._slope(start + way, way)[0] <= 0.0] = 0.0, 1.0
        share, length = (low + high) / 2.0, np.sqrt(np.einsum("mk,mk->m", way, way))
        for _ in range(_STEPS):
            slope, bend = self._slope(start + share[:, None] * way, way)
            low, high = np.where(slope > 0.0, low, share), np.where(slope < 0.0, high, share)
            before, share = share, share - slope / np.where(bend > 0.0, bend, np.inf)
            short = np.abs(share - before) * length <= _STEP_M
            share = np.where(short | ((share > low) & (share < high)), share, (low + high) / 2.0)
            if (short | ((high - low) * length <= _STEP_M)).all():
                break
        return np.asarray(np.minimum(*(self._distance(start + each[:, None] * way) for each in (before, share))))

    def _least_height(self, start: Array, way: Array) -> Array:
        """The least `_height` along axes: at an end, where one of both heights is least, or where both are equal.

        They are where x^2 + y^2 = (radius - length / 2 + |z|)^2, for each sense of z a square equation.
        """
        flat, along = start[..., :2], way[..., :2]
        square, mixed, whole = (np.einsum("...k,...k", a, b) for a, b in ((along, along), (along, flat), (flat, flat)))
        shares = [np.zeros(square.shape), np.ones(square.shape)]
        rise = way[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            shares += [-mixed / square, -start[..., 2] / rise]
            for sense in (-1.0, 1.0):
                level = self.radius - self.length / 2.0 + sense * start[..., 2]
                a, b, c = square - rise**2, mixed - sense * rise * level, whole - level**2
                root = -b - np.copysign(np.sqrt(np.maximum(b * b - a * c, 0.0)), b)
                shares += [root / a, c / root]
        share = np.clip(np.nan_to_num(np.stack(shares, axis=-1)), 0.0, 1.0)
        return np.asarray(self._height(start[..., None, :] + share[..., None] * way[..., None, :]).min(axis=-1))

    def bounds(self) -> Box:
        """As `Solid`."""
        return Box(np.array([2.0 * self.radius, 2.0 * self.radius, self.length]), self.pose_world_cylinder)

    def moved_to(self, pose_world_solid: Array) -> Self:
        """As `Solid`."""
        return replace(self, pose_world_cylinder=pose_world_solid)

    @property
    def _centre(self) -> Array:
        return self.pose_world_cylinder[:3, 3]

    def _outside(self, points: Array) -> tuple[Array, Array, Array]:
        """How far beside the round wall and beyond the ends; and the distance from Z."""
        from_axis = np.hypot(points[..., 0], points[..., 1])
        beside = np.maximum(from_axis - self.radius, 0.0)
        beyond = np.maximum(np.abs(points[..., 2]) - self.length / 2.0, 0.0)
        return beside, beyond, from_axis

    def _distance(self, points: Array) -> Array:
        beside, beyond, _ = self._outside(points)
        return np.asarray(np.hypot(beside, beyond))

    def _height(self, points: Array) -> Array:
        """How far beyond the wall or an end, the farther of both; inside minus the depth."""
        return np.asarray(
            np.maximum(
                np.hypot(points[..., 0], points[..., 1]) - self.radius, np.abs(points[..., 2]) - self.length / 2.0
            )
        )

    def _slope(self, points: Array, way: Array) -> tuple[Array, Array]:
        """Half the derivative of the squared distance along `way`, which never falls, and the derivative of that."""
        beside, beyond, from_axis = self._outside(points)
        outwards = np.einsum("...k,...k", points[..., :2], way[..., :2]) / np.where(from_axis > 0.0, from_axis, 1.0)
        square, rise = np.einsum("...k,...k", way[..., :2], way[..., :2]), way[..., 2]
        slope = beside * outwards + beyond * np.sign(points[..., 2]) * rise
        around = square - (self.radius / np.where(beside > 0.0, from_axis, 1.0)) * (square - outwards**2)
        return slope, np.where(beside > 0.0, around, 0.0) + np.where(beyond > 0.0, rise**2, 0.0)


@dataclass(frozen=True, slots=True, eq=False)
class HalfSpace:
    """All below the plane Z = 0 of a pose: a floor, or a wall; its Z points to the free side."""

    pose_world_plane: Array
    """`(4, 4)`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose_world_plane", check_poses(self.pose_world_plane, "pose of the half space"))

    def capsule_distance(self, points: Array, radii: Array, within: Array | float = np.inf) -> Array:  # noqa: ARG002
        """As `Solid`; exact, and below zero the depth."""
        _axes(points)
        above = (np.asarray(points) - self.pose_world_plane[:3, 3]) @ self.pose_world_plane[:3, 2]
        return np.asarray(above.min(axis=-1) - radii)

    def bounds(self) -> None:
        """As `Solid`."""

    def moved_to(self, pose_world_solid: Array) -> Self:
        """As `Solid`."""
        return replace(self, pose_world_plane=pose_world_solid)


def _axes(points: Array) -> tuple[Array, Array]:
    """Start of each capsule's axis and the way to its end."""
    points = np.asarray(points, dtype=float)
    if points.shape[-2:] != (2, 3):
        raise WrongShape("capsule end points", points.shape, "(..., 2, 3)")
    return points[..., 0, :], points[..., 1, :] - points[..., 0, :]


def _check_length(what: str, which: str, length: float) -> None:
    if not 0.0 < length < np.inf:
        raise GeometryError(f"{which} of a {what}: found {length:g} m, allowed is a length above zero")
