"""Runs of programs that wait for inputs."""

from collections.abc import Callable

import numpy as np

from cell.messages import Mode, Run
from tests.unit.agent_runs import at_rest, enabled, until
from tests.unit.agent_world import AgentWorld

WAITS = "MJ J1=20\nWAIT DI part\nMJ J1=0\nEND"


def begun(program: str, outputs: tuple[str, ...] = (), **inputs: bool | None) -> AgentWorld:
    world = enabled(program, outputs=outputs)
    world.inputs = dict(inputs)
    world.run(0.1)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def waits(world: AgentWorld, line: int = 2) -> Callable[[], bool]:
    return lambda: at_rest(world)() and world.state.program.line == line and world.state.program.waits_s is not None


def told(world: AgentWorld, **inputs: bool | None) -> None:
    """From now on the gateway tells other inputs."""
    world.inputs = {**(world.inputs or {}), **inputs}


def j1(world: AgentWorld) -> float:
    return float(np.degrees(world.commanded[0]))
