"""The triangle of two links and the span between their far ends: the heart of every elbow."""

from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array

REACH_TOLERANCE_M = 1e-10
"""A wrist this far outside still counts as the stretched or folded arm."""


@dataclass(frozen=True, slots=True, eq=False)
class Triangle:
    """Angles between upper arm and span, and at the elbow, 0 to pi, by their tangents.

    Both have the same numerator, so its error for the stretched and the folded arm, where it is nearly zero, turns both
    angles alike and cancels in the position of the wrist. An arccosine would have half the digits there.
    """

    area4: Array
    """Four times the area [m^2], by Heron's formula: 2 * upper * span * sin(joint) = 2 * upper * fore * sin(elbow)."""
    joint: Array
    """2 * upper * span * cos(joint) [m^2]."""
    elbow: Array
    """2 * upper * fore * cos(elbow) [m^2]."""

    @property
    def at_joint(self) -> Array:
        return np.asarray(np.arctan2(self.area4, self.joint))

    @property
    def at_elbow(self) -> Array:
        return np.asarray(np.arctan2(self.area4, self.elbow))


def elbow_triangle(squared: Array, upper: float, fore: Array | float) -> Triangle:
    """The triangle (upper arm, forearm, span), from the square of the span; beyond reach it is flat."""
    longest, shortest = (upper + fore) ** 2, (upper - fore) ** 2
    area4 = np.asarray((longest - squared) * (squared - shortest))
    np.maximum(area4, 0, out=area4)
    np.sqrt(area4, out=area4)
    return Triangle(area4, squared + (upper - fore) * (upper + fore), (upper * upper + fore * fore) - squared)


def beyond_reach(span: Array, upper: float, fore: Array | float) -> Array:
    """How much [m] the span is too long (positive) or too short (negative) for the two links; 0 in reach."""
    excess = span - np.minimum(np.maximum(span, np.abs(upper - fore)), upper + fore)
    return np.where(np.abs(excess) > REACH_TOLERANCE_M, excess, 0.0)


def beyond(distance: Array) -> Array:
    """A distance [m] beyond a border, 0 for rounding."""
    return np.where(distance > REACH_TOLERANCE_M, distance, 0.0)
