"""Programs with round coordinates: exact zeros, right angles, half turns, repeated and mirrored points."""

import contextlib
from pathlib import Path

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import load_model
from robot_agent.paths import Arc, Line, Move, Sequence, Spline
from robot_agent.trajectory import Limits, PlanError, plan
from tests.unit.random_moves import LIMITS, MODEL, START, round_sequence
from tests.unit.repository import ROOT


def shifted(x_m: float, y_m: float = 0.0) -> np.ndarray:
    """The pose at the start, so far away."""
    pose = MODEL.forward(START)
    pose[:2, 3] += x_m, y_m
    return pose


MODELS = sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))
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


@pytest.mark.parametrize(
    ("move", "why"),
    [
        (Line(shifted(1e300), None, 7), r"line 7: .* coordinate of 1e\+300 m, allowed -1000 to 1000 m"),
        (
            Spline(np.array([shifted(1e9), shifted(2e9)]), 7),
            r"line 7: .* coordinate of 2e\+09 m, allowed -1000 to 1000 m",
        ),
        (Arc(shifted(0.1, 1e-3), shifted(0.2), 7, 200.0 * np.pi), "line 7: .* is 3141.91 m long, at most 2000 m are"),
    ],
    ids=["line", "spline", "rounds of a wide arc"],
)
def test_what_is_far_beyond_every_robot_is_refused_with_its_line_and_the_range(move: Move, why: str) -> None:
    with pytest.raises(PlanError, match=why):
        plan(MODEL, Sequence([move]), LIMITS, start=START)
