"""Equations with a symmetric matrix of five bands."""

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]


def solve_banded(bands: Numbers, right: Numbers) -> Numbers:
    """x `(m,)` of A x = `right` `(m,)`, A positive definite with diagonal and lower bands `bands` `(3, m)`.

    `bands[k, i]` is A[i + k, i]. A = L D L^T, one unknown after the other: with so few bands that takes no longer in
    plain numbers than solving for many unknowns at once does in arrays.
    """
    made: list[tuple[float, float, float]] = []
    near = far = far_before = coupling = one = two = below = below_before = 0.0
    for diagonal, first, second, value in zip(*bands.tolist(), right.tolist(), strict=True):
        pivot = diagonal - near * coupling - far_before * below_before
        one, two = value - near * one - far_before * two, one
        coupling = first - near * below
        near, far, far_before = coupling / pivot, second / pivot, far
        below, below_before = second, below
        made.append((one / pivot, near, far))
    x, one, two = [], 0.0, 0.0
    for value, near, far in reversed(made):
        one, two = value - near * one - far * two, one
        x.append(one)
    return np.array(x[::-1])
