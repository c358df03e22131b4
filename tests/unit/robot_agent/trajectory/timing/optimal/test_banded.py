"""The banded equations against a dense solver."""

import numpy as np
import pytest

from robot_agent.trajectory.timing.optimal.banded import solve_banded


@pytest.mark.parametrize("size", [3, 18, 19, 20, 21, 100])
def test_solution_is_that_of_the_dense_matrix(size: int) -> None:
    rng = np.random.default_rng(size)
    bands = np.zeros((3, size))
    bands[0], bands[1, :-1], bands[2, :-2] = rng.uniform(3, 4, size), rng.uniform(-1, 1, size - 1), 0.4
    dense = np.diag(bands[0])
    for offset in (1, 2):
        dense += np.diag(bands[offset, :-offset], -offset) + np.diag(bands[offset, :-offset], offset)
    right = rng.normal(size=size)
    np.testing.assert_allclose(solve_banded(bands, right), np.linalg.solve(dense, right), atol=1e-12)
