"""Runs of a program through a space that an input switches: opened, closed, halted, slowed and backed up at any moment.

What is judged is what was sent, block by block with each ramp, and what was played.
"""

import random
from collections.abc import Callable

import numpy as np
from scipy.spatial import cKDTree

from cell.config.settings import PoseSettings, SpaceKind, SpaceSettings, SphereShape
from cell.messages import Continue, Enable, Halt, Mode, Run, SetOverride
from robot_agent.workspace import solid_of
from tests.unit.agent_runs import ended, until
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.six_axis_arm import arm

ARM = arm()
ROUND = "MJ J1=60 F=50\nHOME\nEND"
_CURVED = "MJ J1=60 F=50\nMJ J1=20 J2=-20 J3=30 J5=60 F=60\nML Y=200 F=9999\nHOME\nEND"
"""A line of the TCP among its moves: no two places on it are on a straight way of the joints."""
MOVING = np.array([capsule.link > 0 for capsule in ARM.body])
OFF_PATH_RAD = 1e-5
"""What a robot sends of a planned motion is nowhere farther from it, in any joint."""
BRAKED_S = 0.6
"""After an input has opened, a robot stands inside, or in front of what it switches."""
_CHANGES = 8
_FINE_S = 0.001


def ball(off_while: str | None = None, by_program: bool = False) -> SpaceSettings:
    """Around where the flange is half-way of J1's move from home to 60 degrees."""
    x, y, z = ARM.forward(ARM.home + np.radians([30.0, 0, 0, 0, 0, 0]))[:3, 3].tolist()
    place = PoseSettings((x, y, z), (0.0, 0.0, 0.0, 1.0))
    return SpaceSettings(
        "gate", SpaceKind.FORBIDDEN, SphereShape(0.05), place, 0.005, by_program=by_program, off_while=off_while
    )


GATE = ball("door")


def gaps(world: AgentWorld, space: SpaceSettings = GATE) -> np.ndarray:
    """Of everything played, less the margin."""
    points = ARM.capsules(np.array(world.played))[:, MOVING]
    distance = solid_of(space.shape, space.pose).capsule_distance(points, ARM.capsule_radii[MOVING])
    return np.asarray(distance.min(axis=-1) - space.margin_m)


def begun(inputs: dict[str, bool | None] | None, program: str = ROUND, space: SpaceSettings = GATE) -> AgentWorld:
    world = AgentWorld(program, spaces=(space,))
    world.inputs = inputs
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def run(seed: int) -> tuple[AgentWorld, np.ndarray]:
    """A whole run, and how long the door was open at each tick that was played [s], 0 while it is closed."""
    rng = random.Random(seed)
    world, opened = begun({"door": True}, _CURVED), list[float]()

    def on(until_: Callable[[], bool], seconds: float) -> None:
        for _ in range(round(seconds / (5 * CYCLE_S))):
            if until_():
                return
            world.step()
            closed = bool(world.inputs and world.inputs["door"])
            for _ in range(len(world.played) - len(opened)):
                opened.append(0.0 if closed else (opened[-1] if opened else 0.0) + CYCLE_S)

    for _ in range(_CHANGES):
        on(lambda: False, rng.uniform(0.1, 1.2))
        match rng.randrange(4):
            case 0:
                world.call(Halt())
            case 1:
                world.call(SetOverride(float(rng.choice([-100, -40, 20, 60, 100]))))
            case _:
                world.inputs = {"door": rng.random() < 0.5}
                world.call(Continue())
    world.inputs = {"door": True}
    world.call(SetOverride(100.0))
    on(lambda: world.state.mode is not Mode.RUNNING or ended(world)(), 5.0)
    world.call(Continue())
    on(ended(world), 20.0)
    return world, np.array(opened)


def off_path(world: AgentWorld) -> float:
    """How far anything that was sent is from all planned motions: the farthest joint [rad]."""
    sent = np.unique(np.concatenate([block.position for block in world.blocks]).round(12), axis=0)
    ways = [
        motion.q(np.linspace(0.0, motion.duration_s, 2 + int(motion.duration_s / _FINE_S)))
        for motion in (planned.motion for planned in world.planned)
    ]
    starts, ends = np.concatenate([q[:-1] for q in ways]), np.concatenate([q[1:] for q in ways])
    _, near = cKDTree((starts + ends) / 2.0).query(sent, k=8)
    way, away = (ends - starts)[near], sent[:, None] - starts[near]
    squares = np.maximum(np.einsum("...k,...k", way, way), 1e-30)
    share = np.clip(np.einsum("...k,...k", away, way) / squares, 0.0, 1.0)
    beside = np.abs(away - share[..., None] * way).max(axis=-1)
    return float(beside.min(axis=-1).max())


def broken(seed: int) -> str:
    """What is wrong in a run, empty for nothing."""
    world, opened = run(seed)
    gap = gaps(world)
    moves = np.append(False, np.abs(np.diff(np.array(world.played), axis=0)).max(axis=-1) > 1e-9)
    inside = np.flatnonzero(moves & (gap < 0.0) & (opened[: len(gap)] > BRAKED_S))
    if len(inside):
        return f"the robot moves in a space whose input is open for {opened[inside[0]]:.2f} s"
    if (away := off_path(world)) > OFF_PATH_RAD:
        return f"what is sent is {away:.1e} rad beside the path that was looked at"
    if not ended(world)():
        return f"the program does not end: {world.state.mode.value}, {world.state.waiting_for}"
    return ""
