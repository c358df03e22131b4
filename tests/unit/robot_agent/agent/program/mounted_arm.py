"""An arm whose tools and parts reach far: what it may mount, and how a test asks it to."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from cell.config.settings import PoseSettings, SphereShape, ThingSettings
from cell.messages import Enable, Mode, Presence, ProgramState, Reply, SetTool
from robot_agent.kinematics import SixAxis
from robot_agent.model import Part, Tool
from robot_agent.model.description import Capsule, Mounted
from tests.unit.agent_runs import until
from tests.unit.agent_world import ZONE, AgentWorld
from tests.unit.robot_families import TORCH
from tests.unit.six_axis_arm import description

NO_INERTIA = np.zeros((3, 3))
GRIPPER = Tool("gripper", np.eye(4), 0.0, (0.0, 0.0, 0.0), NO_INERTIA, (Capsule((0, 0, 0), (0.1, 0, 0), 0.04),))
ROD = Part("rod", 3.0, (0.3, 0.0, 0.0), NO_INERTIA, (Capsule((0.0, 0.0, 0.0), (0.6, 0.0, 0.0), 0.05),))
PLATE = Part("plate", 8.0, (0.0, 0.2, 0.0), NO_INERTIA, (Capsule((0.0, -0.4, 0.0), (0.0, 0.4, 0.0), 0.03),))
BARE = SixAxis(
    replace(
        description(), tools={"gripper": GRIPPER}, mounted=Mounted(("gripper",)), parts={"rod": ROD, "plate": PLATE}
    )
)
"""The arm of the tests with two parts."""
PICK = "MJ J1=10\nATTACH rod\nMJ J1=20\nDETACH\nMJ J1=30\nEND"
LANCE = Tool(
    "lance", TORCH.pose_flange_tcp, 4.0, (0.3, 0.0, 0.0), NO_INERTIA, (Capsule((0.0, 0.0, 0.0), (0.6, 0.0, 0.0), 0.05),)
)
"""As long as the rod of the parts, and its TCP is turned against the flange."""
ARM = SixAxis(replace(BARE.description, tools={"gripper": GRIPPER, "lance": LANCE}, parts={}))
CHANGE = "MJ J1=10\nT=lance\nMJ J1=20\nT=NONE\nMJ J1=30\nT=gripper\nEND"
FAR_IN = np.radians([0.0, 50.0, -25.0, 0.0, 30.0, 0.0])
FAR_OUT = np.radians([0.0, -20.0, 30.0, 0.0, 60.0, 0.0])


def holding(part: str, arm: SixAxis = BARE) -> SixAxis:
    return SixAxis(replace(arm.description, mounted=replace(arm.description.mounted, parts=(part,) if part else ())))


def answer(world: AgentWorld, command: object) -> Reply:
    call = world.call(command)  # type: ignore[arg-type]
    until(world, lambda: call in world.replies)
    return world.replies[call]


def failed(world: AgentWorld) -> Callable[[], bool]:
    return lambda: world.state.program.state is ProgramState.FAILED


def capsules(presence: Presence) -> int:
    return len(presence.body.radii_m)


def pole(may_touch: tuple[str, ...] = ()) -> ThingSettings:
    """Where the end of the rod comes by when J1 turns from 10 to 20 degrees, clear of everything else."""
    x, y, z, _ = (holding("rod").forward(np.radians([15.0, 0, 0, 0, 0, 0])) @ [0.6, 0.0, 0.0, 1.0]).tolist()
    there = PoseSettings((x, y, z), (0.0, 0.0, 0.0, 1.0))
    return ThingSettings("pole", SphereShape(0.05), there, 0.005, {"left": may_touch})


def in_front_of_zone() -> str:
    """Joints at which the rod reaches into the zone and the rest of the robot does not, as what follows MJ."""
    border = ZONE.position_m[0] - ZONE.size_m[0] / 2.0

    def front(model: SixAxis, q: np.ndarray) -> float:
        return float((model.capsules(q)[..., 0].max(axis=-1) + model.capsule_radii).max())

    for share in np.linspace(0.0, 1.0, 101):
        q = FAR_OUT + share * (FAR_IN - FAR_OUT)
        if front(holding("rod"), q) > border + 0.05 and front(BARE, q) < border - 0.1:
            return " ".join(f"J{n}={value:.3f}" for n, value in enumerate(np.degrees(q), 1))
    raise AssertionError("no such place")


def ready(program: str, tool: str = "gripper", arm: SixAxis = ARM, **world_has: object) -> AgentWorld:
    """An enabled robot, and an operator who has said which tool is mounted; empty: nobody has."""
    world = AgentWorld(program, arm=arm, **world_has)  # type: ignore[arg-type]
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    if tool:
        assert answer(world, SetTool(tool)).ok
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    return world
