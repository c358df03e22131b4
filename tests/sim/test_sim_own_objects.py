"""Objects of a drive's own are written before it is switched on, read back, and have their effect."""

from drive_gateway.canopen.sdo import Sdo, SdoDone
from drive_gateway.config.settings import OwnObject
from tests.sim.gateway_bench import GatewayBench, axis, settings

PATIENCE = OwnObject(0x2000, 0, "set-point time-out", b"\x04")
"""Interpolation periods without a set point that are a fault of a simulated drive."""


def test_the_time_out_of_set_points_is_written_at_boot_and_read_back() -> None:
    world = GatewayBench(settings(axis("J1", 1, objects=(PATIENCE,)), axis("J2", 2)))
    world.ready()
    own = [(request.node_id, request.data) for request in world.requests if request.index == 0x2000]
    assert own == [(1, b"\x04"), (1, None)]
    shown = [world.bus.sdo(Sdo("", node, 0x2000, 0, None), world.now).data for node in (1, 2)]
    assert shown == [b"\x04", b"\x06"]


def test_a_drive_that_keeps_another_value_is_not_brought_up_and_is_told_with_what_it_shows() -> None:
    world = GatewayBench(settings(axis("J1", 1, objects=(PATIENCE,))))
    answered = world.bus.sdo
    world.bus.sdo = lambda request, now: (  # type: ignore[method-assign]
        SdoDone(request.request_id, b"\x03") if request.index == 0x2000 else answered(request, now)
    )
    world.until(lambda: world.state is not None and world.state.problem != "")
    assert "was told 2000h:00 (set-point time-out) as 4 and still shows 3 after 1 s" in world.state.problem


def test_an_object_that_can_only_be_written_is_not_read() -> None:
    once = OwnObject(0x2000, 0, "set-point time-out", b"\x04", readable=False)
    world = GatewayBench(settings(axis("J1", 1, objects=(once,))))
    world.ready()
    assert [request.data for request in world.requests if request.index == 0x2000] == [b"\x04"]
