"""The choice of a turn, against trying all turns."""

import numpy as np
import pytest

from robot_agent.kinematics import TrackError, load_model
from robot_agent.kinematics.turns import nearest_turn
from tests.unit.repository import ROOT

SCARA = load_model(ROOT / "cell_configs" / "models" / "scara.yaml")

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


def test_a_spindle_that_lifts_as_it_turns_reaches_a_height_with_the_turn_that_it_names() -> None:
    """Up to one turn's lift (20 mm) above and below what J3 reaches at the turn nearest to home."""
    poses = np.repeat(SCARA.forward(SCARA.home)[None], 41, axis=0)
    lowest, highest = SCARA.limits.position[2]
    poses[:, 2, 3] += np.linspace(lowest - 0.02, highest + 0.02, 41)
    solutions = SCARA.inverse(poses, near=SCARA.home)
    assert solutions.in_limits.all()
    np.testing.assert_allclose(SCARA.forward(solutions.joints), np.repeat(poses[:, None], 2, axis=1), atol=1e-9)


def test_a_spindle_does_not_turn_on_the_way_to_go_on_where_its_slide_ends() -> None:
    poses = np.repeat(SCARA.forward(SCARA.home)[None], 21, axis=0)
    poses[:, 2, 3] += np.linspace(0.0, 0.05, 21)
    with pytest.raises(TrackError, match=r"joint J3 would need 42.50 mm, allowed -150.00 to 40.00"):
        SCARA.track(poses, SCARA.home)
