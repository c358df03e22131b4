"""A robot whose arms do not close at every joint set: what the agent makes of joints that cannot be."""

from dataclasses import replace

import numpy as np

from cell.messages import Enable, Mode
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import PlanFailed, PlanRequest
from robot_agent.kinematics import Model, load_model, model_of
from robot_agent.language import JointStep
from robot_agent.workspace import PlacedRobot
from tests.unit.agent_world import AgentWorld
from tests.unit.repository import ROOT

MODELS = ROOT / "cell_configs" / "models"


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
    planner = Planner(PlacedRobot.at(model), 0.004)
    step = JointStep(7, tuple(np.radians([-10.0, -10, -10, 0]).tolist()), 1.0)
    result = planner.plan(PlanRequest(1, (step,), model.home, ()))
    assert isinstance(result, PlanFailed)
    assert result.text.startswith("line 7: joints")
    assert "too short to meet" in result.text


OPEN = np.zeros(4)


def delta_world() -> AgentWorld:
    return AgentWorld("HOME\nEND", arm=short_rods())


def test_of_measured_joints_that_cannot_be_there_is_no_tcp_and_no_body() -> None:
    world = delta_world()
    world.measured = OPEN
    world.run(0.2)
    assert world.state.joints == (0.0, 0.0, 0.0, 0.0)
    assert world.state.tcp_position_m is None
    assert world.state.tcp_quaternion_xyzw is None
    assert not world.presences[-1].body.known


def test_the_same_while_the_drives_are_on() -> None:
    world = delta_world()
    world.run(0.2)
    world.call(Enable())
    world.run(0.2)
    assert world.state.mode is Mode.READY
    assert world.presences[-1].body.known
    world.measured = OPEN
    world.run(0.1)
    assert world.state.tcp_position_m is None
    assert not world.presences[-1].body.known


def test_drives_that_hold_a_mechanism_where_it_cannot_be_are_a_fault() -> None:
    world = delta_world()
    world.commanded = OPEN
    world.run(0.2)
    world.call(Enable())
    world.run(0.2)
    assert world.state.mode is Mode.FAULT
    assert world.state.alarms[0].startswith("the axes cannot be where the drives say: joints[0]: found 0.00,")
    assert not np.diff(world.played, axis=0).any()


def test_joints_and_tcp_of_a_robot_that_is_not_referenced_are_none() -> None:
    world = AgentWorld("HOME\nEND")
    world.referenced = False
    world.run(0.2)
    assert world.state.joints is None
    assert world.state.tcp_position_m is None
    assert not world.presences[-1].body.known
    world.referenced = True
    world.run(0.1)
    assert world.state.joints is not None
    assert world.state.tcp_position_m is not None
