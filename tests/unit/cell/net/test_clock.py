"""The cell clock on the own one: the truth is never outside its error, whatever the messages go through."""

from math import inf

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cell.net.clock import DRIFT, OtherClock

BEHIND_S = 990.0
DELAYS = st.one_of(st.just(0.0), st.floats(0.0, 0.01), st.floats(0.0, 3.0))
EXCHANGES = st.lists(
    st.tuples(st.floats(0.0, 1.5), DELAYS, DELAYS, DELAYS, st.floats(-DRIFT, DRIFT), st.booleans()), max_size=30
)
"""Each: time since the one before, way there, waiting there, way back, drift of the other clock, whether it answers."""


def truth(exchanges: list[tuple[float, float, float, float, float, bool]], now: float) -> float:
    """How far the other clock is ahead at `now`; its rate changes with each exchange."""
    ahead, at, rate = -BEHIND_S, 1000.0, 0.0
    for gap, *_, next_rate, _ in exchanges:
        until = min(now, at + gap)
        ahead, at, rate = ahead + rate * (until - at), until, next_rate
    return ahead + rate * (now - at)


@given(EXCHANGES, st.floats(0.0, 10.0))
@example([(0.0, 0.0, 0.0, 0.0, 0.0, True)], 0.0)
@example([(0.0, 0.0, 0.0, 0.0, -DRIFT, True), (1.5, 0.0, 0.0, 0.0, DRIFT, True)], 10.0)
@example([(0.0, 1.0, 0.0, 0.0, 0.0, True), (0.5, 0.0, 0.0, 1.0, 0.0, True)], 0.0)
def test_the_truth_is_within_the_error_whatever_the_delays(
    exchanges: list[tuple[float, float, float, float, float, bool]], later_s: float
) -> None:
    clock, sent, arrivals = OtherClock(), 1000.0, []
    for gap, there, waiting, back, _, answers in exchanges:
        sent += gap
        read = sent + there + waiting
        arrivals.append((read + back, read, sent if answers else -inf))
    heard = sorted(arrivals)
    for at, read, asked in heard:
        in_order = 1 + sorted(read for _, read, _ in heard).index(read)
        clock.heard("m", 1, in_order, read + truth(exchanges, read), at, at - asked)
        if clock.ahead_s is not None:
            assert abs(clock.ahead_s - truth(exchanges, at)) <= clock.error_s(at) + 1e-9
    now = max([1000.0, *(at for at, _, _ in heard)]) + later_s
    if clock.ahead_s is not None:
        assert abs(clock.ahead_s - truth(exchanges, now)) <= clock.error_s(now) + 1e-9


def test_the_error_is_the_shortest_round() -> None:
    clock = OtherClock()
    for number, round_s in enumerate((0.030, 0.004, 0.050)):
        at = 1000.0 + 0.05 * number
        clock.heard("m", 1, number, at - BEHIND_S, at, round_s)
    assert clock.error_s(1000.1) == pytest.approx(0.004, abs=2e-4)


def test_the_error_grows_with_the_silence() -> None:
    clock = OtherClock()
    clock.heard("m", 1, 1, 10.0, 1000.0, 0.004)
    assert clock.error_s(1010.0) == pytest.approx(0.004 + 10.004 * DRIFT)


def test_what_answers_nothing_says_nothing_of_the_error() -> None:
    clock = OtherClock()
    assert clock.error_s(1000.0) == inf
    clock.heard("m", 1, 1, 10.0, 1000.0)
    assert (clock.ahead_s, clock.error_s(1000.0)) == (-990.0, inf)


def test_the_next_manager_has_a_clock_of_its_own() -> None:
    clock = OtherClock()
    clock.heard("m", 1, 1, 10.0, 1000.0, 0.004)
    clock.heard("next", 2, 1, 0.0, 1000.1)
    assert (clock.ahead_s, clock.error_s(1000.1)) == (-1000.1, inf)
