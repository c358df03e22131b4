"""The triangle of two links and the span between their far ends: the heart of every elbow."""

import numpy as np

from cell.geometry.arrays import Array

REACH_TOLERANCE_M = 1e-10
"""A wrist this far outside still counts as the stretched or folded arm."""


def elbow_triangle(span: Array, upper: float, fore: Array | float) -> tuple[Array, Array]:
    """Angles between upper arm and span, and at the elbow, of the triangle (upper arm, forearm, span), 0 to pi.

    Heron's product keeps the sine exact for the stretched and the folded arm, where an arccosine has half the digits;
    the first angle follows from the one at the elbow, so their errors cancel in the position of the wrist.
    """
    product = (upper + fore - span) * (upper + fore + span) * (span + upper - fore) * (span - upper + fore)
    sine = np.sqrt(np.maximum(product, 0)) / (2 * upper * fore)
    cosine = (upper * upper + fore * fore - span * span) / (2 * upper * fore)
    return np.arctan2(fore * sine, upper - fore * cosine), np.arctan2(sine, cosine)


def beyond_reach(span: Array, upper: float, fore: Array | float) -> Array:
    """How much [m] the span is too long (positive) or too short (negative) for the two links; 0 in reach."""
    return beyond(span - (upper + fore)) - beyond(np.abs(upper - fore) - span)


def beyond(distance: Array) -> Array:
    """A distance [m] beyond a border, 0 for rounding."""
    return np.where(distance > REACH_TOLERANCE_M, distance, 0.0)
