"""Equations with a symmetric matrix of five bands."""

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[np.float64]

_PART = 20
"""Unknowns from one border to the next; the last two of each part are its border."""
_INNER = _PART - 2


def solve_banded(bands: Numbers, right: Numbers) -> Numbers:
    """x `(m,)` of A x = `right` `(m,)`, A positive definite with diagonal and lower bands `bands` `(3, m)`.

    `bands[k, i]` is A[i + k, i]. Substructuring: all parts are solved at once for the borders between them, then the
    few equations of the borders (their Schur complement), so that few calls do it instead of one per unknown.
    """
    count = -(-len(right) // _PART)
    padded = np.zeros((3, count * _PART))
    padded[:, : len(right)] = bands
    padded[0, len(right) :] = 1.0
    rest = np.zeros((count, _PART))
    rest.reshape(-1)[: len(right)] = right
    by_part = padded.reshape(3, count, _PART)
    matrix, coupling = _inner(by_part)
    solved = np.linalg.solve(matrix, np.concatenate([coupling, rest[:, :_INNER, None]], axis=2))
    border = _borders(by_part, rest[:, _INNER:], np.swapaxes(coupling, 1, 2) @ solved)
    around = np.concatenate([np.concatenate([np.zeros((1, 2)), border[:-1]]), border], axis=1)
    x = np.empty((count, _PART))
    x[:, :_INNER] = solved[:, :, 4] - (solved[:, :, :4] @ around[..., None])[..., 0]
    x[:, _INNER:] = border
    return x.reshape(-1)[: len(right)]


def _inner(bands: Numbers) -> tuple[Numbers, Numbers]:
    """The matrix `(parts, i, i)` of each part without its border, and how it meets two borders `(parts, i, 4)`.

    These are the one of the part before and its own.
    """
    count, at = bands.shape[1], np.arange(_INNER)
    matrix = np.zeros((count, _INNER, _INNER))
    matrix[:, at, at] = bands[0, :, :_INNER]
    for offset in (1, 2):
        below, above = at[offset:], at[:-offset]
        matrix[:, below, above] = matrix[:, above, below] = bands[offset, :, : _INNER - offset]
    coupling = np.zeros((count, _INNER, 4))
    coupling[1:, 0, 0], coupling[1:, 0, 1] = bands[2, :-1, _INNER], bands[1, :-1, _INNER + 1]
    coupling[1:, 1, 1] = bands[2, :-1, _INNER + 1]
    coupling[:, -2, 2], coupling[:, -1, 2] = bands[2, :, _INNER - 2], bands[1, :, _INNER - 1]
    coupling[:, -1, 3] = bands[2, :, _INNER - 1]
    return matrix, coupling


def _borders(bands: Numbers, right: Numbers, reduced: Numbers) -> Numbers:
    """The unknowns `(parts, 2)` of the borders; `reduced` `(parts, 4, 5)` is what the parts take from them."""
    count = len(right)
    at = np.arange(count)
    schur = np.zeros((count, 2, count, 2))
    schur[at, 0, at, 0], schur[at, 1, at, 1] = bands[0, :, _INNER], bands[0, :, _INNER + 1]
    schur[at, 0, at, 1] = schur[at, 1, at, 0] = bands[1, :, _INNER]
    schur[at, :, at, :] -= reduced[:, 2:, 2:4]
    schur[at[:-1], :, at[:-1], :] -= reduced[1:, :2, :2]
    schur[at[1:], :, at[:-1], :] = -reduced[1:, 2:, :2]
    schur[at[:-1], :, at[1:], :] = -reduced[1:, :2, 2:4]
    rest = right - reduced[:, 2:, 4]
    rest[:-1] -= reduced[1:, :2, 4]
    border = np.linalg.solve(schur.reshape(2 * count, 2 * count), rest.reshape(-1))
    return np.asarray(border.reshape(count, 2))
