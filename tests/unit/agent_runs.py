"""Runs of one agent: programs, and how a test brings its robot to a place in them."""

from collections.abc import Callable

import numpy as np

from cell.config.settings import OnManagerReturn, Times
from cell.messages import Enable, Mode, ProgramState, Run
from tests.unit.agent_world import STEP_S, AgentWorld

SHORT = "MJ J1=20 J2=-20 J3=30 J5=60 F=60\nML Y=200 F=9999\nHOME\nEND"
INTO_ZONE = "MJ J2=-20 J3=30 J5=60\nMJ J2=50 J3=-25 J5=30 F=50\nMJ J2=-20 J3=30 J5=60\nEND"
TO_START, INTO, BACK = INTO_ZONE.splitlines()[:3]


def enabled(
    program: str,
    on_manager_return: OnManagerReturn = OnManagerReturn.CONTINUE,
    outputs: tuple[str, ...] = (),
    times: Times | None = None,
) -> AgentWorld:
    world = AgentWorld(program, on_manager_return, times=times)
    world.outputs = outputs
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    return world


def running(
    program: str, on_manager_return: OnManagerReturn = OnManagerReturn.CONTINUE, times: Times | None = None
) -> AgentWorld:
    world = enabled(program, on_manager_return, times=times)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def until(world: AgentWorld, done: Callable[[], bool], seconds: float = 30.0) -> None:
    for _ in range(round(seconds / STEP_S)):
        if done():
            return
        world.step()
    raise AssertionError(f"not reached in {seconds} s; state {world.states[-1:]}")


def ended(world: AgentWorld) -> Callable[[], bool]:
    return lambda: world.state.program.state is ProgramState.DONE


def at_rest(world: AgentWorld) -> Callable[[], bool]:
    return lambda: len(world.played) > 10 and not np.any(np.diff(world.played[-10:], axis=0))


def near_zone() -> str:
    """A place 0.25 s in front of the zone, as what follows MJ."""
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: len(world.planned) >= 2)
    motion, (crossing, *_) = world.planned[1].motion, world.planned[1].crossings
    joints = np.degrees(motion.q(np.array(crossing.enter_tau - 0.25)))
    return " ".join(f"J{number}={value:.3f}" for number, value in enumerate(joints, 1))
