"""What an operator reads of each robot: what it does, what keeps it, since when, what to do next."""

from dataclasses import replace

import pytest

from cell.core import Arrived
from cell.messages import Clearance, Deadlock, Event, GovernorStatus, Mode, Refusal, Severity, ZoneState
from cell.view.newest import Newest
from cell.view.now import Line, NowLines, Tone
from tests.unit.cell.view.room import CELL, held_by, manager, robot, seen


def line(newest: Newest) -> Line:
    return NowLines(CELL).of(newest)[0]


def test_a_robot_that_runs_needs_nothing() -> None:
    found = line(seen(robot(), manager()))
    assert (found.tone, found.mode, found.program, found.rate) == (Tone.MOVES, "running", "8  ML X=1650", "rate 100 %")
    assert found.next == "nothing: it runs"
    assert found.since_s is None


def test_a_silent_robot_says_what_starts_it() -> None:
    found = line(seen(manager()))
    assert (found.tone, found.mode) == (Tone.ALARM, "silent")
    assert found.next.startswith("start its agent: robot-agent ")


@pytest.mark.parametrize(
    ("mode", "word"),
    [
        (Mode.DISABLED, "Enable"),
        (Mode.READY, "Run"),
        (Mode.HALTED, "Continue"),
        (Mode.OFF_PATH, "Return"),
        (Mode.FAULT, "Reset"),
        (Mode.ESTOP, "Reset"),
    ],
)
def test_who_stands_says_which_button_lets_him_go_on(mode: Mode, word: str) -> None:
    assert word in line(seen(robot(mode=mode), manager())).next


@pytest.mark.parametrize("mode", Mode)
def test_every_mode_has_something_to_do_next(mode: Mode) -> None:
    assert line(seen(robot(mode=mode), manager())).next


def test_who_waits_for_a_zone_names_its_holder() -> None:
    waiting = robot(waiting_for="zone handover: held by right")
    found = line(seen(waiting, manager(handover=held_by("right"))))
    assert (found.tone, found.waits_for) == (Tone.WAITS, "right")
    assert found.next == "nothing: it goes on when right is out of its way"


def test_an_orphaned_zone_asks_somebody_to_look() -> None:
    waiting = robot(waiting_for="zone handover: orphaned")
    found = line(seen(waiting, manager(handover=held_by("right", ZoneState.ORPHANED))))
    assert found.next == "look whether somebody is inside, then: cell zone clear handover"


def test_who_waits_for_room_names_who_is_in_the_way() -> None:
    waiting = robot(waiting_for="right's forearm is in the way")
    clearance = Clearance("left", "m", 7, 1, 1, 1, 0, Refusal("right", "right's forearm is in the way"))
    assert line(seen(waiting, clearance, manager())).waits_for == "right"


def test_robots_that_wait_for_each_other_show_what_frees_them() -> None:
    knot = Deadlock(("left", "right"), (), 3.0, "left and right wait", "cell override left -30")
    assert line(seen(robot(), replace(manager(), deadlocks=(knot,)))).next == "cell override left -30"


def test_a_fault_shows_the_remedy_of_its_event() -> None:
    faulty = replace(robot(mode=Mode.FAULT), alarms=("node 3 is silent",))
    event = Event("robot/left", 1, Severity.ALARM, "node_silent", "node 3 is silent", "look at the cable of node 3")
    assert line(seen(faulty, event, manager())).next == "look at the cable of node 3"


def test_a_flag_says_how_it_is_answered() -> None:
    state = robot(waiting_for="M 7 waits for an answer")
    asking = replace(state, program=replace(state.program, flag=7))
    assert line(seen(asking, manager())).next == "answer the flag: cell flag left 7"


def test_without_a_manager_that_is_what_to_do() -> None:
    assert "manager" in line(seen(robot())).next


def test_a_reason_whose_numbers_change_is_the_same_reason() -> None:
    lines, newest = NowLines(CELL), Newest()
    for now, text in ((1.0, "stands for 1.0 s"), (2.0, "stands for 2.0 s"), (3.0, "another")):
        newest.look([Arrived(robot(waiting_for=text), now), Arrived(manager(), now)], now)
        found = lines.of(newest)[0]
    assert found.since_s == 0.0
    newest.look([Arrived(robot(waiting_for="another"), 3.5), Arrived(manager(), 3.5)], 3.5)
    assert lines.of(newest)[0].since_s == 0.5


def test_a_seek_back_in_a_recording_forgets_what_comes_later() -> None:
    newest = seen(robot(), manager(), now=100.0)
    newest.look([Arrived(manager(), 5.0)], 5.0)
    assert line(newest).mode == "silent"


def test_who_is_kept_at_rest_says_by_whom() -> None:
    held = replace(robot(), governor=GovernorStatus(0.0, 0.4, 2.0, "the manager is silent"))
    found = line(seen(held, manager()))
    assert (found.tone, found.reason) == (Tone.WAITS, "the manager is silent")


def test_under_an_emergency_stop_the_way_out_is_told_to_its_end() -> None:
    stop = Event("manager", 1, Severity.ALARM, "estop", "stopped", "find the cause")
    state = replace(robot(mode=Mode.ESTOP), alarms=("stopped",))
    found = line(seen(state, manager(), stop))
    assert "Reset" in found.next
    assert "Enable" in found.next


def test_a_program_that_pauses_needs_nothing() -> None:
    found = line(seen(robot(waiting_for="WAIT, 0.6 s left"), manager()))
    assert (found.tone, found.next) == (Tone.WAITS, "nothing: its program pauses")
