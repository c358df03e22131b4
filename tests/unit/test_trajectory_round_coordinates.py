"""Programs with round coordinates: exact zeros, right angles, half turns, repeated and mirrored points."""

import contextlib
from pathlib import Path

import numpy as np
import pytest
from random_moves import LIMITS, MODEL, round_sequence

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import load_model
from robot_agent.paths import Line, Sequence, Spline
from robot_agent.trajectory import Limits, PlanError, plan

MODELS = sorted((Path(__file__).parents[2] / "cell_configs" / "models").glob("*.yaml"))
SEEDS = 40


@pytest.mark.parametrize("file", MODELS, ids=lambda file: file.stem)
def test_a_plan_of_round_coordinates_is_a_motion_or_a_plan_error_whatever_the_robot(file: Path) -> None:
    model, done = load_model(file), 0  # a small robot has little room around its home: it can do one of 40
    for seed in range(SEEDS):
        sequence = round_sequence(model, seed, longest=4)
        with contextlib.suppress(PlanError):
            motion = plan(model, sequence, Limits.of(model.description), start=model.home)
            assert np.isfinite(motion.q(motion.grid)).all()
            done += 1
    assert done


@pytest.mark.parametrize("sideways", [(0.0, 0.2), (0.2, 0.0), (-0.1, 0.1)], ids=str)
def test_the_arch_from_place_to_place_is_one_motion_without_a_stop(sideways: tuple[float, float]) -> None:
    start = from_xyz_abc(np.array([1.2, 0.0, 1.4, 0.0, np.pi / 2.0, 0.0]))
    up, over, down = start.copy(), start.copy(), start.copy()
    up[2, 3] += 0.1
    over[:2, 3] += sideways
    over[2, 3], down[:2, 3] = up[2, 3], over[:2, 3]
    arch = [Line(up, None, 1), Spline(over[None], 2), Line(down, None, 3)]
    motion = plan(MODEL, Sequence(arch), LIMITS, start=MODEL.solve(start))
    assert len(motion.rests) == 2
    np.testing.assert_allclose(motion.pose(np.array(motion.duration_s)), down, atol=1e-6)
