"""The space in front of a jog holds what the jog does."""

import numpy as np
import pytest

from cell.messages import JogFrame
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.space.jog_tube import JogTube
from robot_agent.trajectory import Limits
from robot_agent.trajectory.sources import JogSource, JogWish, JointAxes, States, ToolAxes
from robot_agent.workspace import PlacedRobot, standing, sweep
from tests.unit.six_axis_arm import arm

ARM = arm()
LIMITS = Limits.of(ARM.description)
PLANNER = Planner(PlacedRobot.at(ARM, kept_apart=True), 0.004)
START = np.array([0.2, -0.3, 1.2, 0.1, 0.6, 0.3])


def _source(index: int, speed: float, *, tool: bool) -> JogSource:
    axes = ToolAxes(ARM, LIMITS, JogFrame.BASE, np.eye(4)) if tool else JointAxes(LIMITS)
    source = JogSource(ARM, LIMITS, 0.004, axes, JogWish(index, speed))
    source.resume(States.standing(START), np.repeat(START[None], 2, axis=0))
    return source


@pytest.mark.parametrize(
    ("index", "speed", "tool"), [(0, 0.3, False), (2, -0.3, False), (0, 0.25, True), (4, 0.4, True)]
)
def test_all_that_a_jog_does_lies_in_the_tube_or_where_it_stood(index: int, speed: float, tool: bool) -> None:
    source, tube = _source(index, speed, tool=tool), JogTube()
    laid = standing(ARM, np.eye(4), START, 0.01)
    q = START
    for _ in range(60):
        laid = laid.joined(tube.ahead(PLANNER, source, q, at_rest=False))
        states = source.samples(20).then(source.brake())
        q = states.q[-1]
        path = sweep(ARM, np.eye(4), states.q)
        away = np.linalg.norm(path.points[:, None] - laid.points[None], axis=-1).max(axis=-1)
        assert ((away + path.radii) <= laid.radii).all(axis=-1).any(axis=1).all()
    assert np.abs(q - START).max() > 0.2


def test_a_tube_goes_on_where_it_was_laid_and_ends_at_the_limits() -> None:
    source, tube = _source(1, -0.5, tool=False), JogTube()
    first = tube.ahead(PLANNER, source, START, at_rest=True)
    again = tube.ahead(PLANNER, source, START, at_rest=True)
    assert first.ids.tolist() == again.ids.tolist()
    low = ARM.limits.position[1, 0]
    near = START.copy()
    near[1] = low + 0.01
    last = JogTube().ahead(PLANNER, source, near, at_rest=True)
    assert 0 < len(last) < len(first)


def test_another_key_lays_another_tube() -> None:
    tube = JogTube()
    one = tube.ahead(PLANNER, _source(0, 0.3, tool=False), START, at_rest=True)
    other = tube.ahead(PLANNER, _source(0, -0.3, tool=False), START, at_rest=True)
    assert set(one.ids.tolist()) & set(other.ids.tolist()) == {one.ids[0]}, "where both begin is one space"
