"""The interpreter: jumps, counters, the end, and loops that do nothing."""

from robot_agent.language import Finished, Interpreter, Pause, ProgramFault, Step, parse_program


def steps_of(text: str, count: int) -> list[Step]:
    interpreter = Interpreter(parse_program(text, "p", ("J1",)))
    return [interpreter.next() for _ in range(count)]


def pauses(text: str, count: int) -> list[float]:
    return [step.duration_s for step in steps_of(text, count) if isinstance(step, Pause)]


def test_goto_jumps_as_often_as_it_says_and_then_goes_on() -> None:
    assert pauses("LABEL a\nWAIT 1\nGOTO a 2\nWAIT 9\nEND", 9) == [1, 1, 1, 9]


def test_a_counter_starts_anew_when_the_loop_is_entered_again() -> None:
    text = "LABEL out\nLABEL in\nWAIT 1\nGOTO in 1\nWAIT 2\nGOTO out 1\nEND"
    assert pauses(text, 20) == [1, 1, 2, 1, 1, 2]


def test_goto_without_a_count_never_ends() -> None:
    assert pauses("LABEL a\nWAIT 1\nGOTO a", 50) == [1] * 50


def test_the_end_stays_the_end() -> None:
    assert steps_of("WAIT 1\nEND\nWAIT 2", 4)[1:] == [Finished(2)] * 3


def test_a_program_without_end_is_finished_behind_its_last_line() -> None:
    assert isinstance(steps_of("WAIT 1", 2)[1], Finished)


def test_a_loop_without_motion_or_pause_is_a_fault_and_not_a_hang() -> None:
    (step,) = steps_of("LABEL a\nGOTO a", 1)
    assert isinstance(step, ProgramFault)
    assert "put one into the loop" in step.text
