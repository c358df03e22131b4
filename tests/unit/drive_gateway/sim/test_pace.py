"""Simulated drives that do not keep up say so, now and then; on a clock of the test's own."""

from drive_gateway.sim.pace import TELL_S, ComputingTime


def said(pace: ComputingTime, work_s: float, seconds: float, now: float = 0.0) -> list[str]:
    """Steps of 5 ms of simulated time, each takes `work_s` of the clock; the thread rests where time is left."""
    texts, end = [], now + seconds
    while now < end:
        begin, now = now, now + work_s
        texts.append(pace.worked(begin, now))
        now = max(now, begin + 0.005)
    return [text for text in texts if text]


def test_drives_that_leave_some_time_say_nothing() -> None:
    assert said(ComputingTime(), 0.004, 30.0) == []


def test_drives_that_take_longer_than_the_clock_say_so_once_in_a_while() -> None:
    texts = said(ComputingTime(), 0.008, 3.5 * TELL_S)
    assert len(texts) == 4
    assert "computing them took 100 % of the last 1.0 s" in texts[0]


def test_one_stall_of_the_host_is_no_lack_of_pace() -> None:
    pace = ComputingTime()
    assert said(pace, 0.001, 1.5) == []
    assert pace.worked(1.5, 1.9) == ""
    assert said(pace, 0.001, 3.0, now=1.9) == []
