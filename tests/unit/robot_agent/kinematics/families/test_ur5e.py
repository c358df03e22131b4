"""The cobot of `cell_configs/models` against what the maker of its model publishes."""

import json

import numpy as np

from robot_agent.kinematics import load_model
from tests.unit.repository import ROOT

UR5E = json.loads((ROOT / "tests" / "vectors" / "ur5e.json").read_text())
COBOT = load_model(ROOT / "cell_configs" / "models" / "cobot.yaml")


def published_flange(q: np.ndarray) -> np.ndarray:
    """Classic Denavit-Hartenberg chain: Rz(theta) Tz(d) Tx(a) Rx(alpha) for each joint."""
    pose = np.eye(4)
    for theta, d, a, alpha in zip(q, UR5E["d"], UR5E["a"], np.pi * np.array(UR5E["alpha_over_pi"]), strict=True):
        (ct, ca), (st, sa) = np.cos([theta, alpha]), np.sin([theta, alpha])
        step = [[ct, -st * ca, st * sa, a * ct], [st, ct * ca, -ct * sa, a * st], [0, sa, ca, d], [0, 0, 0, 1]]
        pose = pose @ step
    return pose


def test_the_cobot_has_the_published_chain() -> None:
    # Its base is turned by half a turn about Z, its fifth axis points up instead of down, its flange looks along +Y.
    half_turn, signs = np.diag([-1.0, -1, 1, 1]), np.array([1, 1, 1, 1, -1, 1])
    flange = np.linalg.inv(half_turn @ published_flange(np.zeros(6))) @ COBOT.forward(np.zeros(6))
    np.testing.assert_allclose(flange[:3, 3], 0, atol=1e-12)
    for q in np.random.default_rng(5).uniform(-np.pi, np.pi, (200, 6)):
        np.testing.assert_allclose(COBOT.forward(q), half_turn @ published_flange(signs * q) @ flange, atol=1e-12)


def test_its_parallel_joints_are_offset_as_published() -> None:
    g = COBOT.description.geometry
    assert g["a1y"] == UR5E["shoulder_offset_m"]
    np.testing.assert_allclose(g["a1y"] + g["a2y"], UR5E["elbow_offset_m"], atol=1e-12)


def test_its_joints_and_motors_are_within_what_is_published() -> None:
    limits = COBOT.limits
    assert (np.degrees(np.abs(limits.position)).max(axis=1) <= UR5E["position_deg"]).all()
    np.testing.assert_allclose(np.degrees(limits.velocity), UR5E["velocity_deg_s"])
    peaks = [motor.peak_torque_nm * motor.ratio for motor in COBOT.description.motors.values()]
    np.testing.assert_allclose(peaks, UR5E["effort_nm"])
