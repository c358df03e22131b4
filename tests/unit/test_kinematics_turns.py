"""The choice of a turn, against trying all turns."""

import numpy as np
import pytest

from robot_agent.kinematics.turns import nearest_turn

RNG = np.random.default_rng(8)
TURNS = 2 * np.pi * np.arange(-8, 9)


@pytest.mark.parametrize("one_near", [False, True])
@pytest.mark.parametrize(("lower", "upper"), [(-np.pi, np.pi), (-1.0, 2.0), (-6.1, 6.1), (0.5, 14.0), (-20.0, -3.0)])
def test_the_turn_is_the_nearest_one_inside_the_limits_or_the_nearest_of_all(
    lower: float, upper: float, one_near: bool
) -> None:
    angles, near = RNG.uniform(-10, 10, 4000), RNG.uniform(-12, 12, 1 if one_near else 4000)
    placed, inside = nearest_turn(angles, near, lower, upper)
    candidates = angles[:, None] + TURNS
    away = abs(candidates - near[:, None])
    fits = (candidates >= lower) & (candidates <= upper)
    np.testing.assert_array_equal(inside, fits.any(axis=1))
    best = np.where(inside[:, None] & ~fits, np.inf, away).argmin(axis=1)
    np.testing.assert_allclose(placed, candidates[np.arange(4000), best], atol=1e-12)


def test_an_angle_at_its_limit_is_inside_on_either_side() -> None:
    angles = np.array([np.pi, -np.pi, np.pi + 1e-10, -np.pi - 1e-10, 3 * np.pi])
    placed, inside = nearest_turn(angles, np.zeros(1), -np.pi, np.pi)
    assert inside.all()
    assert abs(placed).max() <= np.pi + 1e-9
