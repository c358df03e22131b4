"""Runs of programs that switch the outputs glue and gripper."""

from cell.messages import Mode, Run
from tests.unit.agent_runs import enabled, until
from tests.unit.agent_world import AgentWorld

OUTPUTS = ("glue", "gripper")


def ready(program: str) -> AgentWorld:
    return enabled(program, outputs=OUTPUTS)


def begun(program: str) -> AgentWorld:
    world = ready(program)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def switched(world: AgentWorld) -> list[tuple[str, bool]]:
    return [(OUTPUTS[event.output], event.value) for _, event in world.switched]
