"""The interpreter: jumps, counters, the end, and loops that do nothing."""

import math
from pathlib import Path

import pytest

from robot_agent.language import (
    Finished,
    Goto,
    Interpreter,
    JointStep,
    Label,
    LineStep,
    Meet,
    Mount,
    Names,
    Pause,
    Program,
    ProgramFault,
    Step,
    SwitchNow,
    TrackingOff,
    TrackingOn,
    parse_program,
)
from robot_agent.model import Mounted


def steps_of(text: str, count: int) -> list[Step]:
    interpreter = Interpreter(parse_program(text, "p", Names(("J1",))))
    return [interpreter.next() for _ in range(count)]


def pauses(text: str, count: int) -> list[float]:
    return [step.duration_s for step in steps_of(text, count) if isinstance(step, Pause)]


def test_goto_jumps_as_often_as_it_says_and_then_goes_on() -> None:
    assert pauses("LABEL a\nWAIT 1\nGOTO a 2\nWAIT 9\nEND", 9) == [1, 1, 1, 9]


def test_a_counter_starts_anew_when_the_loop_is_entered_again() -> None:
    text = "LABEL out\nLABEL in\nWAIT 1\nGOTO in 1\nWAIT 2\nGOTO out 1\nEND"
    assert pauses(text, 20) == [1, 1, 2, 1, 1, 2]


def switches(step: Step) -> list[tuple[int, str, bool, int]]:
    assert isinstance(step, JointStep | SwitchNow)
    return [(each.line, each.output, each.on, each.number) for each in step.switches]


def test_what_is_switched_behind_a_move_belongs_to_it_and_counts_anew_in_each_round() -> None:
    text = "SET DO a\nLABEL l\nMJ J1=1\nRESET DO a\nGOTO l 1\nSET DO b\nWAIT 1\nSET DO c\nEND"
    start, first, second, _, last, end = steps_of(text, 6)
    assert switches(start) == [(1, "a", True, 1)]
    assert switches(first) == [(4, "a", False, 2)]
    assert switches(second) == [(4, "a", False, 3), (6, "b", True, 4)]
    assert switches(last) == [(8, "c", True, 5)]
    assert isinstance(end, Finished)


def test_too_many_outputs_at_one_place_are_a_fault_behind_what_comes_before_them() -> None:
    blink = "SET DO a\nRESET DO a\n" * 51
    move, fault = steps_of(f"MJ J1=1\n{blink}END", 2)
    assert len(switches(move)) == 100
    assert isinstance(fault, ProgramFault)
    assert "at one place" in fault.text


def test_goto_without_a_count_never_ends() -> None:
    assert pauses("LABEL a\nWAIT 1\nGOTO a", 50) == [1] * 50


def test_the_end_stays_the_end() -> None:
    assert steps_of("WAIT 1\nEND", 4)[1:] == [Finished(2)] * 3


def test_a_program_without_end_is_finished_behind_its_last_line() -> None:
    assert isinstance(steps_of("WAIT 1", 2)[1], Finished)


def test_a_loop_without_motion_or_pause_is_a_fault_and_not_a_hang() -> None:
    step = Interpreter(Program("p", (Label(1, "a"), Goto(2, 0, None)), ())).next()
    assert isinstance(step, ProgramFault)
    assert "put one into the loop" in step.text


def test_tang_holds_for_the_moves_of_the_flange_until_it_is_switched_off() -> None:
    steps = steps_of("ML X=1 F=9999\nTANG 1 H=180\nML X=2\nMJ J1=0\nML X=3\nTANG 0\nML X=4", 5)
    angles = [step.tangential_rad for step in steps if isinstance(step, LineStep)]
    assert angles == [None, math.pi, math.pi, None]


def test_an_orientation_while_the_tool_follows_the_path_is_a_fault() -> None:
    for move in ("ML X=1 A=0 B=0 C=0 F=9999", "MC X=1 QX=2 QA=0 QB=0 QC=0 F=9999"):
        _, fault, again = steps_of(f"WAIT 1\nTANG 1\n{move}\nWAIT 2", 3)
        assert fault == again
        assert isinstance(fault, ProgramFault)
        assert fault.line == 3
        assert "leave them out, or TANG 0" in fault.text


def test_a_correction_ends_before_another_or_the_same_one_begins_and_only_once() -> None:
    steps = steps_of("TRACK OFF\nTRACK a\nTRACK b\nWAIT 1\nTRACK off\nTRACK OFF\nWAIT 2", 6)
    assert steps == [
        TrackingOn(2, "a"),
        TrackingOff(3),
        TrackingOn(3, "b"),
        Pause(4, 1.0),
        TrackingOff(5),
        Pause(7, 2.0),
    ]


def test_a_meeting_is_a_step_of_its_own_and_not_while_a_correction_is_followed() -> None:
    assert steps_of("MEET load\nMEET load TIMEOUT 5", 2) == [Meet(1, "load", None), Meet(2, "load", 5.0)]
    fault = steps_of("TRACK a\nMEET load", 2)[1]
    assert fault == ProgramFault(2, "MEET while the robot follows a correction: TRACK OFF comes first")


