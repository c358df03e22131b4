"""The velocity of each sample as the drive's feed-forward: in a PDO of its own, and gone with the motion."""

import numpy as np
import pytest

from cell.messages import SetpointBlock
from drive_gateway.canopen.frame import CanFrame
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings

SPEED = 0.5
RAMP_S, RUN_S = 0.4, 1.0


def running(feed_forward: bool) -> GatewayBench:
    """Both axes run with `SPEED`, in opposite counts."""
    axes = [axis("J1", 1), axis("J2", 2, counts_per_unit=-80_000.0)]
    world = GatewayBench(
        settings(
            *(axis(a.name, a.node_id, counts_per_unit=a.counts_per_unit, velocity_offset=feed_forward) for a in axes)
        )
    )
    world.ready()
    owner = world.enabled()
    t = np.arange(0.0, 2 * RAMP_S + RUN_S + CYCLE_S / 2, CYCLE_S)
    v = SPEED * np.clip(np.minimum(t, t[-1] - t) / RAMP_S, 0.0, 1.0)
    s = np.concatenate([[0.0], np.cumsum(0.5 * (v[1:] + v[:-1]) * CYCLE_S)])
    position = world.feedback.commanded + s[:, None]
    block = SetpointBlock(
        "left", owner, 1, 0, world.feedback.tick + 5, CYCLE_S, len(t), position, np.tile(v[:, None], 2)
    )
    world.tell(block)
    world.run(RAMP_S + 0.5 * RUN_S)
    return world


def lag_s(world: GatewayBench) -> float:
    """Of the first axis behind its demand, at constant speed."""
    return abs(world.bus.nodes[1].servo.error) / 100_000.0 / SPEED


def offsets(world: GatewayBench, node: int) -> list[int]:
    return [int.from_bytes(frame.data, "little", signed=True) for frame in world.frames if frame.id == 0x300 + node]


def test_the_axis_follows_without_its_lag() -> None:
    assert lag_s(running(False)) == pytest.approx(0.008, rel=0.01)
    assert lag_s(running(True)) < 1e-5


def test_the_offset_is_the_samples_velocity_in_counts_and_zero_where_nothing_moves() -> None:
    world = running(True)
    assert offsets(world, 1)[0] == 0
    assert (offsets(world, 1)[-1], offsets(world, 2)[-1]) == (50_000, -40_000)
    world.until(lambda: world.feedback.level == 0)
    world.run(0.2)
    assert offsets(world, 1)[-1] == 0
    assert world.feedback.state.name == "STARVED"


def test_it_comes_before_the_command_of_the_same_cycle() -> None:
    world = running(True)
    of_node = [frame.id for frame in world.frames[-20:] if frame.id in (0x201, 0x301)]
    first = of_node.index(0x301)
    assert of_node[first : first + 2] == [0x301, 0x201]


def test_pdos_that_are_not_used_are_taken_off_the_bus() -> None:
    world = GatewayBench(settings(axis("J1", 1)))
    world.ready()
    numbers = world.bus.nodes[1].objects.numbers
    unused = (0x1401, 0x1402, 0x1403, 0x1801, 0x1802, 0x1803)
    assert all(numbers[index << 8 | 1] >> 31 for index in unused)
    node = world.bus.nodes[1]
    assert node.receive(CanFrame(0x301, bytes(4)), world.now) == []
