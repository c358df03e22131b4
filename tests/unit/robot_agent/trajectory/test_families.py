"""Robots of every family move: lines and joint moves through the planner, and their bodies along the way."""

from pathlib import Path

import numpy as np
import pytest

from robot_agent.kinematics import load_model
from robot_agent.paths import JointMove, Line, Sequence
from robot_agent.trajectory import Limits, PlanError, plan
from robot_agent.workspace import sweep
from tests.unit.repository import ROOT

MODELS = sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))
each = pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)


@each
def test_a_line_is_planned_and_keeps_the_joints_limits(path: Path) -> None:
    model = load_model(path)
    limits = Limits.of(model.description)
    target = model.forward(model.home).copy()
    target[:3, 3] += [0.03, 0.04, -0.02]
    motion = plan(model, Sequence([Line(target, 0.1, 1)]), limits, start=model.home)
    times = np.linspace(0, motion.duration_s, 300)
    np.testing.assert_allclose(model.forward(motion.q(times[-1])), target, atol=1e-6)
    assert (abs(motion.qd(times)) <= limits.velocity * (1 + 1e-6)).all()
    assert (abs(motion.qdd(times)) <= limits.acceleration * (1 + 1e-6)).all()
    start = model.forward(model.home)[:3, 3]
    way = target[:3, 3] - start
    along = (motion.pose(times)[:, :3, 3] - start) @ way / (way @ way)
    off = motion.pose(times)[:, :3, 3] - start - along[:, None] * way
    assert np.linalg.norm(off, axis=1).max() < 1e-6


@each
def test_a_joint_move_is_planned_and_its_body_is_covered(path: Path) -> None:
    model = load_model(path)
    middle = model.limits.position.mean(axis=1)
    target = model.home + 0.2 * (middle - model.home) + 0.02
    motion = plan(model, Sequence([JointMove(target, 1.0, 1)]), Limits.of(model.description), start=model.home)
    body = sweep(model, np.eye(4), motion.q(motion.grid))
    assert (body.bulge >= 0).all()
    between = model.capsules(motion.q((motion.grid[:-1] + motion.grid[1:]) / 2))
    half_way = (body.points[:-1] + body.points[1:]) / 2
    away = np.linalg.norm(between - half_way, axis=-1).max(axis=(1, 2))
    steps = body.chords.max(axis=1)
    assert (away <= body.bulge + steps / 2 + 1e-9).all()


@pytest.mark.parametrize("name", ["scara", "palletizer", "delta"])
def test_a_tilted_line_is_refused_with_what_to_do(name: str) -> None:
    model = load_model(MODELS[0].parent / f"{name}.yaml")
    target = model.forward(model.home).copy()
    target[:3, :3] = target[:3, :3] @ np.array([[1.0, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    with pytest.raises(PlanError, match=r"deg away from those .* give the target an orientation"):
        plan(model, Sequence([Line(target, None, 7)]), Limits.of(model.description), start=model.home)
