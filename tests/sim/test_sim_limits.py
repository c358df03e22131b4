"""Software limits of an axis: in the drive (607Dh), for blocks, and for what the drive does by itself."""

import numpy as np
import pytest

from cell.messages import MoveAxes, SetpointBlock
from drive_gateway.canopen.sdo import Sdo
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

LIMITS = (0.0, 1.5)


def bench() -> GatewayBench:
    world = GatewayBench(
        settings(axis("J1", 1, limits=LIMITS), axis("J2", 2, counts_per_unit=-80_000.0, limits=LIMITS))
    )
    world.ready()
    return world


def object_of(world: GatewayBench, node: int, sub: int) -> int:
    done = world.bus.sdo(Sdo("x", node, 0x607D, sub, None), world.now)
    return int.from_bytes(done.data, "little", signed=True)


def test_the_drive_gets_them_in_its_own_direction() -> None:
    world = bench()
    assert [object_of(world, 1, sub) for sub in (1, 2)] == [-25_000, 125_000]
    assert [object_of(world, 2, sub) for sub in (1, 2)] == [-100_000, 20_000]


def test_a_block_beyond_them_is_dropped_whole() -> None:
    world = bench()
    owner = world.enabled()
    t = np.arange(0.0, 3.0, CYCLE_S) / 3.0
    s = np.clip(t**3 * (10 - 15 * t + 6 * t**2), 0.0, 1.0)
    v = 30 * t**2 * (1 - t) ** 2 / 3.0
    position = world.feedback.commanded + np.outer(s, [1.1, 0.0])
    world.tell(
        SetpointBlock("left", owner, 1, 0, world.feedback.tick + 5, CYCLE_S, len(t), position, np.outer(v, [1.1, 0]))
    )
    world.run(0.1)
    assert world.feedback.refused == 1
    assert "axis J1 has a position beyond its limits" in world.events[-1].text


@pytest.mark.parametrize("target", [-0.05, 1.6])
def test_a_set_up_move_beyond_them_is_refused(target: float) -> None:
    reply = bench().ask(MoveAxes("left", {"J2": target}, False, 0.5, False))
    assert not reply.ok
    assert f"J2 would go to {np.degrees(target):.6g} deg; allowed are 0 to 85.9437" in reply.text


@pytest.mark.parametrize("shift", [-1_000_000, 1_000_000])
def test_limits_of_another_machine_that_a_drive_kept_are_replaced(shift: int) -> None:
    world = bench()
    for sub, value in [(1, -(2**31)), (2, 125_000 + shift), (1, -25_000 + shift)]:
        write = Sdo("x", 1, 0x607D, sub, value.to_bytes(4, "little", signed=True))
        assert not world.bus.sdo(write, world.now).problem
    world.restart_gateway()
    world.ready()
    assert [object_of(world, 1, sub) for sub in (1, 2)] == [-25_000, 125_000]
