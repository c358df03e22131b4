"""A gateway and drives whose emergencies mean less than a fault, come too often, or end in another way."""

import pytest

from drive_gateway.canopen.emcy import Meaning
from tests.sim.gateway_bench import GatewayBench, axis, settings
from tests.sim.unkind.traits.emergency import EMERGENCY

TRAITS = {trait.name: trait for trait in EMERGENCY}
GOES_ON = {0x8110: Meaning("CAN overrun", "look at the bus load", stops=False)}


def bench(trait: str) -> GatewayBench:
    world = GatewayBench(settings(axis("J1", 1, emergencies=GOES_ON), axis("J2", 2)))
    TRAITS[trait].give(world.bus.nodes[1])
    world.ready()
    return world


@pytest.mark.parametrize("trait", ["error_passive_goes_on", "overrun_that_stays", "error_reset_at_start"])
def test_a_robot_goes_on_with_a_drive_that_goes_on(trait: str) -> None:
    world = bench(trait)
    world.enabled()
    world.run(5.0)
    assert world.feedback is not None
    assert world.feedback.enabled
    assert "emergency" not in world.codes()
    assert world.codes().count("drive_warning") == (trait != "error_reset_at_start")


def test_an_overrun_whose_bits_stay_is_shown_until_the_node_starts_anew() -> None:
    world = bench("overrun_that_stays")
    world.run(3.0)
    assert world.state is not None
    assert world.state.nodes[0].emergency_code == 0x8110


def test_a_storm_stops_the_robot_and_does_not_fill_the_log() -> None:
    world = bench("emergency_storm")
    world.enabled()
    world.until(lambda: "emergency" in world.codes())
    world.run(25.0)
    assert world.codes().count("emergency") == 3
    assert "times more in 10 s" in [event.text for event in world.events if event.code == "emergency"][-1]
