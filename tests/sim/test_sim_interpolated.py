"""Blocks in interpolated position (mode 7), for drives without cyclic synchronous position."""

import numpy as np
import pytest

from cell.messages import DisableDrives, EnableDrives, MoveAxes, SetpointBlock
from drive_gateway.canopen.sdo import Sdo
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings


def bench() -> GatewayBench:
    world = GatewayBench(settings(axis("J1", 1, interpolated=True), axis("J2", 2)))
    world.ready()
    return world


def shown(world: GatewayBench, index: int, sub: int = 0) -> int:
    done = world.bus.sdo(Sdo("x", 1, index, sub, None), world.now)
    return int.from_bytes(done.data, "little", signed=True)


def test_a_maker_may_have_a_number_of_its_own_for_linear_interpolation() -> None:
    world = GatewayBench(settings(axis("J1", 1, interpolated=True, interpolation=-2), axis("J2", 2)))
    world.ready()
    assert shown(world, 0x60C0) == -2


def words(world: GatewayBench) -> list[int]:
    return [int.from_bytes(frame.data[:2], "little") for frame in world.frames if frame.id == 0x201]


def test_set_points_go_to_the_interpolation_data_and_the_axis_follows_them() -> None:
    world = bench()
    assert (shown(world, 0x6061), shown(world, 0x60C0), shown(world, 0x1600, 2)) == (7, 0, 0x60C10120)
    owner = world.enabled()
    start = world.feedback.commanded
    s = np.arange(0.0, 1.0 + CYCLE_S / 2, CYCLE_S)
    position = start + np.outer(s**3 * (10 - 15 * s + 6 * s**2), [0.4, 0.4])
    velocity = np.outer(30 * s**2 * (1 - s) ** 2, [0.4, 0.4])
    world.tell(SetpointBlock("left", owner, 1, 0, world.feedback.tick + 5, CYCLE_S, len(s), position, velocity))
    world.until(lambda: world.feedback.block == 1 and world.feedback.level == 0)
    world.run(0.2)
    assert world.feedback.position == pytest.approx(start + 0.4, abs=2e-5)
    assert shown(world, 0x60C1, 1) == round((start[0] + 0.4 - 0.25) * 100_000)


def test_the_interpolation_is_enabled_with_operation_and_not_before() -> None:
    world = bench()
    owner = world.enabled()
    used = words(world)
    assert 0x1F in used
    assert used.index(0x0F) < used.index(0x1F)
    assert not any(word & 0x10 for word in used[: used.index(0x0F)])
    assert world.ask(DisableDrives("left", owner)).ok
    assert not words(world)[-1] & 0x10


def test_a_drive_that_hears_no_set_point_stops_by_itself() -> None:
    world = bench()
    world.enabled()
    world.lost = lambda frame: frame.id == 0x201
    world.run(0.3)
    assert "drive_fault" in world.codes() or "emergency" in world.codes()


def test_a_set_up_move_works_and_the_axis_goes_back_to_its_mode() -> None:
    world = bench()
    assert world.set_up(MoveAxes("left", {"J1": 0.1, "J2": 0.1}, True, 1.0, False)) == "done"
    assert world.feedback.position == pytest.approx([0.6, 0.6], abs=1e-3)
    world.run(0.2)
    assert shown(world, 0x6061) == 7
    assert world.enabled()
    assert world.ask(EnableDrives("left", world.feedback.owner)).ok
