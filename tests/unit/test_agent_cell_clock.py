"""The cell clock on an agent's own clock: from messages that are late by unknown times."""

import random

import numpy as np
import pytest

from cell.messages import AxisStatus, CellTime, DriveFeedback, ManagerState, PlayoutState
from robot_agent.agent.cell_clock import CellClock

CYCLE_S = 0.004
BEHIND_S = 990.0
"""The manager's clock is so far behind the agent's."""


def state(sequence: int, cell_time: float, boot: str = "m") -> ManagerState:
    return ManagerState("c", boot, 1, sequence, cell_time, "digest")


def feedback(tick: int) -> DriveFeedback:
    none = np.zeros(1)
    return DriveFeedback(
        "left", "g", tick, tick, 1, 0, PlayoutState.PLAYING, 0, 0, True, True, none, none, none,
        (AxisStatus.OPERATION_ENABLED,),
    )  # fmt: skip


def clock(seed: int = 0, late_s: float = 0.004) -> CellClock:
    """Two seconds of messages, each late by its own time; ticks are counted from own time 1000."""
    rng, heard = random.Random(seed), CellClock()
    for k in range(40):
        at = 1000.0 + 0.05 * k
        heard.heard_state(state(k, at - BEHIND_S), at + rng.expovariate(1.0 / late_s))
    for tick in range(0, 500, 5):
        heard.heard_feedback(feedback(tick), CYCLE_S, 1000.0 + tick * CYCLE_S + rng.expovariate(1.0 / late_s))
    return heard


@pytest.mark.parametrize("seed", range(5))
def test_it_knows_cell_time_as_exactly_as_the_least_delayed_message(seed: int) -> None:
    left_s = clock(seed).until(CellTime("m", 12.0), 1002.0)
    assert left_s == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("seed", range(5))
def test_a_start_is_the_first_tick_at_or_behind_its_moment(seed: int) -> None:
    tick = clock(seed, late_s=1e-4).start_tick(CellTime("m", 13.002), 1002.0, CYCLE_S)
    assert tick == 751


def test_a_start_in_the_past_or_too_soon_is_refused_with_the_time_that_is_missing() -> None:
    heard = clock(late_s=1e-4)
    assert "0.50 s in the past" in str(heard.start_tick(CellTime("m", 11.5), 1002.0, CYCLE_S))
    assert "only 0.10 s ahead" in str(heard.start_tick(CellTime("m", 12.1), 1002.0, CYCLE_S))


def test_the_clock_of_another_manager_says_nothing() -> None:
    heard = clock()
    heard.heard_state(state(0, 0.5, "next"), 1003.0)
    assert heard.until(CellTime("m", 12.0), 1003.0) is None
    assert heard.until(CellTime("next", 1.5), 1003.0) == pytest.approx(1.0)
    heard.heard_state(state(99, 50.0, "m"), 1003.1)
    assert heard.until(CellTime("m", 50.0), 1003.1) is None
    assert "that this robot does not hear" in str(heard.start_tick(CellTime("m", 60.0), 1003.1, CYCLE_S))
