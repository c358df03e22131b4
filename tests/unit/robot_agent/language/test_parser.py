"""The robot language: what is understood, and how mistakes are reported."""

import contextlib
import math
import random
import time
import tracemalloc
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_agent.language import (
    STATEMENTS,
    ChangeTool,
    Goto,
    Home,
    MeetOthers,
    MoveArc,
    MoveCaps,
    MoveJoints,
    MoveLine,
    MoveSpline,
    Names,
    ProgramError,
    SetOutput,
    Tangent,
    Wait,
    excerpt,
    parse_program,
)

JOINTS = ("J1", "J2", "J3", "J4", "J5", "J6")


def problems_of(text: str) -> list[str]:
    with pytest.raises(ProgramError) as caught:
        parse_program(text, "p", Names(JOINTS, outputs=("gripper", "glue"), meetings=("load",)))
    return [str(problem) for problem in caught.value.problems]


def test_degrees_percent_and_millimetres_become_si() -> None:
    program = parse_program("MJ J1=90 J3=-45 F=25\nML X=1500 Y=-20 Z=1000 A=0 B=90 C=180 F=250", "p", Names(JOINTS))
    joints, line = program.statements
    assert joints == MoveJoints(1, (math.pi / 2, None, -math.pi / 4, None, None, None), 0.25)
    assert line == MoveLine(2, (1.5, -0.02, 1.0), (0.0, math.pi / 2, math.pi), MoveCaps(0.25))


def test_what_is_not_named_is_kept() -> None:
    (line,) = parse_program("ML Z=1000 F=9999", "p", Names(JOINTS)).statements
    assert line == MoveLine(1, (None, None, 1.0), None, MoveCaps(9.999))


def test_arcs_and_splines_become_si() -> None:
    text = "MC X=2000 QX=1000 QY=-500 QA=0 QB=90 QC=0 H=-720 F=100 R=20\nMS Y=100 FC=50 FA=90"
    arc, spline = parse_program(text, "p", Names(JOINTS)).statements
    via = ((1.0, -0.5, None), (0.0, math.pi / 2, 0.0))
    assert arc == MoveArc(1, *via, (2.0, None, None), None, -4 * math.pi, MoveCaps(0.1, round_m=0.02))
    assert spline == MoveSpline(2, (None, 0.1, None), None, MoveCaps(0.05, math.pi / 2))


def test_an_arc_may_climb_and_is_a_helix_then() -> None:
    (arc,) = parse_program("MC QX=1 X=2 Z=0 LIFT=-5 F=100", "p", Names(JOINTS)).statements
    assert isinstance(arc, MoveArc)
    assert arc.lift_m == -0.005
    assert problems_of("MC QX=1 X=2 LIFT=100001 F=1") == ["1:13: found `LIFT=100001`, allowed -100000 to 100000 mm"]


def test_caps_and_round_edges_go_with_every_move() -> None:
    joints, line = parse_program(
        "MJ J1=0 F=50 FC=200 FA=30 R=40\nML X=1 F=300 FC=200 R=0 FLIP=1", "p", Names(JOINTS)
    ).statements
    assert joints == MoveJoints(1, (0.0, *[None] * 5), 0.5, MoveCaps(0.2, math.pi / 6, None, 0.04))
    assert line == MoveLine(2, (0.001, None, None), None, MoveCaps(0.2, round_m=0.0), True)


def test_the_joints_may_be_capped_and_may_arrive_apart() -> None:
    text = "MJ J1=0 SYNC=0 FJ=90\nML X=1 FJ=45 F=9999\nHOME F=20 FC=100 R=30"
    joints, line, home = parse_program(text, "p", Names(JOINTS)).statements
    assert joints == MoveJoints(
        1, (0.0, *[None] * 5), None, MoveCaps(joint_speed_rad_s=math.pi / 2), synchronised=False
    )
    assert line == MoveLine(2, (0.001, None, None), None, MoveCaps(9.999, joint_speed_rad_s=math.pi / 4))
    assert home == Home(3, 0.2, MoveCaps(0.1, round_m=0.03))


