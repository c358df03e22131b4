"""A round of tangential moves without an end, and what is seen of a robot on it."""

import numpy as np

from robot_agent.agent.planning.plans import Extended
from tests.unit.agent_world import CYCLE_S, AgentWorld

TO_START = "MJ J1=0 J2=-12 J3=65 J4=0 J5=37 J6=0\nML X=1000 Y=-10 Z=1350 A=0 B=90 C=0 F=9999\n"
ROUND = """ML Y=10 F=300
MC QY=45.355 QZ=1364.645 Y=60 Z=1400 F=300
MC QY=45.355 QZ=1435.355 Y=10 Z=1450 F=300
ML Y=-10 F=300
MC QY=-45.355 QZ=1435.355 Y=-60 Z=1400 F=300
MC QY=-45.355 QZ=1364.645 Y=-10 Z=1350 F=300
"""


def extensions(world: AgentWorld) -> list[Extended]:
    return [planned for planned in world.planned if isinstance(planned, Extended)]


def speeds(world: AgentWorld) -> np.ndarray:
    places = world.planner.model.forward(np.array(world.played))[:, :3, 3]
    return np.asarray(np.linalg.norm(np.diff(places, axis=0), axis=1) / CYCLE_S)
