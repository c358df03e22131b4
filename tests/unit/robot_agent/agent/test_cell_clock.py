"""The cell clock on an agent's own clock: from messages that are late by unknown times."""

import random

import numpy as np
import pytest

from cell.config.settings import Times
from cell.messages import (
    AxisStatus,
    CellTime,
    DriveFeedback,
    Heard,
    ManagerState,
    Mode,
    PlayoutState,
    ProgramState,
    Run,
)
from cell.net.freshness import Sent
from robot_agent.agent.cell_clock import CellClock
from tests.unit.agent_runs import enabled, ended, until

CYCLE_S = 0.004
BEHIND_S = 990.0
"""The manager's clock is so far behind the agent's."""


def state(sequence: int, cell_time: float, boot: str = "m", epoch: int = 1) -> ManagerState:
    return ManagerState("c", boot, epoch, sequence, cell_time, "digest", {"left": Heard("a", sequence)})


def feedback(tick: int) -> DriveFeedback:
    none = np.zeros(1)
    return DriveFeedback(
        "left", "g", tick, tick, 1, 0, PlayoutState.PLAYING, 0, 0, True, True, none, none, none,
        (AxisStatus.OPERATION_ENABLED,),
    )  # fmt: skip


def clock(seed: int = 0, late_s: float = 0.004, answers_s: float = 0.005) -> CellClock:
    """Two seconds of messages, each late by its own time; ticks are counted from own time 1000.

    Each state answers a presence that was sent `answers_s` before it.
    """
    rng, sent = random.Random(seed), Sent("a")
    heard = CellClock("left", sent, 0.05)
    heard.ticks_last(CYCLE_S)
    for k in range(40):
        at = 1000.0 + 0.05 * k
        sent.record(k, at - answers_s)
        heard.arrived(state(k, at - BEHIND_S), at + rng.expovariate(1.0 / late_s))
    for tick in range(0, 500, 5):
        heard.arrived(feedback(tick), 1000.0 + tick * CYCLE_S + rng.expovariate(1.0 / late_s))
    return heard


@pytest.mark.parametrize("seed", range(5))
def test_it_knows_cell_time_as_exactly_as_the_least_delayed_message(seed: int) -> None:
    left_s = clock(seed).until(CellTime("m", 12.0), 1002.0)
    assert left_s == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_a_start_is_the_first_tick_at_or_behind_its_moment(seed: int) -> None:
    tick = clock(seed, late_s=1e-4).start_tick(CellTime("m", 13.002), 1002.0)
    assert tick == 751


def test_a_start_in_the_past_or_too_soon_is_refused_with_the_time_that_is_missing() -> None:
    heard = clock(late_s=1e-4)
    assert "0.50 s in the past" in str(heard.start_tick(CellTime("m", 11.5), 1002.0))
    assert "only 0.10 s ahead" in str(heard.start_tick(CellTime("m", 12.1), 1002.0))


@pytest.mark.parametrize("seconds", [1e308, -1e308, float("inf"), float("nan"), 12.0 + 3601.0])
def test_a_start_beyond_the_next_hour_is_refused_with_what_is_allowed(seconds: float) -> None:
    refusal = clock(late_s=1e-4).start_tick(CellTime("m", seconds), 1002.0)
    assert isinstance(refusal, str)
    assert "allowed is" in refusal
    assert len(refusal) < 150


@pytest.mark.parametrize("lasting_s", [1e308, float("nan"), float("inf"), 0.0, -1.0, 3601.0])
def test_a_first_motion_that_shall_last_longer_than_an_hour_or_not_at_all_is_refused(lasting_s: float) -> None:
    world = enabled("MJ J1=20\nEND")
    world.run(0.5)
    id = world.call(Run(CellTime("m", world.now + 1.0), lasting_s))
    world.step()
    assert not world.replies[id].ok
    assert "at most 3600" in world.replies[id].text
    assert world.state.mode is Mode.READY


def test_the_clock_of_another_manager_says_nothing() -> None:
    heard = clock()
    heard.arrived(state(0, 0.5, "next", 2), 1003.0)
    assert heard.until(CellTime("m", 12.0), 1003.0) is None
    assert heard.until(CellTime("next", 1.5), 1003.0) == pytest.approx(1.0)
    heard.arrived(state(99, 50.0, "m"), 1003.1)
    assert heard.until(CellTime("m", 50.0), 1003.1) is None
    assert "that this robot does not hear" in str(heard.start_tick(CellTime("m", 60.0), 1003.1))


def test_robots_with_motions_of_different_length_begin_and_end_with_the_same_ticks() -> None:
    ticks = []
    for program in ("MJ J1=20 F=90", "MJ J1=60 J2=-20 F=90"):
        world = enabled(program)
        start = len(world.played)
        world.call(Run(CellTime("m", world.now + 1.0), lasting_s=3.0))
        until(world, ended(world))
        moving = np.flatnonzero(np.any(np.diff(world.played[start:], axis=0), axis=1))
        ticks.append((moving[0], moving[-1]))
    (begin, end), other = ticks
    assert other[0] == begin
    assert other[1] == pytest.approx(end, abs=2)
    assert (end - begin) * CYCLE_S == pytest.approx(3.0, abs=0.02)


def test_a_robot_that_cannot_begin_in_time_does_not_begin_and_says_why() -> None:
    world = enabled("MJ J1=20")
    stood = world.commanded
    world.call(Run(CellTime("m", world.now + 0.5)))
    world.lose_blocks = True
    world.run(0.2)
    assert world.state.waiting_for == "the common start, in 0.3 s"
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    world.lose_blocks = False
    world.run(0.5)
    assert world.state.program.error.startswith(
        "the common start was missed: the robot was held up; order it again, and where it is missed again begin the "
        "programs one after the other, this one by `cell run left`"
    )
    np.testing.assert_array_equal(world.commanded, stood)


def test_it_tells_cell_time_and_how_far_it_may_be_wrong() -> None:
    status = clock(late_s=1e-4).status(1002.0)
    assert status is not None
    assert status.offset_s == pytest.approx(-BEHIND_S, abs=1e-3)
    assert 0.005 <= status.error_s <= 0.0075


def test_a_start_by_a_clock_that_is_known_too_badly_is_refused_with_the_numbers() -> None:
    refusal = str(clock(late_s=1e-4, answers_s=0.08).start_tick(CellTime("m", 13.0), 1002.0))
    assert refusal.startswith("no common start: cell time is known to within 8")
    assert "ms only, allowed are 50 ms (times: clock_error_s)" in refusal


def test_a_robot_tells_its_clock_and_refuses_a_common_start_by_a_bad_one() -> None:
    world = enabled("MJ J1=20\nEND")
    assert world.state.clock is not None
    assert 0.0 <= world.state.clock.error_s < 0.03
    strict = enabled("MJ J1=20\nEND", times=Times(clock_error_s=0.001))
    call = strict.call(Run(CellTime("m", strict.now + 1.0)))
    strict.step()
    assert "allowed are 1 ms" in strict.replies[call].text
    assert strict.state.mode is Mode.READY