def test_the_tool_follows_the_path_from_tang_1_to_tang_0() -> None:
    on, turned, off = parse_program("TANG 1\nTANG 1 H=-45\nTANG 0", "p", Names(JOINTS)).statements
    assert (on, turned, off) == (Tangent(1, 0.0), Tangent(2, -math.pi / 4), Tangent(3, None))


def test_case_comments_and_blank_lines_do_not_matter() -> None:
    program = parse_program("; a comment\n\n  home f = 50 ; the rest\nwait 0.5", "p", Names(JOINTS))
    assert program.statements == (Home(3, 0.5), Wait(4, 0.5))
    assert program.text_of(3) == "home f = 50"
    assert program.text_of(99) == ""


def test_a_jump_points_behind_its_label_even_when_the_label_comes_later() -> None:
    program = parse_program("GOTO later 2\nWAIT 1\nLABEL later\nWAIT 2\nGOTO later 3", "p", Names(JOINTS))
    assert program.statements[0] == Goto(1, 3, 2)
    assert program.statements[4] == Goto(5, 3, 3)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (
            "FLY X=1",
            f"1:1: found `FLY`, allowed one of {', '.join(sorted(STATEMENTS))}",
        ),
        (
            "MJ",
            "1:1: found MJ without a joint, allowed at least one of J1, J2, J3, J4, J5, J6; or a pose: P=name, "
            "or X Y Z A B C",
        ),
        (
            "MJ J7=1",
            "1:4: found `J7=1`, allowed NAME=value with a name out of J1, J2, J3, J4, J5, J6, X, Y, Z, A, B, C, "
            "F, FC, FA, FJ, R, SYNC",
        ),
        ("MJ J1=1 J1=2", "1:9: found J1 a second time, allowed each name once"),
        ("MJ J1=north", "1:4: found `north`, allowed a finite number"),
        ("MJ J1=inf", "1:4: found `inf`, allowed a finite number"),
        ("MJ J1=1 F=0", "1:9: found F=0, allowed 0.01 to 100 percent for MJ"),
        ("ML X=1 B=90 F=9999", "1:8: found only B, allowed all of A, B, C, or none to keep the orientation"),
        ("ML X=1 F=-5", "1:8: found F=-5, allowed a speed of at least 0.1 mm/s"),
        ("ML X=1 FA=0 F=9999", "1:8: found FA=0, allowed a speed of at least 0.01 deg/s"),
        ("ML X=1 R=-1 F=9999", "1:8: found R=-1, allowed a round edge of 0 to 100000 mm; 0 stops"),
        ("ML X=1 FLIP=2 F=9999", "1:8: found FLIP=2, allowed 1: the wrist may pass its singular pose, or 0"),
        ("MJ J1=1 SYNC=2", "1:9: found SYNC=2, allowed 1: the joints arrive together, or 0: each as fast as it can"),
        ("MJ J1=1 SYNC=0 R=5", "1:16: found R=5 with SYNC=0, allowed R only where the joints arrive together"),
        ("TANG", "1:1: found `TANG`, allowed TANG 1, with H=degrees if wanted, or TANG 0"),
        ("TANG 2", "1:6: found `TANG 2`, allowed TANG 1, with H=degrees if wanted, or TANG 0"),
        ("TANG 0 H=5", "1:8: found `H=5` after TANG 0, allowed TANG 1, with H=degrees if wanted, or TANG 0"),
        ("TRACK", "1:1: found 0 words after TRACK, allowed the name of a correction, or OFF"),
        ("SET laser", "1:1: found `SET laser`, allowed SET DO and the name of an output"),
        ("reset do", "1:1: found `reset do`, allowed RESET DO and the name of an output"),
        ("RESET DO laser", "1:10: found unknown output `laser`, allowed one of glue, gripper"),
        ("MC X=1 F=9999", "1:1: found MC without a via point, allowed Q=point, or at least one of QX, QY, QZ"),
        (
            "MC QX=1 F=9999",
            "1:1: found MC without a coordinate, allowed at least one of X, Y, Z, A, B, C, or a point: P=name",
        ),
        (
            "MC QX=1 X=2 H=0 F=9999",
            "1:13: found H=0, allowed degrees of the circle to go, any but 0 up to 36000; negative is backwards",
        ),
        ("MS F=10", "1:1: found MS without a coordinate, allowed at least one of X, Y, Z, A, B, C, or a point: P=name"),
        ("WAIT", "1:1: found 0 words after WAIT, allowed a time in seconds"),
        ("WAIT -1", "1:6: found WAIT -1, allowed 0 to 3600 s"),
        ("MEET", "1:1: found `MEET`, allowed MEET and the name of a meeting; if wanted, TIMEOUT and seconds"),
        (
            "MEET load 5",
            "1:1: found `MEET load 5`, allowed MEET and the name of a meeting; if wanted, TIMEOUT and seconds",
        ),
        ("MEET laod", "1:6: found unknown meeting `laod`, allowed load"),
        ("MEET load TIMEOUT 0", "1:19: found TIMEOUT 0, allowed more than 0, up to 3600 s"),
        ("MEET load TIMEOUT nan", "1:19: found `nan`, allowed a finite number"),
        ("GOTO a\nLABEL b", "1:6: found unknown label `a`, allowed only b"),
        ("LABEL a\nGOTO a 2.5", "2:8: found count 2.5, allowed a whole number, 1 to 1000000"),
        ("LABEL a\nLABEL a", "2:7: found label `a` a second time, allowed each label once"),
        ("END now", "1:5: found `now` after END, allowed nothing"),
        ("ML Y=0 X=1e300 F=9999", "1:8: found `X=1e300`, allowed -100000 to 100000 mm"),
        ("MS X=1e9 F=9999", "1:4: found `X=1e9`, allowed -100000 to 100000 mm"),
        ("MC QX=-1e6 X=1 F=9999", "1:4: found `QX=-1e6`, allowed -100000 to 100000 mm"),
        ("ML A=1e300 B=0 C=0 F=9999", "1:4: found `A=1e300`, allowed -36000 to 36000 degrees"),
        ("MJ J2=4e4", "1:4: found `J2=4e4`, allowed -36000 to 36000 degrees"),
        ("TANG 1 H=1e300", "1:8: found `H=1e300`, allowed -36000 to 36000 degrees"),
        ("ML X=1 R=1e300 F=9999", "1:8: found R=1e+300, allowed a round edge of 0 to 100000 mm; 0 stops"),
        ("HOME\nEND \u200bnow", "2:5: found `<U+200B>now` after END, allowed nothing"),
        ("; nothing", "1:1: found a program without statements, allowed at least one statement"),
    ],
)
def test_a_mistake_is_named_with_its_place_and_what_is_allowed(text: str, problem: str) -> None:
    assert problems_of(text) == [problem]


