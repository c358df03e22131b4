"""The numbers of a recording are those of what happened."""

from dataclasses import replace

import numpy as np
import pytest

from cell.messages import (
    Body,
    BusCounters,
    Clearance,
    Event,
    GatewayState,
    ManagerState,
    Mode,
    Presence,
    ProgramState,
    ProgramStatus,
    Refusal,
    RobotState,
    Severity,
    ZoneState,
    ZoneStatus,
)
from cell.recording import summary as module
from cell.recording.summary import Heard, Span, Summary

PROGRAM = ProgramStatus("p", ProgramState.RUNNING, 1, "")
LEFT = RobotState("left", "b", 1, Mode.RUNNING, PROGRAM, None, None, None, None, None)
ZONE = ZoneStatus(ZoneState.OCCUPIED, "right", None, ("left",), 1, 0.0)
MANAGER = ManagerState("c", "m", 1, 1, 0.0, "d", zones={"handover": ZONE})


def summary(heard: list[Heard]) -> Summary:
    return module.summary(heard, 0.0)


def every(state: object, begin: float, end: float) -> list[Heard]:
    """The same again and again, every 0.1 s; the end belongs to what comes after."""
    return [(state, round(begin + 0.1 * i, 3)) for i in range(round((end - begin) / 0.1))]


def told(*parts: list[Heard]) -> list[Heard]:
    return sorted((each for part in parts for each in part), key=lambda each: each[1])


def test_a_wait_for_a_zone_names_who_has_it() -> None:
    waits = replace(LEFT, waiting_for="zone handover: right is inside, for 0.5 s")
    found = summary(told(every(MANAGER, 0, 4), every(LEFT, 0, 1), every(waits, 1, 3), every(LEFT, 3, 4)))
    assert found.waited() == {("left", "zone handover", "right"): (1, pytest.approx(2.0))}
    assert found.use["left"] == {"moves": pytest.approx(1.9), "waits": pytest.approx(2.0)}
    assert found.zones == {"handover": [Span(0.0, 3.9, "occupied", "right")]}


def test_a_wait_for_room_names_the_robot_in_the_way() -> None:
    refused = Clearance("left", "m", 1, 1, 1, 1, 0, Refusal("right", "right's arm is in the way"))
    waits = replace(LEFT, waiting_for="right's arm is in the way")
    found = summary(told([(refused, -0.1)], every(waits, 0, 1)))
    assert found.waited() == {("left", "room", "right"): (1, pytest.approx(0.9))}


def test_a_countdown_is_one_wait() -> None:
    waits = [(replace(LEFT, waiting_for=f"WAIT, {1.0 - at:.1f} s left"), at) for at in (0.0, 0.1, 0.2, 0.3)]
    assert summary(waits).waited() == {("left", "WAIT, … s left", ""): (1, pytest.approx(0.3))}


def test_a_waiting_text_of_a_robot_that_does_not_work_is_no_wait() -> None:
    halted = replace(LEFT, mode=Mode.HALTED, waiting_for="halted by joe")
    found = summary(every(halted, 0, 1))
    assert found.waited() == {}
    assert found.use == {"left": {"halted": pytest.approx(0.9)}}


def test_silence_belongs_to_no_mode() -> None:
    found = summary(told(every(LEFT, 0, 1), every(LEFT, 5, 6)))
    assert [(span.begin, span.end) for span in found.modes["left"]] == [(0.0, 0.9), (5.0, 5.9)]
    assert found.use["left"] == {"moves": pytest.approx(1.8)}


def presence(robot: str, x: float, growth: float) -> Presence:
    capsule = np.array([[[[x, 0.0, 0.0], [x, 0.0, 1.0]]]], np.float32)
    body = Body(True, (x, 0.0, 0.0), 1.0, np.array([0.1], np.float32), capsule, np.array([growth], np.float32))
    return Presence(robot, "b", 1, 1, None, "d", body, 0.0)


def test_distances_are_those_of_the_bodies_with_their_growth() -> None:
    places = [("left", 0.0, 0.02, 0.0), ("right", 1.0, 0.03, 0.01), ("right", 0.5, 0.0, 0.05), ("left", 0.0, 0.0, 0.06)]
    late = [("right", 9.0, 0.0, 5.0)]
    found = summary([(presence(robot, x, growth), at) for robot, x, growth, at in places + late])
    assert found.distances["left", "right"].x == [0.01]
    assert found.distances["left", "right"].y == [pytest.approx(0.28, abs=1e-6)]


def test_lateness_and_late_cycles_are_within_the_recording() -> None:
    def state(late: int, ticks: int, worst: float) -> GatewayState:
        counters = BusCounters(ticks, late, worst, 0, 0, 0, 0.0)
        return GatewayState("bus", "b", 1, 0.01, "virtual", True, "", {}, None, (), counters)

    found = summary([(state(3, 100, 0.001), 0.0), (state(5, 600, 0.004), 2.0)])
    assert found.late_cycles == {"bus": (2, 500)}
    assert found.lateness["bus"].y == [0.001, 0.004]


def test_alarms_are_told_and_an_empty_recording_has_nothing() -> None:
    alarm = Event("robot/left", 1, Severity.ALARM, "fault", "hot")
    found = summary([(alarm, 5.0), (replace(alarm, severity=Severity.INFO), 6.0)])
    assert found.alarms == [(5.0, alarm)]
    assert summary([]).modes == {}
