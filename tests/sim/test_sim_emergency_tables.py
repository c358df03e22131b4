"""What an emergency of a real drive says: its maker's own meaning, and no error where there is none."""

from drive_gateway.canopen.emcy import Meaning
from drive_gateway.canopen.frame import CanFrame
from tests.sim.gateway_bench import GatewayBench, axis, settings

OWN = {0xFF01: Meaning("pump of the cooling stands", "look at the pump")}


def test_a_code_of_the_makers_own_stops_the_robot_with_its_meaning_and_remedy() -> None:
    world = GatewayBench(settings(axis("J1", 1, emergencies=OWN), axis("J2", 2)))
    world.ready()
    world.enabled()
    world.tell(CanFrame(0x081, bytes.fromhex("01ff810000000000")))
    world.until(lambda: "emergency" in world.codes())
    [event] = [event for event in world.events if event.code == "emergency"]
    assert "FF01h: pump of the cooling stands" in event.text
    assert event.remedy == "look at the pump"


def test_an_emergency_whose_high_byte_is_zero_is_no_trouble() -> None:
    world = GatewayBench(settings(axis("J1", 1), axis("J2", 2)))
    world.ready()
    world.enabled()
    world.tell(CanFrame(0x081, bytes.fromhex("1000000000000000")))
    world.run(0.5)
    assert world.feedback.enabled
    assert "emergency" not in world.codes()