def test_outputs_are_switched_by_name() -> None:
    program = parse_program("SET DO gripper\nreset do Gripper", "p", Names(JOINTS))
    assert program.statements == (SetOutput(1, "gripper", True), SetOutput(2, "Gripper", False))


def test_a_meeting_may_have_a_time_out() -> None:
    program = parse_program("MEET load\nmeet load timeout 2.5", "p", Names(JOINTS))
    assert program.statements == (MeetOthers(1, "load", None), MeetOthers(2, "load", 2.5))


def test_all_mistakes_are_reported_at_once_in_order() -> None:
    found = problems_of("GOTO nowhere\nMJ\nWAIT x")
    assert [text.split(":")[0] for text in found] == ["1", "2", "3"]


@given(st.text(max_size=60))
def test_no_text_makes_the_parser_fail_otherwise(text: str) -> None:
    with contextlib.suppress(ProgramError):
        assert parse_program(text, "p", Names(JOINTS)).statements


def test_joints_with_names_in_lower_case_are_moved() -> None:
    (move,) = parse_program("MJ base=90 LIFT=20", "p", Names(("base", "lift", "Turn"), linear={"lift"})).statements
    assert move == MoveJoints(1, (math.pi / 2, 0.02, None))


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("ML X=1", "1:1: found ML without a speed, allowed F=mm/s on the first path move of a file"),
        ("MJ J1=0 F50\nMS X=1\nMS X=2", "2:1: found MS without a speed"),
        ("END: WAIT 1", "1:1: found label `END`, allowed a name that is no word of the language"),
        ("l: GOTO l", "1:1: found a loop that neither moves nor waits"),
        ("l: WAIT 1\nGOTO l\nWAIT 2\nWAIT 3\nEND", "3:1: found code that no line leads to"),
        ("SUB s\nEND\ns: WAIT 1", "1:1: found a subroutine without END"),
        ("SUB s\nEND\ns: WAIT 1\nSUB t\nEND\nt: SUB s\nEND", "4:1: found a subroutine that comes to its own"),
        ("CALL nowhere.prog", "1:6: found CALL nowhere.prog: no such file"),
        ("WAIT 1\nGOTI x", "2:1: found `GOTI`, allowed GOTO; there are also"),
        ("MX J1=1", "1:1: found `MX`, allowed MJ or ML or"),
        ("SUB corner\nEND\ncorners: WAIT 1\nEND", "1:5: found unknown label `corner`"),
        ("MJ J1=0 F-5", "1:9: found F=-5, allowed 0.01 to 100 percent for MJ"),
        ("SPEED 0", "1:7: found SPEED 0, allowed 0.01 to 100 percent for SPEED"),
        ("HOME R1.2.3", "1:6: found `1.2.3`, allowed a finite number"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_the_way_through_a_program_is_found_before_it_runs(
    text: str, problem: str, tmp_path: Path
) -> None:
    with pytest.raises(ProgramError) as caught:
        parse_program(text, "p", Names(JOINTS), tmp_path)
    assert any(str(each).startswith(problem) for each in caught.value.problems), caught.value


@pytest.mark.parametrize(
    ("subroutine", "refused"),
    [
        ("s: WAIT 1", False),
        ("s: MJ J1=1", False),
        ("s: SPEED 50", True),
        ("s: GOTO last 1\nWAIT 1\nlast: SPEED 50", True),
        ("s: GOTO last 1\nWAIT 1\nlast: WAIT 2", False),
        ("s: SUB t\nEND\nt: WAIT 1", False),
        ("s: SUB t\nEND\nt: SPEED 50", True),
        ("s: SUB t\nWAIT 1\nEND\nt: SPEED 50", False),
    ],
)
def test_time_passes_in_a_loop_where_it_passes_in_each_way_through_its_subroutine(
    subroutine: str, refused: bool
) -> None:
    text = f"again: SUB s\nGOTO again 2\nEND\n{subroutine}\nEND"
    if not refused:
        assert parse_program(text, "p", Names(JOINTS)).statements
        return
    with pytest.raises(ProgramError) as caught:
        parse_program(text, "p", Names(JOINTS))
    assert [str(each)[:46] for each in caught.value.problems] == ["2:1: found a loop that neither moves nor waits"]


def test_a_mistake_in_a_called_file_is_told_with_its_file_and_all_are_told_together(tmp_path: Path) -> None:
    (tmp_path / "cut.prog").write_text("WAIT x\nCALL deeper.prog\nCALL cut.prog")
    (tmp_path / "deeper.prog").write_text("; nothing\nFLY")
    with pytest.raises(ProgramError) as caught:
        parse_program("CALL cut.prog\nGOTO nowhere", "p", Names(JOINTS), tmp_path)
    assert [line.split(" found")[0] for line in str(caught.value).splitlines()] == [
        "p:2:6:", "cut.prog:1:6:", "deeper.prog:2:1:"
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("MJ J1=0 F50 R20 // slowly", "MJ J1=0 F=50 R=20"),
        ("MC QX=1 X=2 F100 H-720", "MC QX=1 X=2 F=100 H=-720"),
        ("ML X=1 FC100 FA30 FJ.5", "ML X=1 FC=100 FA=30 FJ=.5"),
        ("TANG 1 H45", "TANG 1 H=45"),
        ("TRK belt", "TRACK belt"),
        ("TRK 0", "TRACK OFF"),
        ("here:\nGOTO here 2\nWAIT 1\nGOTO here 2", "LABEL here\nGOTO here 2\nWAIT 1\nGOTO here 2"),
    ],
)
def test_short_forms_mean_the_long_ones(short: str, long: str) -> None:
    def parsed(text: str) -> object:
        try:
            return parse_program(text, "p", Names(JOINTS)).statements
        except ProgramError as error:
            return str(error)

    assert parsed(short) == parsed(long)


