"""A robot whose program goes to points in frames: where they are counts when a motion is planned."""

import math

import numpy as np

from cell.config.points_file import JointPoint, PosePoint
from cell.geometry import to_xyz_abc
from cell.messages import Enable, FramePose, Mode, ProgramState, Run
from robot_agent.language import Points
from tests.unit.agent_runs import ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.six_axis_arm import arm

ARM = arm()
UPRIGHT = (0.0, 0.0, 0.0, 1.0)
ABOVE = tuple(math.radians(value) for value in (0.0, 0.0, 20.0, 0.0, 40.0, 0.0))
ASIDE = "".join(f"MJ J1={angle}\nWAIT 0.1\n" for angle in (3, -3, 3, 0))
"""More than the agent looks ahead."""
ROUNDS = f"LABEL again\nMJ P=above\nML P=pick F=500\nMJ P=above\n{ASIDE}GOTO again 1\nEND"


def table(version: int, x_m: float) -> FramePose:
    return FramePose("table", version, None, (x_m, 0.0, 0.0), UPRIGHT)


def taught() -> Points:
    """`above`, and `pick` 100 mm below it in the frame `table`, which was at X = 1 m."""
    x, y, z, a, b, c = to_xyz_abc(ARM.forward(np.array(ABOVE))).tolist()
    return Points({"above": JointPoint(ABOVE), "pick": PosePoint((x - 1.0, y, z - 0.1), (a, b, c), "table")})


def running(points: Points, program: str = ROUNDS) -> AgentWorld:
    world = AgentWorld(program, points=points)
    world.frames = (table(7, 1.0),)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    return world


def lowest(world: AgentWorld, since: int) -> np.ndarray:
    """Where the flange was lowest since that sample [m]."""
    places = ARM.forward(np.array(world.played[since:]))[:, :3, 3]
    return places[places[:, 2].argmin()]


def test_a_frame_that_moves_between_two_rounds_takes_the_next_round_along() -> None:
    world = running(taught())
    until(world, lambda: world.state.program.line == 5)
    first, round_ends = lowest(world, 0), len(world.played)
    assert world.state.frames == {"table": 7}
    world.frames = (table(8, 1.05),)
    until(world, ended(world))
    second = lowest(world, round_ends)
    np.testing.assert_allclose(second - first, (0.05, 0.0, 0.0), atol=1e-5)


def test_what_is_planned_already_keeps_the_place_of_the_frame() -> None:
    world = running(taught(), "MJ P=above\nML P=pick F=500\nEND")
    until(world, lambda: len(world.planned) == 2)
    world.frames = (table(8, 1.05),)
    until(world, ended(world))
    place = ARM.forward(world.played[-1])[:3, 3]
    np.testing.assert_allclose(place, ARM.forward(np.array(ABOVE))[:3, 3] - (0.0, 0.0, 0.1), atol=1e-5)


def test_nothing_is_planned_before_the_manager_has_said_where_the_frame_is() -> None:
    world = AgentWorld(ROUNDS, points=taught())
    world.run(0.5)
    call = world.call(Enable())
    world.run(0.1)
    assert "the manager has not said yet where frame table is" in world.replies[call].text


def test_a_point_that_is_gone_ends_the_program_where_it_comes_to_it() -> None:
    points = taught()
    world = running(points, f"MJ P=above\n{ASIDE}ML P=pick F=500")
    until(world, lambda: world.state.program.line == 1)
    points.named = {"above": points.named["above"]}
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    assert world.state.program.error == "no point pick in the points file any more, but only above"
