"""One axis' rest, and NMT stop of a node: what counts as standing, for how long silence counts as motion."""

from dataclasses import replace

from drive_gateway.canopen.nmt import NmtState
from drive_gateway.gateway.drives.rest import AxisRest
from drive_gateway.gateway.nodes.network_stop import NetworkStop
from tests.unit.gateway_world import axis, gateway_settings

SETTINGS = gateway_settings()
SILENT_S = 0.2 + 0.1 + 0.02 + 2.0 * 1.2 * 3.0 / 40.0
"""Heartbeat time-out, measured rest, a late cycle, and twice the braking from 1.2 times the speed."""


def fed(rest: AxisRest, counts: list[int], began: float = 10.0) -> float:
    """One measurement per cycle; answers when the last one was."""
    for number, count in enumerate(counts):
        rest.take(count, began + 0.004 * number)
    return began + 0.004 * (len(counts) - 1)


def test_an_axis_stands_when_it_was_measured_within_its_window_for_a_tenth_of_a_second() -> None:
    rest = AxisRest(axis("J1", 1), SETTINGS)
    fed(rest, [500, 539] * 12)
    assert not rest.standing
    fed(rest, [500, 539] * 2, began=10.096)
    assert rest.standing
    fed(rest, [541], began=10.112)
    assert not rest.standing


def test_a_drive_that_hunts_stands_within_the_window_of_its_axis() -> None:
    hunting = [500, 605] * 14
    rest = AxisRest(axis("J1", 1), SETTINGS)
    fed(rest, hunting)
    assert not rest.standing
    rest = AxisRest(axis("J1", 1, rest_window=6e-4), SETTINGS)
    fed(rest, hunting)
    assert rest.standing


def test_time_without_measurements_is_no_rest() -> None:
    rest = AxisRest(axis("J1", 1), SETTINGS)
    rest.take(500, 10.0)
    rest.take(900, 11.0)
    assert not rest.standing


def test_silence_counts_as_motion_until_the_drive_must_have_stopped_by_itself() -> None:
    rest = AxisRest(axis("J1", 1), SETTINGS)
    fed(rest, [500] * 30)
    rest.silent(11.0)
    rest.silent(11.0 + SILENT_S - 0.001)
    assert not rest.standing
    rest.silent(11.0 + SILENT_S + 0.001)
    assert rest.standing


def test_the_silence_of_an_axis_that_did_not_stop_is_never_rest_but_its_measurement_is() -> None:
    rest = AxisRest(axis("J1", 1), SETTINGS)
    fed(rest, list(range(0, 3000, 100)))
    rest.distrust()
    for second in range(11, 60):
        rest.silent(second)
    assert not rest.standing
    rest.heard()
    fed(rest, [500] * 30, began=60.0)
    assert rest.standing
    rest.silent(61.0)
    rest.silent(61.0 + SILENT_S + 0.001)
    assert rest.standing


def test_slower_brakes_and_later_cycles_take_longer() -> None:
    plain = AxisRest(axis("J1", 1), SETTINGS)
    slow = AxisRest(axis("J1", 1, quick_stop=20.0), SETTINGS)
    late = AxisRest(axis("J1", 1), replace(SETTINGS, overrun_limit_s=0.5))
    assert slow.stop_s - plain.stop_s > 0.1
    assert late.stop_s - plain.stop_s > 0.4


def test_nmt_stop_is_repeated_until_a_heartbeat_shows_it_or_its_time_is_over() -> None:
    stop = NetworkStop(5)
    assert not stop.active
    stop.begin(10.0, lasts_s=0.2)
    times = [10.0 + 0.004 * cycle for cycle in range(100)]
    sent = [frame for now in times for frame in stop.frames(now, NmtState.OPERATIONAL)]
    assert {(frame.id, frame.data) for frame in sent} == {(0x000, b"\x02\x05")}
    assert len(sent) == 4
    assert stop.over(10.2)
    stop.begin(20.0, lasts_s=0.2)
    assert len(stop.frames(20.0, NmtState.OPERATIONAL)) == 1
    assert stop.frames(20.1, NmtState.STOPPED) == []
    stop.end()
    assert not stop.over(30.0)