def drawn_lines(count: int) -> str:
    """A program of so many lines, no two alike."""
    rng = random.Random(1)
    moves = [f"ML X={rng.uniform(900, 1100):.3f} Y={rng.uniform(-100, 100):.3f} R=5" for _ in range(count - 2)]
    return "\n".join(["ML X=1000 Y=0 Z=1500 A=0 B=90 C=0 F=100", *moves, "END"])


def read_s(text: str) -> float:
    """Processor time for reading it, the least of three."""
    took = []
    for _ in range(3):
        began = time.process_time()
        parse_program(text, "p", Names(JOINTS))
        took.append(time.process_time() - began)
    return min(took)


def test_a_thousand_lines_are_read_within_a_fifth_of_a_second() -> None:
    assert read_s(drawn_lines(1000)) < 0.2


def test_time_and_memory_grow_as_the_number_of_lines() -> None:
    grew = read_s(drawn_lines(4000)) / read_s(drawn_lines(1000))
    assert grew < 8.0  # 4, and room for a noisy machine
    assert held_bytes(4000) < 5.0 * held_bytes(1000)


def held_bytes(count: int) -> int:
    """What a program of so many lines takes, with all that is there while it is read, beside its text."""
    text = drawn_lines(count)
    tracemalloc.start()
    parse_program(text, "p", Names(JOINTS))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def test_what_runs_is_the_program_that_was_read_and_no_copy() -> None:
    program = parse_program(drawn_lines(100), "p", Names(JOINTS))
    assert excerpt(program, None, None, dry=False).program is program


