"""A robot follows a belt in the whole cell on a bad network; whatever becomes of its agent, it ends at rest."""

from pathlib import Path

import numpy as np

from cell.messages import CellTime, ConveyorCount
from tests.sim.invariants import Invariants
from tests.sim.operator import PatientOperator
from tests.sim.scenario import WORSE
from tests.sim.world import World, load_bundle

CELL = Path(__file__).parents[2] / "cell_configs" / "belt" / "cell.yaml"
MEASURED_EVERY_S = 0.02
COUNTS_PER_S = 500
PART_COUNTS = 1000


def measure(world: World) -> None:
    """What the encoder sends, over the same bad network."""
    manager = world.seen.manager
    if manager is not None:
        at = CellTime(manager.boot, world.processes["manager"].core._cell_time(world.hosts["manager"].now))
        counts = round(COUNTS_PER_S * world.clock.now) % 2**32
        world.publish(ConveyorCount("belt", at, counts, counts - counts % PART_COUNTS), "encoder")
    world.clock.after(MEASURED_EVERY_S, lambda: measure(world))


def speed_m_s(world: World) -> float:
    """Of the robot along the belt, as its drives are commanded."""
    before = world.models["left"].forward(world.seen.feedback["left"].commanded)[1, 3]
    world.clock.run_until(world.clock.now + 0.1)
    return float((world.models["left"].forward(world.seen.feedback["left"].commanded)[1, 3] - before) / 0.1)


def line(world: World) -> int:
    state = world.seen.robots.get("left")
    return 0 if state is None else state.program.line


def told(world: World) -> list[str]:
    return [event.code for event in world.seen.events]


def test_a_robot_on_a_belt_goes_with_it_and_rests_when_its_agent_dies() -> None:
    world = World(load_bundle(CELL), 1, WORSE)
    invariants = Invariants(world, planned=False)
    PatientOperator(world)
    measure(world)
    assert world.clock.run_until(world.clock.now + 30.0, lambda: line(world) == 5)
    assert abs(speed_m_s(world) - 0.05) < 0.01
    world.network.cut("encoder", "*", 1.0)
    assert world.clock.run_until(world.clock.now + 1.0, lambda: "correction" in told(world))
    assert world.clock.run_until(world.clock.now + 5.0, lambda: abs(speed_m_s(world) - 0.05) < 0.01)
    world.kill("robot/left")
    world.clock.run_until(world.clock.now + 1.0)
    rest = world.seen.feedback["left"].commanded
    world.clock.run_until(world.clock.now + 0.2)
    np.testing.assert_array_equal(world.seen.feedback["left"].commanded, rest)
    invariants.check_at_rest()