def held(text: str, before: tuple[str, ...] | None) -> list[tuple[str, ...] | str]:
    """What each move is done with, and the fault that ends the program."""
    found = mounted(text, None if before is None else Mounted(parts=before))
    return [each.parts if isinstance(each, Mounted) else each for each in found]


def mounted(text: str, before: Mounted | None) -> list[Mounted | str]:
    interpreter, found = Interpreter(parse_program(text, "p", Names(("J1",))), before), list[Mounted | str]()
    while not isinstance(step := interpreter.next(), Finished | ProgramFault):
        found += [step.mounted] if isinstance(step, JointStep) else []
    return [*found, step.text] if isinstance(step, ProgramFault) else found


def test_moves_are_done_with_what_was_attached_before_them() -> None:
    text = "MJ J1=1\nATTACH a\nMJ J1=2\nMJ J1=3\nDETACH\nMJ J1=4"
    assert held(text, ()) == held(text, None) == [(), ("a",), ("a",), ()]
    assert steps_of(text, 2)[1] == Mount(2, Mounted(parts=("a",)))
    assert held("MJ J1=1\nDETACH\nMJ J1=2\nATTACH b\nMJ J1=3", ("a", "b")) == [("a", "b"), (), ("b",)]


def test_a_robot_holds_one_part_at_most_and_gives_away_what_it_holds() -> None:
    assert held("ATTACH a\nATTACH b", ()) == ["ATTACH b while the robot holds a: DETACH comes first"]
    assert held("ATTACH a", ("a", "b")) == ["ATTACH a while the robot holds a or b: DETACH comes first"]
    assert held("DETACH", ()) == ["DETACH while the robot holds no part: ATTACH comes first"]
    assert held("ATTACH a\nDETACH\nDETACH", None) == ["DETACH while the robot holds no part: ATTACH comes first"]


def test_nothing_is_attached_or_detached_while_a_correction_is_followed() -> None:
    for word in ("ATTACH a", "DETACH"):
        (fault,) = held(f"TRACK belt\n{word}", None)
        assert "while the robot follows a correction: TRACK OFF comes first" in fault


def test_moves_are_done_with_the_tool_that_was_mounted_before_them() -> None:
    text = "MJ J1=1\nT=a\nMJ J1=2\nATTACH p\nMJ J1=3\nDETACH\nT0\nMJ J1=4\nt = b\nMJ J1=5\nt=None\nMJ J1=6"
    carried = [("g", ""), ("a", ""), ("a", "p"), ("", ""), ("b", ""), ("", "")]
    expected = [Mounted(*(((name,) if name else ()) for name in each)) for each in carried]
    assert mounted(text, Mounted(("g",))) == expected
    assert steps_of("T7", 1) == [Mount(1, Mounted(("T7",)))]


def test_the_tool_that_is_mounted_already_asks_for_no_rest() -> None:
    assert steps_of("T=a\nT=a\nWAIT 1", 2) == [Mount(1, Mounted(("a",))), Pause(3, 1.0)]
    assert mounted("TRACK belt\nT=a\nMJ J1=1", Mounted(("a",))) == [Mounted(("a",))]


def test_a_tool_is_not_changed_while_a_part_is_held_nor_while_a_correction_is_followed() -> None:
    (fault,) = mounted("T=b", Mounted(("a",), ("p", "q")))
    assert fault == "T=b while the robot holds p or q: DETACH comes first"
    (fault,) = mounted("TRACK belt\nT0", Mounted(("a",)))
    assert fault == "T=NONE while the robot follows a correction: TRACK OFF comes first"


def test_a_subroutine_runs_as_often_as_it_says_and_counts_its_loops_anew_each_time() -> None:
    text = "SUB outer 2\nWAIT 9\nEND\nouter: WAIT 1\nSUB inner\nEND\ninner:\nl: WAIT 2\nGOTO l 1\nEND"
    assert pauses(text, 12) == [1, 2, 2, 1, 2, 2, 9]


def test_a_called_file_runs_to_its_end_with_labels_and_lines_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "cut.prog").write_text("l: WAIT 2\nGOTO l 1\n")
    text = "CALL cut.prog 2\nl: WAIT 1\nGOTO l 1"
    interpreter = Interpreter(parse_program(text, "p", Names(("J1",)), tmp_path))
    steps = [interpreter.next() for _ in range(7)]
    assert [step.duration_s for step in steps if isinstance(step, Pause)] == [2, 2, 2, 2, 1, 1]
    assert [str(step.line) for step in steps] == ["1 of cut.prog"] * 4 + ["2", "2", "3"]
    assert isinstance(steps[-1], Finished)


def test_a_speed_holds_until_another_move_names_one_for_joint_and_path_moves_apart() -> None:
    text = "HOME F50\nML X=1 F200\nMJ J1=1\nML X=2 FC=100\nSPEED 50\nMJ J1=0\nMC QX=1 X=2\nSUB s\nML X=3\nEND\n"
    text += "s: ML X=1 F=10\nEND"
    steps = steps_of(text, 8)
    joint = [step.speed for step in steps if isinstance(step, JointStep)]
    path = [step.pace.speed_m_s for step in steps if not isinstance(step, JointStep)]
    assert joint == [0.5, 0.5, 0.25]
    assert path == pytest.approx([0.2, 0.1, 0.05, 0.005, 0.005])
