"""Slow spaces: the motion is slowed so that the TCP keeps the speed inside, and goes as before outside."""

import numpy as np
import pytest

from cell.config.settings import PoseSettings, SpaceKind, SpaceSettings, SphereShape
from cell.messages import Enable, Mode
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import PlanFailed, Planned, PlanRequest
from robot_agent.language import Interpreter, MotionStep, Names, parse_program
from robot_agent.workspace import PlacedRobot, Spaces
from tests.unit.agent_runs import until
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.robot_agent.agent.operator.jog_key import Key, jog
from tests.unit.six_axis_arm import arm

ARM = arm()
SPEED_M_S = 0.1
MOVES = (
    "MJ J1=60",
    "MJ J1=30 J2=-3 R=50\nMJ J1=60",
    "MJ J1=5 J5=60\nML Y=800 F=1000",
    "MJ J1=15 J5=60\nML Y=900 R=100 F=9999\nML Z=1500",
    "MJ J1=60 J6=180 J4=40",
)


def slow(by_program: bool = False) -> SpaceSettings:
    """Around a place on the way."""
    x, y, z = ARM.forward(np.radians([25.0, 0, 0, 0, 40.0, 0]))[:3, 3].tolist()
    place = PoseSettings((x, y, z), (0.0, 0.0, 0.0, 1.0))
    return SpaceSettings(
        "door", SpaceKind.SLOW, SphereShape(0.25), place, 0.0, by_program=by_program, speed_m_s=SPEED_M_S
    )


def planned(program: str, *spaces: SpaceSettings) -> Planned | PlanFailed:
    interpreter, steps = Interpreter(parse_program(program, "p", Names(ARM.joint_names))), list[MotionStep]()
    while isinstance(step := interpreter.next(), MotionStep):
        steps.append(step)
    planner = Planner(PlacedRobot.at(ARM, spaces=Spaces(ARM, spaces)), 0.004)
    return planner.plan(PlanRequest(1, tuple(steps), np.array(ARM.home), ()))


def tcp_speeds(made: Planned) -> tuple[np.ndarray, np.ndarray]:
    """By differences of places at fine times: speed, and whether it is inside."""
    taus = np.arange(0.0, made.motion.duration_s, 1e-3)
    place = ARM.forward(made.motion.q(taus))[:, :3, 3]
    inside = np.linalg.norm(place - np.array(slow().pose.position_m), axis=-1) < 0.25
    return np.linalg.norm(np.diff(place, axis=0), axis=-1) / 1e-3, inside[:-1] & inside[1:]


@pytest.mark.parametrize("program", MOVES)
def test_the_tcp_keeps_the_speed_of_a_slow_space(program: str) -> None:
    free, made = planned(program), planned(program, slow())
    assert isinstance(free, Planned)
    assert isinstance(made, Planned), made
    speed, inside = tcp_speeds(free)
    assert speed[inside].max() > 2.0 * SPEED_M_S
    speed, inside = tcp_speeds(made)
    assert inside.any()
    assert speed[inside].max() <= SPEED_M_S * 1.001
    assert speed[inside].max() > 0.6 * SPEED_M_S


def test_a_move_outside_a_slow_space_is_as_fast_as_ever() -> None:
    program = "MJ J1=-60"
    free, made = planned(program), planned(program, slow())
    assert isinstance(free, Planned)
    assert isinstance(made, Planned)
    assert made.motion.duration_s == free.motion.duration_s


def test_a_slow_space_that_is_switched_off_slows_nothing() -> None:
    free, made = planned("MJ J1=60"), planned("SPACE door OFF\nMJ J1=60", slow(by_program=True))
    assert isinstance(free, Planned)
    assert isinstance(made, Planned)
    assert made.motion.duration_s == free.motion.duration_s


def test_a_jog_is_slow_inside_a_slow_space() -> None:
    world = AgentWorld("HOME", spaces=(slow(),))
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    Key(world, jog("J1", 0.3)).hold(6.0)
    place = ARM.forward(np.array(world.played))[:, :3, 3]
    inside = np.linalg.norm(place - np.array(slow().pose.position_m), axis=-1) < 0.25
    speed = np.linalg.norm(np.diff(place, axis=0), axis=-1) / CYCLE_S
    assert inside.sum() > 100
    assert speed[inside[1:] & inside[:-1]].max() <= SPEED_M_S * 1.001
    assert speed.max() > 2.0 * SPEED_M_S
