"""The ticks at which an agent switches outputs, and where its robot is at them."""

import numpy as np

from tests.unit.agent_world import AgentWorld

FIRST_TICK = 2
"""Of the first sample in `AgentWorld.played`."""


def ticks(world: AgentWorld) -> list[int]:
    return [tick for tick, _ in world.switched]


def j1(world: AgentWorld) -> np.ndarray:
    return np.degrees(np.array(world.played)[:, 0])


def reached(world: AgentWorld, *places: float) -> list[int]:
    """The first ticks at which J1 is at or after places [deg]."""
    return [int(np.argmax(j1(world) >= place - 1e-6)) + FIRST_TICK for place in places]


def after(world: AgentWorld, place: float) -> bool:
    """Whether J1 is commanded to be behind a place [deg]."""
    return bool(np.degrees(world.commanded[0]) > place)
