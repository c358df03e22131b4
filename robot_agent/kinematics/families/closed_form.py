"""What follows for every robot whose inverse is a formula: many poses at once, their turns and their limits."""

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from math import prod
from typing import ClassVar

import numpy as np

from cell.geometry import pose_elements
from cell.geometry.arrays import Array, Flags
from robot_agent.kinematics.model import Model
from robot_agent.kinematics.solutions import Solutions
from robot_agent.kinematics.turns import nearest_turn, within

BLOCK = 1000
"""Poses at once: fewer cost more calls for each, with more the intermediate results leave the cache."""


@dataclass(frozen=True, slots=True, eq=False)
class Raw:
    """Solutions of `p` poses before turns and limits.

    Every array broadcasts to `(*slots, p)`: an angle that several branches share is given, and turned, once.
    """

    joints: Sequence[Array]
    """One array per joint."""
    excess_m: Array
    singular: Flags
    tilt_rad: Array | float = 0.0
    """`(p,)`."""


class ClosedForm(Model):
    """A robot whose family has formulas for all solutions of a pose."""

    slots: ClassVar[tuple[int, ...]]
    """How the branches are laid out, such as (2, 2) for FRONT, BACK x UP, DOWN."""

    @abstractmethod
    def branches_of(self, elements: Array, held: Array) -> Raw:
        """All branches for poses of the flange given by their elements `(4, 4, p)`.

        `held` `(n, 1)` or `(n, p)`: the values of joints that a pose leaves free.
        """

    def inverse(self, poses: Array, near: Array | None = None) -> Solutions:
        elements = pose_elements(self.flange_at(poses), "poses")
        leading, count = np.shape(poses)[:-2], elements.shape[-1]
        held, slots = self.held(near, leading), prod(self.slots)
        # One contiguous array over all poses for each joint of each branch; the answers are views of it.
        joints = np.empty((self.n, *self.slots, count))
        valid, in_limits, singular = np.empty((3, *self.slots, count), dtype=bool)
        excess, tilt = np.empty((*self.slots, count)), np.empty(count)
        for start in range(0, count, BLOCK):
            part = slice(start, start + BLOCK)
            nearby = held if held.shape[1] == 1 else held[:, part]
            raw = self.branches_of(elements[..., part], nearby)
            excess[..., part], tilt[part] = raw.excess_m, raw.tilt_rad
            valid[..., part] = (raw.excess_m == 0) & (np.asarray(raw.tilt_rad) == 0)
            singular[..., part] = raw.singular & valid[..., part]
            in_limits[..., part] = self._placed(raw, nearby, valid[..., part], out=joints[..., part])

        def by_pose(values: np.ndarray) -> np.ndarray:
            return values.reshape(slots, count).T.reshape(*leading, slots)

        return Solutions(
            joints=joints.reshape(self.n, slots, count).transpose(2, 1, 0).reshape(*leading, slots, self.n),
            valid=by_pose(valid),
            in_limits=by_pose(in_limits),
            singular=by_pose(singular),
            excess_m=by_pose(excess),
            branches=self.branches,
            complete=True,
            tilt_rad=tilt.reshape(leading),
        )

    def _placed(self, raw: Raw, held: Sequence[Array] | Array, valid: Flags, out: Array) -> Flags:
        """Write joints, each at its turn, to `out` `(n, *slots, p)`; return which `(*slots, p)` are in limits."""
        missing, in_limits = np.where(valid, 0.0, np.nan), valid.copy()
        for i, values in enumerate(raw.joints):
            if self.linear[i]:
                placed, inside = values, within(values, *self.limits.position[i])
            else:
                placed, inside = nearest_turn(values, held[i], *self.limits.position[i])
            np.add(placed, missing, out=out[i])
            in_limits &= inside
        return in_limits
