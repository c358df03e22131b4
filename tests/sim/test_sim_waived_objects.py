"""Drives that lack optional objects, and drives that stop in another way: brought up as the drives file allows it."""

import pytest

from cell.messages import Claim, EnableDrives, ResetDrives
from drive_gateway.canopen.sdo import Sdo, SdoDone
from tests.sim.gateway_bench import GatewayBench, axis, settings

NO_OBJECT = 0x06020000
OPTIONAL = (0x1016, 0x6007, 0x605A, 0x6065, 0x6066, 0x60C2)


def world_without(index: int, *waived: int) -> GatewayBench:
    """Two axes; the drive of J1 has no object at `index`."""
    world = GatewayBench(settings(axis("J1", 1, waived=frozenset(waived)), axis("J2", 2)))
    answered = world.bus.sdo

    def answer(request: Sdo, now: float) -> SdoDone:
        if (request.node_id, request.index) == (1, index):
            return SdoDone(request.request_id, b"", NO_OBJECT, "abort")
        return answered(request, now)

    world.bus.sdo = answer  # type: ignore[method-assign]
    return world


@pytest.mark.parametrize("index", OPTIONAL)
def test_a_drive_without_a_waived_object_is_brought_up_and_what_that_costs_is_told(index: int) -> None:
    world = world_without(index, index)
    world.ready()
    told = [event.text for event in world.events if event.code == "object_missing"]
    assert len(told) == 1
    assert told[0].startswith(f"node 1 (left J1) has no {index:04X}h (")


@pytest.mark.parametrize("waived", [(), (0x6007,)])
def test_a_drive_without_an_object_that_is_not_waived_is_refused(waived: tuple[int, ...]) -> None:
    world = world_without(0x605A, *waived)
    world.until(lambda: world.state is not None and world.state.problem != "")
    assert "refused write of 605Ah:00" in world.state.problem


def test_a_waived_object_that_the_drive_has_is_written_and_nothing_is_told() -> None:
    world = world_without(0x2F00, 0x6007)
    world.ready()
    assert "object_missing" not in world.codes()
    asked = [request.data for request in world.requests if request.index == 0x6007 and request.node_id == 1]
    assert asked == [b"\x03\0", None]


def status(world: GatewayBench) -> list[str]:
    return [node.drive.name for node in world.state.nodes]


def reset_and_enable(world: GatewayBench) -> None:
    claim = world.ask(Claim("left", "a2", "d")).claim
    assert claim is not None
    assert world.ask(ResetDrives("left", claim.owner)).ok
    assert world.ask(EnableDrives("left", claim.owner)).ok


def test_a_quick_stop_that_ends_without_voltage_is_reset_and_enabled_again() -> None:
    world = GatewayBench(settings(axis("J1", 1, quick_stop_option=2), axis("J2", 2)))
    world.ready()
    world.enabled()
    world.bus.nodes[2].raise_emergency(0x4310)
    world.until(lambda: status(world) == ["SWITCH_ON_DISABLED", "FAULT"])
    world.run(0.5)
    reset_and_enable(world)


def test_drives_that_answer_a_lost_gateway_by_a_fault_are_reset_and_enabled_again() -> None:
    world = GatewayBench(settings(axis("J1", 1, connection_lost=1), axis("J2", 2)))
    world.ready()
    world.enabled()
    world.alive = False
    world.run(0.5)
    world.restart_gateway()
    world.ready()
    assert status(world)[0] == "FAULT"
    reset_and_enable(world)
