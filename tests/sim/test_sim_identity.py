"""A node with another drive than the file says is not configured, and is named."""

from drive_gateway.config.settings import IdentitySettings
from tests.sim.gateway_bench import GatewayBench, axis, settings


def test_the_right_drive_is_brought_up() -> None:
    world = GatewayBench(settings(axis("J1", 7, identity=IdentitySettings(0, 0x402, 0x10000, 7))))
    world.ready()


def test_another_drive_is_named_with_what_it_shows_and_gets_no_parameters() -> None:
    world = GatewayBench(settings(axis("J1", 7, identity=IdentitySettings(product=0x403))))
    world.until(lambda: world.state is not None and world.state.problem != "")
    assert world.state.problem == (
        "node 7 (left J1) is another drive: product code (1018h:02) is 402h, the drives file says 403h; "
        "connect the right one, or correct the file"
    )
    world.run(5.0)
    assert not world.state.ready
    assert not any(request.data for request in world.requests)
