"""A part of a program begins with what holds there, and ends behind its last line."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_agent.language import (
    Finished,
    Interpreter,
    JointStep,
    LineStep,
    Names,
    NotThere,
    Pause,
    Step,
    SwitchNow,
    excerpt,
    parse_program,
)

TEXT = """\
HOME F=50
ML X=1 F=200
SPEED 50
TANG 1 H=10
SET DO glue
SUB corner
ML X=2
IF DI there
WAIT 3
ENDIF
LABEL again
MJ J1=1
GOTO again 1
RESET DO glue
ML X=3
END
LABEL corner
WAIT 7
END
"""


def steps(first: int | None = None, last: int | None = None, text: str = TEXT, *, dry: bool = False) -> list[Step]:
    part = excerpt(parse_program(text, "p", Names(("J1",))), first, last, dry=dry)
    interpreter, found = Interpreter(part.program, begins=part.begins), list[Step]()
    while not found or not isinstance(found[-1], Finished):
        found.append(interpreter.next())
        if len(found) > 50:
            return found
    return found


def test_speeds_and_all_that_holds_from_a_line_on_hold_where_the_part_begins() -> None:
    first, *_ = steps(7, 7)
    assert isinstance(first, LineStep)
    assert first.pace.speed_m_s == pytest.approx(0.1)
    assert first.tangential_rad == pytest.approx(0.174533, abs=1e-6)
    joint = next(step for step in steps(12, 12) if isinstance(step, JointStep))
    assert joint.speed == pytest.approx(0.25)


def test_the_part_ends_with_its_last_line_and_loops_are_whole() -> None:
    assert [step.line for step in steps(11, 13)] == [12, 12, 13]
    assert [step.line for step in steps(1, 2)] == [1, 2, 2]
    assert [step.duration_s for step in steps(5, 6) if isinstance(step, Pause)] == [7]


def test_a_dry_run_switches_nothing() -> None:
    assert any(isinstance(step, SwitchNow) for step in steps(5, 6))
    assert not any(isinstance(step, SwitchNow) for step in steps(5, 6, dry=True))
    assert all(not step.switches for step in steps(11, dry=True) if isinstance(step, JointStep | LineStep))


@pytest.mark.parametrize(
    ("first", "last", "why"),
    [
        (9, None, "inside an IF"),
        (10, None, "inside an IF"),
        (None, 9, "inside an IF"),
        (18, None, "in a subroutine"),
        (99, None, "no statement; the nearest is line 19"),
        (7, 2, "line 2 comes before line 7"),
    ],
)
def test_where_a_part_cannot_begin_or_end_is_said_with_what_to_do(first: int, last: int, why: str) -> None:
    with pytest.raises(NotThere, match=why):
        steps(first, last)


def test_no_part_begins_while_something_is_followed() -> None:
    text = "TRACK belt\nML X=1 F=9\nTRACK OFF\nML X=2\n"
    with pytest.raises(NotThere, match="between TRACK and TRACK OFF"):
        steps(2, text=text)
    assert steps(4, text=text)[0].line == 4
    assert steps(1, text=text)[0].line == 1


@given(st.integers(1, 8), st.integers(1, 8))
def test_parts_of_a_plain_program_are_its_lines(first: int, last: int) -> None:
    text = "".join(f"WAIT {line}\n" for line in range(1, 9))
    if last < first:
        with pytest.raises(NotThere):
            steps(first, last, text)
        return
    waited = [step.duration_s for step in steps(first, last, text) if isinstance(step, Pause)]
    assert waited == list(range(first, last + 1))
