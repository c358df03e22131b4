"""The space in front of a jog holds what the jog does."""

import numpy as np
import pytest

from cell.geometry import capsule_distance
from cell.messages import JogFrame
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.space.jog_tube import JogTube
from robot_agent.trajectory import Limits
from robot_agent.trajectory.sources import JogSource, JogWish, JointAxes, States, ToolAxes
from robot_agent.workspace import ROOM_M, PlacedRobot, standing, sweep
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
    ("index", "speed", "tool"),
    [
        (0, 0.3, False),
        pytest.param(2, -0.3, False, marks=pytest.mark.soak),
        pytest.param(0, 0.25, True, marks=pytest.mark.soak),
        (4, 0.4, True),
    ],
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


@pytest.mark.parametrize("speed", [0.25, -0.25])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_a_robot_that_is_jogged_away_asks_for_nothing_nearer_than_where_it_stands(index: int, speed: float) -> None:
    """Else it could not be jogged away from one to which it may come no nearer."""
    stands = standing(ARM, np.eye(4), START, ROOM_M)
    in_its_way = ARM.forward(START)[:3, 3].astype(np.float32)
    in_its_way[index] -= 0.3 * np.sign(speed)
    ball = np.broadcast_to(in_its_way, (1, 1, 2, 3)), np.array([[0.05]])
    tube = JogTube().ahead(PLANNER, _source(index, speed, tool=True), START, at_rest=True)
    away = capsule_distance(tube.points, tube.radii, *ball).min(axis=1)
    assert away[0] >= capsule_distance(stands.points, stands.radii, *ball).min()
    assert (np.diff(away) > -1e-4).all()


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
    assert not set(one.ids.tolist()) & set(other.ids.tolist())
