"""An endless axis: its drive counts within one turn, the gateway goes on counting."""

from math import tau

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from cell.messages import MoveAxes, SetpointBlock
from drive_gateway.canopen.sdo import Sdo
from drive_gateway.config.settings import EncoderSettings
from drive_gateway.sim.config.simulation import Simulation
from drive_gateway.sim.drives.position_bounds import PositionRange
from drive_gateway.sim.services.dictionary import key_of
from tests.sim.gateway_bench import CYCLE_S, GatewayBench, axis, settings
from tests.unit.gateway_world import START

TURN = 20_000
"""[counts]"""


def bench(direction: int = 1, **changes: object) -> GatewayBench:
    """J1 turns without end; its drive begins 3 degrees before the end of a turn."""
    start = direction * tau * (1 - 3 / 360)
    turntable = axis("J1", 1, modulus=TURN, counts_per_unit=direction * TURN / tau, offset=0.0, **changes)
    world = GatewayBench(
        settings(turntable, axis("J2", 2)), Simulation(starts={("left", "J1"): start, ("left", "J2"): START})
    )
    world.ready()
    return world


def shown(world: GatewayBench, index: int, sub: int = 0) -> int:
    done = world.bus.sdo(Sdo("x", 1, index, sub, None), world.now)
    return int.from_bytes(done.data, "little", signed=True)


def test_the_drive_is_told_its_turn_and_shows_it() -> None:
    world = bench()
    assert (shown(world, 0x607B, 1), shown(world, 0x607B, 2)) == (0, TURN - 1)


@pytest.mark.parametrize("direction", [1, -1])
def test_blocks_turn_an_axis_over_the_end_of_its_turn_without_a_jump(direction: int) -> None:
    world = bench(direction)
    owner = world.enabled()
    start = world.feedback.commanded.copy()
    t = np.arange(0.0, 4.0 + CYCLE_S / 2, CYCLE_S) / 4.0
    way = np.outer(t**3 * (10 - 15 * t + 6 * t**2), [direction * 4.0, 0.0])
    speed = np.outer(30 * t**2 * (1 - t) ** 2 / 4.0, [direction * 4.0, 0.0])
    first = world.feedback.tick + 5
    world.tell(SetpointBlock("left", owner, 1, 0, first, CYCLE_S, len(t), start + way, speed))
    seen = []
    while world.feedback.tick < first + len(t) + 30:
        world.cycle()
        seen.append(world.feedback.position[0])
    assert world.feedback.position[0] == pytest.approx(start[0] + direction * 4.0, abs=2 * tau / TURN)
    assert np.abs(np.diff(seen)).max() < 2.1 * CYCLE_S
    assert 0 <= shown(world, 0x6064) < TURN
    assert world.feedback.enabled
    assert not [code for code in world.codes() if code in ("following_error", "drive_fault")]


@pytest.mark.parametrize(("distance", "by_velocity"), [(0.5, False), (-0.5, False), (4.0, True)])
def test_a_drive_moves_over_the_end_of_its_turn_by_its_own_profile(distance: float, by_velocity: bool) -> None:
    world = bench()
    start = world.feedback.position[0]
    assert world.set_up(MoveAxes("left", {"J1": distance}, relative=True, by_velocity=by_velocity, speed=1.0)) == "done"
    assert world.feedback.position[0] == pytest.approx(start + distance, abs=0.01)


def test_a_way_of_half_a_turn_or_more_is_refused_because_the_drive_would_take_the_shorter_one() -> None:
    world = bench()
    reply = world.ask(MoveAxes("left", {"J1": 3.2}, relative=True, by_velocity=False, speed=1.0))
    assert not reply.ok
    assert "J1 would turn by 183.346 deg; allowed is less than half a turn" in reply.text


def test_after_a_restart_of_the_gateway_the_axis_stands_within_one_turn() -> None:
    world = bench()
    assert world.set_up(MoveAxes("left", {"J1": 0.5}, relative=True, by_velocity=False, speed=1.0)) == "done"
    assert world.feedback.position[0] > tau
    world.alive = False
    world.run(0.5)
    world.restart_gateway()
    world.ready()
    assert world.feedback.position[0] == pytest.approx(0.5 - tau * 3 / 360, abs=0.01)


def test_an_absolute_encoder_is_compared_within_the_turn() -> None:
    world = bench(absolute=EncoderSettings(counts_per_turn=TURN // 20, window=20))
    assert world.set_up(MoveAxes("left", {"J1": 4.0}, relative=True, by_velocity=True, speed=1.0)) == "done"
    world.run(1.0)
    turns = world.stored["left.J1"].turns
    assert 0 <= turns < 20
    world.alive = False
    world.run(0.5)
    world.restart_gateway()
    world.ready()
    assert "not_referenced" not in world.codes()
    world.enabled()


@given(counts=st.integers(-(10**12), 10**12), to=st.integers(-(10**12), 10**12), modulus=st.integers(2, 2**31 - 1))
@hypothesis_settings(max_examples=60, deadline=None)
def test_gateway_and_drive_agree_on_the_turn_nearest_to_a_place(counts: int, to: int, modulus: int) -> None:
    turntable = axis("J1", 1, modulus=modulus)
    found = turntable.nearest(counts, to)
    assert (found - counts) % modulus == 0
    assert 2 * abs(found - to) <= modulus
    ends = PositionRange({key_of(0x607B, 1): 0, key_of(0x607B, 2): modulus - 1})
    assert ends.shown(counts) == turntable.wrapped(counts)
    assert abs(ends.nearest(counts, to) - to) == abs(found - to)
