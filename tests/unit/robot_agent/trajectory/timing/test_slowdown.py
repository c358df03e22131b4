"""How much slower joints have to be, on polynomials whose peaks are known."""

from dataclasses import replace

import numpy as np
import pytest

from robot_agent.trajectory.joints.pieces import Pieces
from robot_agent.trajectory.timing.slowdown import joints_slower_by
from tests.unit.random_moves import LIMITS


@pytest.mark.parametrize("at", [0.0, 0.06, 0.3, 0.94])
def test_a_peak_of_the_jerk_inside_a_piece_counts_wherever_it_is(at: float) -> None:
    coefficients = np.zeros((1, 6, 6))  # the jerk of J1 is 1 - (t - at)^2
    coefficients[0, 3:, 0] = np.array([1.0 - at * at, 2.0 * at, -1.0]) / np.array([6.0, 24.0, 60.0])
    pieces = Pieces(np.array([0.0, 1.0]), coefficients)
    limits = replace(LIMITS, velocity=np.full(6, 9.0), acceleration=np.full(6, 9.0), jerk=np.full(6, 0.5))
    assert joints_slower_by(pieces, limits) ** 3 == pytest.approx(2.0, rel=1e-3)
