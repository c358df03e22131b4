"""How a simulated drive stops: each option code of CiA 402 by its braking way, v^2 / (2 a), and where it ends."""

import pytest

from drive_gateway.sim.drives.power_state import DriveState as S
from tests.unit.sim_drive_world import COUNTS, QUICK_STOP, Bench, Refused

SPEED = 1.5 * COUNTS
SLOW = QUICK_STOP // 3
"""[counts/s^2] profile deceleration (6084h)."""
HARDEST = 2 * QUICK_STOP
"""Of the holding brake, and at the current limit."""


def moving(index: int, option: int) -> Bench:
    bench = Bench()
    bench.prepare()
    bench.write(0x6084, 0, SLOW, 4)
    bench.write(index, 0, option, 2)
    bench.enable()
    bench.drive(0.3, SPEED)
    return bench


def way(bench: Bench) -> float:
    """[counts] from here to standstill."""
    start = bench.node.position
    bench.wait(0.5)
    return bench.node.position - start


@pytest.mark.parametrize(
    ("index", "option", "word", "deceleration", "state"),
    [
        (0x605A, 0, 0x02, HARDEST, S.SWITCH_ON_DISABLED),
        (0x605A, 1, 0x02, SLOW, S.SWITCH_ON_DISABLED),
        (0x605A, 2, 0x02, QUICK_STOP, S.SWITCH_ON_DISABLED),
        (0x605A, 3, 0x02, HARDEST, S.SWITCH_ON_DISABLED),
        (0x605A, 5, 0x02, SLOW, S.QUICK_STOP_ACTIVE),
        (0x605A, 6, 0x02, QUICK_STOP, S.QUICK_STOP_ACTIVE),
        (0x605A, 7, 0x02, HARDEST, S.QUICK_STOP_ACTIVE),
        (0x605B, 0, 0x06, HARDEST, S.READY_TO_SWITCH_ON),
        (0x605B, 1, 0x06, SLOW, S.READY_TO_SWITCH_ON),
        (0x605C, 0, 0x07, HARDEST, S.SWITCHED_ON),
        (0x605C, 1, 0x07, SLOW, S.SWITCHED_ON),
    ],
)
def test_a_command_stops_as_its_option_says(index: int, option: int, word: int, deceleration: float, state: S) -> None:
    bench = moving(index, option)
    bench.write(0x6040, 0, word, 2)
    assert way(bench) == pytest.approx(SPEED**2 / (2 * deceleration), rel=0.02)
    assert bench.node.state is state


@pytest.mark.parametrize(
    ("option", "deceleration"), [(0, HARDEST), (1, SLOW), (2, QUICK_STOP), (3, HARDEST)], ids=lambda value: str(value)
)
def test_a_fault_stops_as_605e_says(option: int, deceleration: float) -> None:
    bench = moving(0x605E, option)
    bench.node.raise_emergency(0x4310)
    assert bench.node.state is (S.FAULT if option == 0 else S.FAULT_REACTION_ACTIVE)
    assert way(bench) == pytest.approx(SPEED**2 / (2 * deceleration), rel=0.02)
    assert bench.node.state is S.FAULT


@pytest.mark.parametrize(("option", "deceleration"), [(1, SLOW), (2, QUICK_STOP), (3, HARDEST)])
def test_halt_stops_as_605d_says(option: int, deceleration: float) -> None:
    bench = Bench()
    bench.prepare(x6060_0=3)
    bench.write(0x6084, 0, SLOW, 4)
    bench.write(0x605D, 0, option, 2)
    bench.write(0x6083, 0, HARDEST, 4)
    bench.write(0x60FF, 0, round(SPEED), 4)
    bench.enable()
    bench.wait(0.5)
    bench.write(0x6040, 0, 0x010F, 2)
    lag = SPEED * 0.02
    assert way(bench) == pytest.approx(SPEED**2 / (2 * deceleration), abs=lag)
    assert bench.node.state is S.OPERATION_ENABLED


def test_an_enabled_drive_that_slows_down_to_be_disabled_may_be_called_back() -> None:
    bench = moving(0x605C, 1)
    bench.write(0x6040, 0, 0x07, 2)
    bench.wait(0.004)
    assert bench.node.state is S.OPERATION_ENABLED
    bench.write(0x6040, 0, 0x0F, 2)
    bench.wait(0.004)
    assert bench.node.state is S.OPERATION_ENABLED
    bench.drive(0.2, 0.0)
    assert bench.node.state is S.OPERATION_ENABLED


def test_an_option_that_cia_402_does_not_have_is_refused() -> None:
    bench = Bench()
    bench.prepare()
    with pytest.raises(Refused, match="06090030"):
        bench.write(0x605A, 0, 4, 2)
