"""Lines within a tolerance: how far the curves are from them, and what stays a corner."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robot_agent.paths.caps import Tolerance
from robot_agent.paths.pose_path import PosePath
from robot_agent.paths.smoothing import smoothed
from tests.unit.robot_agent.paths.cam_lines import KINDS, CamLines, away, cam_lines

TOLERANCE = Tolerance(5e-5, np.radians(0.5))


def paths_of(lines: CamLines, tolerance: Tolerance = TOLERANCE) -> list[PosePath]:
    moves = list(enumerate(lines.lines(tolerance)))
    return smoothed(moves, lines.poses[0], lines.poses[0], None, [], 1e-4)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 2**32 - 1), tolerance_m=st.sampled_from([1e-5, 5e-5, 1e-3]))
@settings(max_examples=6, deadline=None)
def test_curves_and_lines_are_nowhere_farther_apart_than_told(kind: str, seed: int, tolerance_m: float) -> None:
    lines = cam_lines(kind, np.random.default_rng(seed))
    tolerance = Tolerance(tolerance_m, TOLERANCE.angle_rad)
    paths = paths_of(lines, tolerance)
    assert away(lines, paths, tolerance) <= 1.0
    told = [each for path in paths for each in path.transitions]
    assert all(each.deviation_m <= tolerance.distance_m for each in told)
