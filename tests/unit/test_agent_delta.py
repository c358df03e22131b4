"""A robot whose arms do not close at every joint set: what the agent makes of joints that cannot be."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from robot_agent.agent.planning import PlanFailed, Planner, PlanRequest
from robot_agent.agent.report import _flange
from robot_agent.kinematics import Model, load_model, model_of
from robot_agent.language import JointStep
from robot_agent.trajectory import Limits

MODELS = Path(__file__).parents[2] / "cell_configs" / "models"


def short_rods() -> Model:
    """A delta whose arms do not close when all of them are level."""
    description = load_model(MODELS / "delta.yaml").description
    limits = replace(description.limits, position=np.radians([[-35, 80], [-35, 80], [-35, 80], [-360, 360]]))
    return model_of(
        replace(
            description, geometry=description.geometry | {"k": 0.27}, limits=limits, home=np.radians([75, 75, 75, 0])
        )
    )


def test_a_joint_move_through_joints_that_cannot_be_is_refused_with_its_line() -> None:
    model = short_rods()
    planner = Planner(model, Limits.of(model.description), np.eye(4), 0.004)
    step = JointStep(7, tuple(np.radians([-10.0, -10, -10, 0]).tolist()), 1.0)
    result = planner.plan(PlanRequest(1, (step,), model.home, ()))
    assert isinstance(result, PlanFailed)
    assert result.text.startswith("line 7: joints")
    assert "too short to meet" in result.text


def test_measured_joints_that_cannot_be_do_not_end_the_agent() -> None:
    model = short_rods()
    np.testing.assert_array_equal(_flange(model, np.zeros(4)), model.forward(model.home))
    np.testing.assert_array_equal(_flange(model, model.home), model.forward(model.home))
