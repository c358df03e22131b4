"""How much motion is left at a pose."""

import numpy as np
import pytest

from robot_agent.kinematics import load_model
from tests.unit.repository import ROOT

MODELS = sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))
ARM = load_model(ROOT / "cell_configs" / "models" / "six_axis.yaml")


@pytest.mark.parametrize("file", MODELS, ids=lambda file: file.stem)
def test_manipulability_is_the_volume_that_joint_speeds_become(file: object) -> None:
    model = load_model(file)  # type: ignore[arg-type]
    q = model.home + np.random.default_rng(1).uniform(-0.05, 0.05, (20, model.n))
    jacobian = model.jacobian(q)
    volume = np.sqrt(np.linalg.det(np.swapaxes(jacobian, -1, -2) @ jacobian))
    np.testing.assert_allclose(model.manipulability(q), volume, rtol=1e-6)


@pytest.mark.parametrize(
    ("joints_deg", "determinant"), [([0, 0, 0, 0, 0, 0], 0.0), ([-46, 46, 46, 46, 46, 46], 1.02515)]
)
def test_manipulability_of_six_axes_is_their_determinant(joints_deg: list[float], determinant: float) -> None:
    assert ARM.manipulability(np.radians(joints_deg)) == pytest.approx(determinant, abs=1e-5)


def test_it_is_the_sine_of_the_wrist_times_what_the_arm_gives() -> None:
    q = np.radians([[10, 20, 30, 40, j5, 60] for j5 in (0, 1, 10, 30, 90)])
    expected = [0, 0.034462, 0.342893, 0.987322, 1.974644]
    np.testing.assert_allclose(ARM.manipulability(q), expected, atol=1e-6)


def test_the_nearer_limit_of_each_joint_counts_and_beyond_it_less_than_nothing_is_left() -> None:
    lower, upper = ARM.limits.position.T
    np.testing.assert_allclose(ARM.from_limits(lower + 0.2), 0.2)
    np.testing.assert_allclose(ARM.from_limits(np.stack([upper - 0.1, upper + 0.3])), [[0.1] * 6, [-0.3] * 6])
