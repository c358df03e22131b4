"""The triangle of two links and the span between their far ends: the heart of every elbow."""

from dataclasses import dataclass

import numpy as np

from cell.geometry.arrays import Array

REACH_TOLERANCE_M = 1e-10
"""A wrist this far outside still counts as the stretched or folded arm."""


@dataclass(frozen=True, slots=True, eq=False)
class Triangle:
    """Angles between upper arm and span, and at the elbow, 0 to pi."""

    cos_joint: Array
    sin_joint: Array
    cos_elbow: Array
    sin_elbow: Array

    @property
    def at_joint(self) -> Array:
        return np.asarray(np.arctan2(self.sin_joint, self.cos_joint))

    @property
    def at_elbow(self) -> Array:
        return np.asarray(np.arctan2(self.sin_elbow, self.cos_elbow))


def elbow_triangle(span: Array, upper: float, fore: Array | float) -> Triangle:
    """The triangle (upper arm, forearm, span).

    Heron's product keeps the sine exact for the stretched and the folded arm, where an arccosine has half the digits;
    the angle at the joint follows from the one at the elbow, so their errors cancel in the position of the wrist.
    """
    product = (upper + fore - span) * (upper + fore + span) * (span + upper - fore) * (span - upper + fore)
    sine = np.sqrt(np.maximum(product, 0)) / (2 * upper * fore)
    cosine = (upper * upper + fore * fore - span * span) / (2 * upper * fore)
    length = np.sqrt(sine * sine + cosine * cosine)
    sine, cosine = sine / length, cosine / length
    across, along = fore * sine, upper - fore * cosine
    length = np.sqrt(across * across + along * along)
    folded = length == 0
    length = length + folded
    return Triangle((along + folded) / length, across / length, cosine, sine)


def beyond_reach(span: Array, upper: float, fore: Array | float) -> Array:
    """How much [m] the span is too long (positive) or too short (negative) for the two links; 0 in reach."""
    return beyond(span - (upper + fore)) - beyond(np.abs(upper - fore) - span)


def beyond(distance: Array) -> Array:
    """A distance [m] beyond a border, 0 for rounding."""
    return np.where(distance > REACH_TOLERANCE_M, distance, 0.0)
