"""Equations with a symmetric matrix of five bands."""

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_BLOCK = 24


def solve_banded(bands: Numbers, right: Numbers) -> Numbers:
    """x `(m,)` of A x = `right` `(m,)`, A positive definite with diagonal and lower bands `bands` `(3, m)`.

    `bands[k, i]` is A[i + k, i]. Block elimination: few calls instead of one per unknown.
    """
    count = -(-len(right) // _BLOCK)
    size = count * _BLOCK
    padded = np.zeros((3, size))
    padded[:, : len(right)] = bands
    padded[0, len(right) :] = 1.0
    rest = np.zeros(size)
    rest[: len(right)] = right
    diagonal, below = _blocks(padded, count)
    solved_below, solved = np.empty((count, _BLOCK, _BLOCK)), np.empty((count, _BLOCK))
    matrix, vector = diagonal[0], rest[:_BLOCK]
    for k in range(count):
        if k:
            matrix = diagonal[k] - below[k - 1] @ solved_below[k - 1]
            vector = rest[k * _BLOCK : (k + 1) * _BLOCK] - below[k - 1] @ solved[k - 1]
        upper = below[k].T if k < count - 1 else np.zeros((_BLOCK, _BLOCK))
        both = np.linalg.solve(matrix, np.column_stack([upper, vector]))
        solved_below[k], solved[k] = both[:, :-1], both[:, -1]
    x = np.empty((count, _BLOCK))
    x[-1] = solved[-1]
    for k in range(count - 2, -1, -1):
        x[k] = solved[k] - solved_below[k] @ x[k + 1]
    return x.reshape(-1)[: len(right)]


def _blocks(bands: Numbers, count: int) -> tuple[Numbers, Numbers]:
    """Diagonal blocks `(count, b, b)` and the blocks below them `(count - 1, b, b)`."""
    diagonal = np.zeros((count, _BLOCK, _BLOCK))
    below = np.zeros((max(count - 1, 0), _BLOCK, _BLOCK))
    by_block = bands.reshape(3, count, _BLOCK)
    inner = np.arange(_BLOCK)
    diagonal[:, inner, inner] = by_block[0]
    for offset in (1, 2):
        rows = inner[offset:]
        diagonal[:, rows, rows - offset] = by_block[offset][:, : _BLOCK - offset]
        diagonal[:, rows - offset, rows] = by_block[offset][:, : _BLOCK - offset]
        for k in range(offset):
            below[:, k, _BLOCK - offset + k] = by_block[offset][:-1, _BLOCK - offset + k]
    return diagonal, below
