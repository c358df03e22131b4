"""`drive-gateway fault` in mid-motion: the gateway orders over the bus, the drive fails, an operator gets it back."""

import pytest

from cell.messages import AxisStatus, Claim, EnableDrives, Fault, FaultDrive, ResetDrives
from drive_gateway.config.settings import GatewaySettings
from tests.sim.gateway_bench import GatewayBench
from tests.sim.long_move import LAYOUTS, moving


def recovered(world: GatewayBench) -> None:
    owner = world.ask(Claim("left", "after", "d")).claim.owner
    for command in (ResetDrives("left", owner), EnableDrives("left", owner)):
        reply = world.ask(command)
        assert reply.ok, reply.text
    world.run(0.1)
    assert set(world.feedback.axes) == {AxisStatus.OPERATION_ENABLED}


def test_a_node_that_is_told_to_drop_out_confirms_it_is_missed_and_comes_back_by_itself() -> None:
    world = moving()
    reply = world.ask(FaultDrive(2, 1, Fault.DROP_OUT, seconds=1.0))
    assert reply.ok, reply.text
    world.until(lambda: "tpdo_silent" in world.codes(), within_s=0.2)
    late = world.ask(FaultDrive(2, 1, Fault.BLOCKED))
    assert not late.ok
    assert "node 2 (left J2) was not told to fail" in late.text
    world.run(1.0)
    world.until(lambda: world.state is not None and world.state.ready)
    world.run(0.12)
    recovered(world)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_the_axis_that_was_named_fails_also_where_a_node_has_two(layout: GatewaySettings) -> None:
    world = moving(layout)
    second = layout.robots["left"].axes[1]
    assert world.ask(FaultDrive(second.node_id, second.number, Fault.EMERGENCY, 0x5112)).ok
    world.run(0.5)
    assert [axis.emergency_code for axis in world.state.nodes] == [None, 0x5112]
    recovered(world)
