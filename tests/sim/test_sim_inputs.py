"""Enable inputs, guard doors and emergency-stop buttons at the drives: nothing switches on, everything stops."""

import numpy as np
import pytest

from cell.messages import AxisStatus, Claim, EnableDrives, Estop, Home, ResetDrives, SetpointBlock
from drive_gateway.config.settings import InputSettings
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, homing, settings

ENABLE, DOOR, BUTTON = 16, 18, 19
INPUTS = InputSettings(enable=(16, 17), door=(DOOR,), estop=(BUTTON,))
AXES = settings(axis("J1", 1, inputs=INPUTS, homing=homing(35, 0.5)), axis("J2", 2))


def bench() -> GatewayBench:
    world = GatewayBench(AXES)
    world.ready()
    return world


def moving() -> GatewayBench:
    world = bench()
    owner = world.enabled()
    s = np.arange(0.0, 2.0, CYCLE_S) / 2.0
    position = world.feedback.commanded + np.outer(s**3 * (10 - 15 * s + 6 * s**2), [1.0, 1.0])
    velocity = np.outer(15 * s**2 * (1 - s) ** 2, [1.0, 1.0])
    velocity[-1] = 0.0
    position[-1] = position[-2]
    world.tell(SetpointBlock("left", owner, 1, 0, world.feedback.tick + 5, CYCLE_S, len(s), position, velocity))
    world.run(0.8)
    assert world.feedback.block == 1
    return world


def enabling(world: GatewayBench) -> str:
    """Empty when the robot can be enabled after a reset, else why not."""
    owner = world.ask(Claim("left", "again", "d")).claim.owner
    reset = world.ask(ResetDrives("left", owner))
    reply = world.ask(EnableDrives("left", owner)) if reset.ok else reset
    return "" if reply.ok else reply.text


@pytest.mark.parametrize(
    ("bit", "found"),
    [
        (ENABLE, "node 1 (left J1): enable input (60FDh bit 16) is open, give the drive its enable input"),
        (DOOR, "node 1 (left J1): guard door (60FDh bit 18) is open, close the door"),
    ],
)
def test_nothing_is_enabled_or_homed_while_an_input_is_open(bit: int, found: str) -> None:
    world = bench()
    world.bus.nodes[1].set_input(bit, False)
    world.run(0.1)
    assert found in enabling(world)
    assert found in world.ask(Home("left", ("J1",))).text
    world.bus.nodes[1].set_input(bit, True)
    world.run(0.1)
    assert enabling(world) == ""


@pytest.mark.parametrize("bit", [ENABLE, DOOR])
def test_an_input_that_opens_in_motion_stops_all_axes_and_takes_their_voltage(bit: int) -> None:
    world = moving()
    world.bus.nodes[1].set_input(bit, False)
    world.run(1.2)
    stopped = [node.position for node in world.bus.nodes.values()]
    assert set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}
    world.bus.nodes[1].set_input(bit, True)
    world.run(1.0)
    assert [node.position for node in world.bus.nodes.values()] == stopped
    assert set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}
    assert enabling(world) == ""


def test_an_input_that_is_not_heard_any_more_counts_as_open() -> None:
    world = moving()
    world.lost = lambda frame: frame.id == 0x281
    world.run(0.3)
    assert "estop_open" in world.codes()
    assert any("is not heard" in event.text for event in world.events)


def test_a_button_stops_the_whole_cell_and_brakes_on_the_path_first() -> None:
    world = moving()
    world.bus.nodes[1].set_input(BUTTON, False)
    world.run(0.1)
    stop = world.estops[-1]
    assert stop.active
    assert "emergency-stop button (60FDh bit 19) is open" in stop.reason
    assert "drive_fault" not in world.codes()
    world.run(3.0)
    assert set(world.feedback.axes) == {AxisStatus.SWITCH_ON_DISABLED}


def test_a_stop_that_is_reset_while_the_button_is_pressed_is_set_anew() -> None:
    world = bench()
    world.bus.nodes[1].set_input(BUTTON, False)
    world.run(0.2)
    first = world.estops[-1]
    world.tell(Estop(first.id, False, "operator", "reset"))
    world.run(0.2)
    second = world.estops[-1]
    assert second.active
    assert second.id != first.id
    world.bus.nodes[1].set_input(BUTTON, True)
    world.run(0.2)
    world.tell(Estop(second.id, False, "operator", "reset"))
    world.run(0.2)
    assert world.estops[-1].id == second.id
    assert enabling(world) == ""
