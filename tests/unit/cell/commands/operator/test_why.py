"""`cell why`: from a robot that waits to what would free it."""

from dataclasses import replace

import pytest

from cell.commands.client.cell_view import Snapshot
from cell.commands.operator.why import explained
from cell.messages import (
    AxisStatus,
    BusCounters,
    Clearance,
    Deadlock,
    GatewayState,
    ManagerState,
    MeetingStatus,
    Mode,
    NodeStatus,
    ProgramState,
    ProgramStatus,
    Refusal,
    RobotState,
    ZoneState,
    ZoneStatus,
)

NEAR = "left's link 4 would come within 19.2 mm of where right's link 4 may be; 30 mm are kept"
AWAY = "right would be in the way of left, which must get through first"


def _state(robot: str, waiting_for: str = "", mode: Mode = Mode.RUNNING) -> RobotState:
    program = ProgramStatus(f"{robot}.prog", ProgramState.RUNNING, 3, "ML Z=1150", "")
    return RobotState(robot, "boot", 1, mode, program, None, None, None, None, None, waiting_for=waiting_for)


def _manager(deadlocks: tuple[Deadlock, ...] = (), zones: dict[str, ZoneStatus] | None = None) -> ManagerState:
    return replace(ManagerState("cell", "m", 1, 1, 10.0, "d", {}, zones or {}), deadlocks=deadlocks)


def _refused(robot: str, by: str, text: str, since: float) -> Clearance:
    return Clearance(robot, "m", 1, 1, 1, 1, 0, Refusal(by, text, since=since))


def test_who_waits_for_whom_and_since_when_down_to_who_can_help() -> None:
    seen = Snapshot({"left": _state("left", NEAR), "right": _state("right", mode=Mode.HALTED)}, manager=_manager())
    assert explained("left", seen, {"left": _refused("left", "right", NEAR, 6.8)}) == [
        f"left waits, for 3.2 s so far: {NEAR}",
        "right waits for nothing: it is halted: cell continue right",
    ]


def test_robots_that_wait_for_each_other_are_told_what_frees_them() -> None:
    deadlock = Deadlock(("left", "right"), (), 9.0, "left and right wait for each other", "let right back: ...")
    states = {"left": _state("left", NEAR), "right": _state("right", AWAY)}
    refused = {"left": _refused("left", "right", NEAR, 6.0), "right": _refused("right", "left", AWAY, 7.0)}
    assert explained("right", Snapshot(states, manager=_manager((deadlock,))), refused) == [
        f"right waits, for 3.0 s so far: {AWAY}",
        f"left waits, for 4.0 s so far: {NEAR}",
        "left and right wait for each other: let right back: ...",
    ]


def test_a_zone_leads_to_its_holder() -> None:
    zone = ZoneStatus(ZoneState.OCCUPIED, "right", None, ("left",), 1, 5.0)
    waits = "zone door: held by right since 5.0 s"
    left = replace(_state("left", waits), waited_s={"door": 1.25})
    seen = Snapshot({"left": left, "right": _state("right")}, manager=_manager(zones={"door": zone}))
    assert explained("left", seen, {}) == [
        f"left waits, at rest for this zone 1.2 s since its program began: {waits}",
        "right waits for nothing: it moves, line 3 ML Z=1150",
    ]


def test_a_zone_that_is_free_leads_to_who_must_get_through_first() -> None:
    reason = "right must get through before left"
    zone = ZoneStatus(ZoneState.FREE, None, None, ("left",), 1, 5.0, reason, "right")
    waits = f"zone door: {reason}"
    seen = Snapshot({"left": _state("left", waits), "right": _state("right")}, manager=_manager(zones={"door": zone}))
    assert explained("left", seen, {}) == [
        f"left waits: {waits}",
        "right waits for nothing: it moves, line 3 ML Z=1150",
    ]


def test_who_is_missing_at_a_meeting_is_looked_at_next() -> None:
    waits = "meeting load: waits for right, which is halted"
    meetings = {"load": MeetingStatus(("left",), {"right": "which is halted"})}
    states = {"left": _state("left", waits), "right": _state("right", mode=Mode.HALTED)}
    seen = Snapshot(states, manager=replace(_manager(), meetings=meetings))
    assert explained("left", seen, {}) == [
        f"left waits: {waits}",
        "right waits for nothing: it is halted: cell continue right",
    ]


@pytest.mark.parametrize(
    ("mode", "reason", "helps"),
    [
        (Mode.ESTOP, "emergency stop by me: door", "; an emergency stop holds it: cell reset"),
        (Mode.FAULT, "no drive feedback for 0.80 s", "; it is in a fault: cell reset left"),
        (Mode.DISABLED, "emergency stop by me: door", "; its drives are off: cell enable left"),
        (Mode.FAULT, "its bus has failed: see `cell drives`", ""),
    ],
)
def test_a_reason_without_a_way_out_is_told_with_one(mode: Mode, reason: str, helps: str) -> None:
    seen = Snapshot({"left": _state("left", reason, mode=mode)}, manager=_manager())
    assert explained("left", seen, {}) == [f"left ({mode.value}): {reason}{helps}"]


def test_an_old_refusal_of_a_robot_that_moves_on_is_not_told() -> None:
    seen = Snapshot({"left": _state("left")}, manager=_manager())
    assert explained("left", seen, {"left": _refused("left", "right", NEAR, 6.0)}) == [
        "left waits for nothing: it moves, line 3 ML Z=1150"
    ]


def test_who_does_not_answer_is_the_end_of_it() -> None:
    seen = Snapshot({"left": _state("left", NEAR)}, manager=_manager())
    lines = explained("left", seen, {"left": _refused("left", "right", NEAR, 6.0)})
    assert lines == [
        f"left waits, for 4.0 s so far: {NEAR}",
        "right does not answer: cell status says what starts its agent",
    ]


def test_who_does_not_know_where_it_is_is_told_with_what_to_do() -> None:
    node = NodeStatus(1, "right", "J1", "Operational", AxisStatus.SWITCH_ON_DISABLED, referenced=False,
                      reference_missing="its encoder is incremental; home it: cell home")  # fmt: skip
    counters = BusCounters(1, 0, 0.0, 0, 0, 0, 0.1)
    gateway = GatewayState("right_bus", "g", 7, 0.004, "virtual", True, "", {}, None, (node,), counters)
    states = {"left": _state("left", NEAR), "right": _state("right", mode=Mode.DISABLED)}
    seen = Snapshot(states, gateways={"right_bus": gateway}, manager=_manager())
    assert explained("left", seen, {"left": _refused("left", "right", NEAR, 6.0)})[1:] == [
        "right does not know where it is: J1: its encoder is incremental; home it: cell home"
    ]


def test_a_wait_of_the_program_says_since_when() -> None:
    waits = "M 7 waits for an answer: `cell flag left 7`"
    state = _state("left", waits)
    state = replace(state, program=replace(state.program, flag=7, waits_s=12.34))
    assert explained("left", Snapshot({"left": state}, manager=_manager()), {}) == [
        f"left waits, for 12.3 s so far: {waits}"
    ]