@pytest.mark.soak
def test_a_hundred_thousand_lines_are_read_in_the_time_that_their_number_takes() -> None:
    assert read_s(drawn_lines(100_000)) < 150.0 * read_s(drawn_lines(1000))
    assert held_bytes(100_000) < 125.0 * held_bytes(1000)  # 100, and sets and lists that grow in steps


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("MJ J1=1\n T=grip", "2:2: found unknown tool `grip`, allowed gripper; there are also T0, T2"),
        ("T3", "1:1: found unknown tool `T3`, allowed one of T0, T2, gripper"),
        ("T=gripper F=5", "1:11: found `F=5` after T=gripper, allowed nothing: T is a line of its own"),
        ("ML=5", "1:1: found `ML=5`"),
        ("MT0", "1:1: found `MT0`"),
    ],
)
def test_a_tool_has_a_name_of_the_robot_file_and_a_line_of_its_own(text: str, problem: str) -> None:
    with pytest.raises(ProgramError) as error:
        parse_program(text, "p", Names(("J1",), tools=("gripper", "T2")))
    assert problem in str(error.value)


def test_tools_are_named_in_three_ways() -> None:
    program = parse_program("T=gripper\nT2\nt2\nT0\nT=none", "p", Names(("J1",), tools=("gripper", "T2")))
    tools = [each.tool for each in program.statements if isinstance(each, ChangeTool)]
    assert tools == ["gripper", "T2", "T2", None, None]
