"""A robot of two axes in the middle of a move that outlasts whatever is done to it."""

from dataclasses import replace

import numpy as np

from cell.messages import SetpointBlock
from drive_gateway.config.settings import GatewaySettings
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

LAYOUTS = [
    replace(
        settings(axis("J1", 1), axis("J2", node, number=number, counts_per_unit=-80_000.0)),
        boot_timeout_s=0.4,
    )
    for node, number in ((2, 1), (1, 2))
]
"""Two axes on a node each, and both on one."""
MOVE_S = 5.0


def moving(layout: GatewaySettings = LAYOUTS[0]) -> GatewayBench:
    """All axes are on their way; their agent is never heard again."""
    world = GatewayBench(layout)
    world.until(lambda: world.state is not None and world.state.ready and world.feedback is not None)
    world.run(0.12)
    owner = world.enabled()
    s = np.arange(0.0, MOVE_S + CYCLE_S / 2, CYCLE_S) / MOVE_S
    way = np.array([4.5, -4.0])
    position = world.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), way)
    velocity = np.outer(30 * s**2 * (1 - s) ** 2 / MOVE_S, way)
    first = world.feedback.tick + 5
    world.tell(SetpointBlock("left", owner, 1, 0, first, CYCLE_S, len(s), position, velocity))
    world.until(lambda: world.feedback.block == 1)
    return world


def places(world: GatewayBench) -> list[float]:
    """[counts] where every axis really is."""
    return [drive.position for node in world.bus.nodes.values() for drive in node.drives]
