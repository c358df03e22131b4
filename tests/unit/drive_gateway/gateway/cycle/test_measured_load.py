"""The load of the bus is what was on it in a second; too much of it is told, once in a while and not at boot."""

from cell.messages import Severity
from drive_gateway.gateway.bus.bus_news import BusTraffic
from tests.unit.gateway_world import CYCLE_S, World


def carry(world: World, bits_per_cycle: int, seconds: float, before: int = 0) -> int:
    """The bus carries so many bits in each cycle; answers the bits since the start."""
    for _ in range(round(seconds / CYCLE_S)):
        before += bits_per_cycle
        world.tell(BusTraffic(before))
        world.cycle()
    return before


def test_the_measured_load_is_the_share_of_the_newest_second_and_above_the_budget_a_warning() -> None:
    world = World()
    carried = carry(world, 3600, 1.004)  # 90 %, while the nodes are brought up: no reason to warn
    # 2 nodes at 4 ms take 13 %, 10 % are kept free.
    carried = carry(world, 800, 2.5, carried)
    assert abs(world.state.counters.measured_load - 0.2) < 0.005
    assert "bus_load" not in world.codes()
    carry(world, 1100, 2.1, carried)
    (warning,) = [event for event in world.events if event.code == "bus_load"]
    assert warning.severity is Severity.WARNING
    assert "what is configured takes 13 %" in warning.text
