"""A few grown capsules around a moving body: what is far from them need not be looked at more closely."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from cell.geometry import Box
from cell.geometry.arrays import Array, Flags
from robot_agent.workspace.swept_body import Sweep

STRETCH = 16
"""Steps of a motion that are looked at as one, before what is near is looked at more closely."""
_OF_A_BLOCK = 3
"""Stretches of a block. With one, what a fast link sweeps is so wide that much seems near; each one more costs more."""
_ROW = 8
"""Stretches that are looked at closely together: who touches something in one need not look at all that follow."""
_ROUNDING_M = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class Cover:
    """For each stretch of a swept body one pose of each capsule, so grown that it holds that all along, between too."""

    edges: NDArray[np.intp]
    """`(b + 1,)` Stretch `i` goes from sample `edges[i]` to sample `edges[i + 1]`."""
    points: Array
    """`(b, c, 2, 3)` end points [m]."""
    radii: Array
    """`(b, c)` [m]."""
    centres: Array
    """`(b, c, 3)` [m] of balls around them."""
    balls: Array
    """`(b, c)` [m] radii of these."""

    @classmethod
    def of(cls, path: Sweep, stretch: int) -> Self:
        """Stretches of so many steps each; the last one is shorter. A path of one sample is one stretch."""
        last = len(path.points) - 1
        firsts = np.arange(0, max(last, 1), stretch)
        edges = np.concatenate([firsts, [last]])
        ends = path.points[edges[1:]]
        low, high = (side(side.reduceat(path.points, firsts), ends) for side in (np.minimum, np.maximum))
        across, points = high - low, (low + high) / 2.0
        grown = np.sqrt(np.einsum("bcek,bcek->bce", across, across).max(axis=-1)) / 2.0
        bulge = np.maximum.reduceat(path.bulge, firsts) if last > 0 else np.zeros(1)
        radii = path.radii + grown + bulge[:, None] + _ROUNDING_M
        way = points[:, :, 1] - points[:, :, 0]
        balls = radii + np.sqrt(np.einsum("bck,bck->bc", way, way)) / 2.0
        return cls(edges, points, radii, points[:, :, 0] + way / 2.0, balls)

    @classmethod
    def of_block(cls, path: Sweep) -> Self:
        """Of samples close to one another."""
        return cls.of(path, max(1, math.ceil((len(path.points) - 1) / _OF_A_BLOCK)))

    def first(self, count: int) -> Self:
        """Of the first `count` capsules alone."""
        each = (some[:, :count] for some in (self.points, self.radii, self.centres, self.balls))
        return type(self)(self.edges, *each)


def runs(near: Flags) -> list[tuple[int, int]]:
    """Begin and end of each row of stretches that are `near` `(b,)`, the end not counted; `_ROW` of them at most."""
    turns = np.flatnonzero(np.diff(np.concatenate([[False], near, [False]]).astype(np.int8))).reshape(-1, 2).tolist()
    return [(at, min(at + _ROW, end)) for first, end in turns for at in range(first, end, _ROW)]


class Boxes:
    """Many boxes at once."""

    def __init__(self, boxes: Sequence[Box]) -> None:
        turns = np.array([box.pose_world_box[:3, :3] for box in boxes]).reshape(-1, 3, 3)
        places = np.array([box.pose_world_box[:3, 3] for box in boxes]).reshape(-1, 3)
        self._axes = turns.transpose(1, 0, 2).reshape(3, -1)
        """`(3, 3 s)` those of all boxes side by side."""
        self._places = np.einsum("sk,skj->sj", places, turns).reshape(-1)
        self._halves = np.array([box.size / 2.0 for box in boxes]).reshape(-1)

    def distance(self, segments: Array) -> Array:
        """Of segments `(..., 2, 3)` from each box `(s, ...)` [m], a bound from below by the gaps along its axes."""
        flat = segments.reshape(-1, 3)
        ends = (flat @ self._axes - self._places).reshape(len(flat) // 2, 2, -1)
        away = np.maximum(np.minimum(ends[:, 0], ends[:, 1]), -np.maximum(ends[:, 0], ends[:, 1]))
        away -= self._halves
        away = np.maximum(away, 0.0, out=away).reshape(len(away), -1, 3)
        return np.asarray(np.sqrt(np.einsum("psk,psk->sp", away, away)).reshape(-1, *segments.shape[:-2]))
