"""Orientation along moves joined to one path: blended only where the flange begins to turn at another rate."""

import numpy as np

from robot_agent.paths import Line
from robot_agent.paths.legs import legs
from robot_agent.paths.orientation import turned
from robot_agent.paths.pose_path import PosePath, pose_paths

UPWARDS = np.array([0.0, 0.0, 1.0])


def ahead(x: float, turn_rad: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[0, 3] = turned(UPWARDS, np.array(turn_rad)), x
    return pose


def straight_on(*targets: np.ndarray) -> PosePath:
    moves = [(number, Line(target, None, number + 1, round_m=0.01)) for number, target in enumerate(targets)]
    (path,) = pose_paths(legs(moves, ahead(0.0, 0.0)), 1e-4)
    return path


def test_where_the_rate_of_turning_stays_the_orientation_is_that_of_the_lines() -> None:
    still, turning = straight_on(ahead(0.1, 0.0), ahead(0.3, 0.0)), straight_on(ahead(0.1, 0.2), ahead(0.3, 0.6))
    along = np.linspace(0.0, 0.3, 31)
    for path, rate in ((still, 0.0), (turning, 2.0)):
        np.testing.assert_allclose(path.poses(along)[:, :3, :3], turned(UPWARDS, rate * along), atol=1e-12)
        np.testing.assert_allclose(path.borders_m, [0.0, 0.1, 0.3])


def test_where_it_changes_one_passes_into_the_other() -> None:
    path = straight_on(ahead(0.1, 0.0), ahead(0.2, 0.0), ahead(0.4, 0.4))
    (window,) = path.orientation.windows
    assert 0.1 <= window.first_m < 0.2 < window.last_m <= 0.4
    ends = np.array([0.0, 0.1, 0.2, 0.4])
    np.testing.assert_allclose(
        path.poses(ends), [ahead(0, 0), ahead(0.1, 0), ahead(0.2, 0), ahead(0.4, 0.4)], atol=1e-12
    )
