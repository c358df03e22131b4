"""What drives tell only when they are asked: current and temperature, read beside the cycle and never in its way."""

from dataclasses import replace

import pytest

from cell.messages import MoveAxes
from drive_gateway.config.settings import TemperatureSettings
from drive_gateway.gateway.drives.gauge import MISSES
from tests.sim.gateway_bench import GatewayBench, axis, settings
from tests.sim.heavy_arm import MOTOR, HeavyArm

MOTOR_TEMPERATURE = TemperatureSettings((0x2003, 0), 2, True, 0.1)


def asked(world: GatewayBench, node: int) -> list[int]:
    """Indices that were read by frames of the gateway, beside the dialogues."""
    data = [frame.data for frame in world.frames if frame.id == 0x600 + node and frame.data[0] == 0x40]
    return [int.from_bytes(each[1:3], "little") for each in data]


@pytest.mark.parametrize("direction", [1, -1])
def test_the_current_that_is_told_is_the_one_that_carries_the_arm(direction: int) -> None:
    world = HeavyArm("torque", direction=direction)
    world.switch_on()
    for _ in range(150):
        world.stand()
        world.run(0.01)
    assert world.state is not None
    servo = world.bus.nodes[1].drives[0].servo
    carried = direction * servo.torque_nm / MOTOR.torque_constant_nm_a
    assert abs(carried) > 0.5
    assert world.state.nodes[0].current_a == pytest.approx(carried, rel=0.05)


def test_a_motor_that_was_heated_is_told_as_hot() -> None:
    world = HeavyArm("torque")
    arm = replace(world.settings.robots["left"].axes[0], temperature=MOTOR_TEMPERATURE)
    world.settings.robots["left"] = replace(world.settings.robots["left"], axes=(arm,))
    world.restart_gateway()
    world.ready()
    world.run(3.0)
    assert world.state is not None
    assert world.state.nodes[0].temperature_c == pytest.approx(20.0, abs=2.0)
    world.bus.nodes[1].drives[0].servo.warm()
    world.run(3.0)
    assert world.state.nodes[0].temperature_c == pytest.approx(136.0, abs=2.0)


def test_drives_without_a_known_motor_are_asked_a_few_times_and_tell_nothing() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2)))
    world.ready()
    world.run(10.0)
    assert (asked(world, 1), asked(world, 2)) == ([0x6075] * MISSES, [0x6075] * MISSES)
    assert world.state is not None
    assert [node.current_a for node in world.state.nodes] == [None, None]


def test_nothing_is_read_of_a_robot_whose_drives_move_by_themselves() -> None:
    axes = (axis("J1", 1, temperature=MOTOR_TEMPERATURE), axis("J2", 2, temperature=MOTOR_TEMPERATURE))
    world = GatewayBench(settings(*axes))
    world.ready()
    reply = world.ask(MoveAxes("left", {"J1": 1.5}, relative=True, speed=1.0, by_velocity=False))
    assert reply.ok, reply.text
    world.holder = world.robot
    world.run(0.1)
    world.frames.clear()
    world.run(2.0)
    assert world.said[1] == "moving"
    assert (asked(world, 1), asked(world, 2)) == ([], [])
    world.until(lambda: world.said[1] == "done")
    world.run(2.0)
    assert 0x2003 in asked(world, 1)
