"""A drive whose positions come late: its following error is that of the sample which they answer."""

import numpy as np
import pytest

from cell.messages import SetpointBlock
from drive_gateway.config.settings import DELAY_CYCLES
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

LATE_CYCLES = 4
WAY = 0.7
SECONDS = 1.0


def after_a_move(delay_cycles: int) -> GatewayBench:
    """J1 is measured `LATE_CYCLES` later than J2, and the file says `delay_cycles` of it; both move alike."""
    window = {"following_window": 0.024, "following_time_s": 0.01}
    world = GatewayBench(settings(axis("J1", 1, delay_cycles=delay_cycles, **window), axis("J2", 2, **window)))
    world.ready()
    owner = world.enabled()
    world.bus.nodes[1].delay_tpdos(LATE_CYCLES * CYCLE_S)
    world.run(0.1)
    u = np.arange(0.0, SECONDS, CYCLE_S) / SECONDS
    way = np.outer(u**3 * (10 - 15 * u + 6 * u**2), [WAY, WAY])
    speed = np.outer(30 * u**2 * (1 - u) ** 2 / SECONDS, [WAY, WAY])
    way[-1], speed[-1] = WAY, 0.0
    start = world.feedback.commanded.copy()
    world.tell(SetpointBlock("left", owner, 1, 0, world.feedback.tick + 5, CYCLE_S, len(u), start + way, speed))
    world.run(SECONDS + 0.2)
    return world


def test_with_its_delay_declared_a_late_drive_follows_as_well_as_the_others() -> None:
    world = after_a_move(DELAY_CYCLES + LATE_CYCLES)
    late, prompt = (node.following_error for node in world.state.nodes)
    assert late == pytest.approx(prompt, rel=0.01)
    assert prompt == pytest.approx(world.simulation.lag_s * 1.875 * WAY / SECONDS, rel=0.05)
    assert "following_error" not in world.codes()


def test_without_it_the_delay_counts_as_a_following_error() -> None:
    assert "following_error" in after_a_move(DELAY_CYCLES).codes()
