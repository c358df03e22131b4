"""Conditions: how they are read, which way a program goes by them, and what has to be asked at rest."""

import contextlib
from dataclasses import dataclass

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robot_agent.language import (
    AwaitAnswer,
    AwaitInput,
    Decide,
    Finished,
    FlagMark,
    Interpreter,
    JointStep,
    Names,
    Pause,
    ProgramError,
    ProgramFault,
    Signal,
    Step,
    SwitchNow,
    Ways,
    forks,
    parse_program,
)

NAMES = Names(("J1",), inputs=("part", "door", "di3"), outputs=("gripper", "do3"))


def problem_of(text: str) -> str:
    with pytest.raises(ProgramError) as caught:
        parse_program(text, "p", NAMES)
    (problem,) = caught.value.problems
    return str(problem)


def run(text: str, on: frozenset[str] = frozenset(), most: int = 1000) -> list[Step]:
    """What a program does where these inputs and outputs are on, without the steps that only decide."""
    interpreter = Interpreter(parse_program(text, "p", NAMES), known=lambda signal: signal.name in on)
    steps = list[Step]()
    while len(steps) < most and not isinstance(step := interpreter.next(), Finished):
        if isinstance(step, ProgramFault):
            return [*steps, step]
        if isinstance(step, Decide):
            holds = step.test.holds(lambda signal: signal.name in on)
            assert holds is not None
            interpreter.decide(holds)
        else:
            steps.append(step)
    return steps


def pauses(text: str, on: frozenset[str] = frozenset()) -> list[float]:
    steps = run(text, on)
    assert all(isinstance(step, Pause) for step in steps), steps
    return [step.duration_s for step in steps if isinstance(step, Pause)]


# How they are read


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("IF\nENDIF", "1:1: found IF without a condition after it, allowed DI name, DO name, NOT DI name, or a"),
        ("IF DI part AND\nENDIF", "1:12: found AND without a condition after it"),
        ("IF DI part AND DI door OR DI3\nENDIF", "1:24: found AND and OR in one condition, allowed one of them"),
        ("IF DI prat\nENDIF", "1:7: found unknown input `prat`, allowed part; there are also di3, door"),
        ("IF DI 4\nENDIF", "1:7: found unknown input `di4`"),
        ("IF DO part\nENDIF", "1:7: found unknown output `part`, allowed one of do3, gripper"),
        ("IF DI part DI door\nENDIF", "1:4: found `DI part DI door`"),
        ("IF 1 == 1\nENDIF", "1:4: found `1 1`"),
        ("IF NOT 1 < 2\nENDIF", "1:4: found `NOT 1 < 2`"),
        ("IF 1 < 2x\nENDIF", "1:8: found `2x`, allowed a finite number"),
        ("IF DI part", "1:1: found IF without ENDIF"),
        ("ELSE", "1:1: found ELSE without an IF before it"),
        ("IF DI part\nENDIF\nENDIF", "3:1: found ENDIF without an IF before it"),
        ("IF DI part\nELSE\nELSE\nENDIF", "3:1: found a second ELSE of one IF, allowed ENDIF"),
        ("IF DI part\nENDIF x", "2:7: found `x` after ENDIF"),
        ("IF n < 3\nENDIF", "1:4: found the variable `n`, which is never set, allowed a variable of a LET: no LET"),
        ("LET n = m\nLET k = 1", "1:9: found the variable `m`, which is never set, allowed a variable of a LET: k, n"),
        ("LET n", "1:1: found `LET n`, allowed LET name = a, or a + b"),
        ("LET n = 1 +", "1:11: found `+`"),
        ("LET n = 1 + 2 + 3", "1:11: found `+ 2 + 3`"),
        ("LET n = 4 / 0", "1:11: found a division by 0"),
        ("LET DI3 = 1", "1:5: found `DI3`, allowed the name of a variable"),
        ("LET or = 1", "1:5: found `or`, allowed the name of a variable"),
        ("LET cell.parts = 1", "1:1: found `LET cell.parts = 1`"),
        ("WAIT DI", "1:6: found `DI`, allowed WAIT DI and the name of an input"),
        ("WAIT DI gate", "1:9: found unknown input `gate`"),
        ("WAIT DI part on timeout", "1:17: found `timeout`"),
        ("WAIT DI part TIMEOUT 0", "1:22: found TIMEOUT 0, allowed more than 0, up to 3600 s"),
        ("WAIT DI part TIMEOUT 5 GOTO no", "1:29: found unknown label `no`"),
        ("M", "1:1: found `M`, allowed M and a number, 0 to 999; if wanted, ASYNC"),
        ("M 1000", "1:3: found M 1000, allowed a whole number, 0 to 999"),
        ("M 5 SOON", "1:1: found `M 5 SOON`"),
        ("LOOKAHEAD 2", "1:1: found `LOOKAHEAD 2`"),
    ],
)
def test_a_mistake_is_named_with_its_place_and_what_is_allowed(text: str, problem: str) -> None:
    assert problem_of(text).startswith(problem)


def test_more_variables_than_are_told_are_refused() -> None:
    text = "".join(f"LET n{i} = {i}\n" for i in range(101))
    assert problem_of(text) == "101:5: found variable number 101, allowed 100 in a program"


@pytest.mark.parametrize("words", ["DI3", "di3", "DI 3"])
def test_a_number_stands_for_the_letters_and_it(words: str) -> None:
    (wait,) = run(f"WAIT {words}")
    assert isinstance(wait, AwaitInput)
    assert wait.signal == Signal("DI", "di3")
    assert pauses(f"IF {words}\nWAIT 1\nENDIF", frozenset({"di3"})) == [1]


@pytest.mark.parametrize("words", ["DO3", "do3", "DO 3"])
def test_so_for_outputs(words: str) -> None:
    (now,) = run(f"SET {words}")
    assert isinstance(now, SwitchNow)
    assert [(each.output, each.on) for each in now.switches if not isinstance(each, FlagMark)] == [("do3", True)]


WORDS = ["IF", "ELSE", "ENDIF", "LET", "WAIT", "DI", "part", "AND", "OR", "NOT", "<", "=", "1", "n", "+", "-", "*", "/"]


@given(st.lists(st.sampled_from([*WORDS, "\n"]), max_size=20))
def test_no_words_make_the_parser_fail_otherwise(words: list[str]) -> None:
    with contextlib.suppress(ProgramError):
        assert parse_program(" ".join(words), "p", NAMES).statements


# Which way a program goes


@pytest.mark.parametrize("ahead", [0, 1])
@pytest.mark.parametrize(
    ("condition", "on", "holds"),
    [
        ("DI part", {"part"}, True),
        ("NOT DI part", {"part"}, False),
        ("DO gripper", {"gripper"}, True),
        ("DI part AND DI door", {"part"}, False),
        ("DI part OR DI door", {"part"}, True),
        ("DI part AND 1 < 2", {"part"}, True),
        ("DI part OR 1 < 2", set(), True),
        ("1=1", set(), True),
        ("1<>1", set(), False),
        ("-1 <= -1", set(), True),
        ("2 >= 3", set(), False),
        ("a = 0.3", set(), True),
        ("a > 0.3", set(), False),
    ],
)
def test_a_condition_holds_or_not(condition: str, on: set[str], holds: bool, ahead: int) -> None:
    text = f"LOOKAHEAD {ahead}\nLET a = 0.1 + 0.2\nIF {condition}\nWAIT 1\nELSE\nWAIT 2\nENDIF\nWAIT 3"
    assert pauses(text, frozenset(on)) == [1 if holds else 2, 3]


@dataclass(frozen=True)
class Branch:
    """A tree of a program: what an IF asks, and what is done then and else."""

    asks: str
    then: "tuple[int | Branch, ...]"
    otherwise: "tuple[int | Branch, ...] | None"


def _trees() -> st.SearchStrategy[tuple[int | Branch, ...]]:
    asks = st.sampled_from(["DI part", "NOT DI part", "DI door", "DO gripper", "n < 2", "n >= 2"])
    leaf = st.integers(1, 9)
    trees: st.SearchStrategy[tuple[int | Branch, ...]] = st.recursive(
        st.lists(leaf, max_size=3).map(tuple),
        lambda inner: st.lists(st.one_of(leaf, st.builds(Branch, asks, inner, st.none() | inner)), max_size=3).map(
            tuple
        ),
        max_leaves=12,
    )
    return trees


def _text(tree: tuple[int | Branch, ...]) -> list[str]:
    lines = []
    for each in tree:
        if isinstance(each, int):
            lines += [f"WAIT {each}", "LET n = n + 1"]
        else:
            lines += [f"IF {each.asks}", *_text(each.then)]
            lines += [] if each.otherwise is None else ["ELSE", *_text(each.otherwise)]
            lines += ["ENDIF"]
    return lines


def _walked(tree: tuple[int | Branch, ...], on: frozenset[str], before: list[float]) -> list[float]:
    """What the tree does, by itself: `n` is how many waits there were."""
    for each in tree:
        if isinstance(each, int):
            before = [*before, each]
            continue
        *_, last = each.asks.split()
        if each.asks.startswith("n"):
            holds = len(before) < 2 if "<" in each.asks else len(before) >= 2
        else:
            holds = (last in on) != each.asks.startswith("NOT")
        before = _walked(each.then if holds else each.otherwise or (), on, before)
    return before


@given(_trees(), st.frozensets(st.sampled_from(["part", "door", "gripper"])), st.booleans())
def test_nested_branches_go_as_a_walk_through_their_tree(
    tree: tuple[int | Branch, ...], on: frozenset[str], ahead: bool
) -> None:
    lines = ["LET n = 0", f"LOOKAHEAD {int(ahead)}", *_text(tree)]
    assert pauses("\n".join(lines), on) == _walked(tree, on, [])


def test_a_loop_counts_with_a_variable() -> None:
    text = "LET n = 0\nLABEL l\nWAIT 1\nLET n = n + 1\nIF n < 3\nGOTO l\nENDIF\nWAIT 9"
    assert pauses(text) == [1, 1, 1, 9]


def test_a_jump_into_a_branch_goes_on_at_its_endif() -> None:
    assert pauses("GOTO in 1\nIF DI part\nWAIT 1\nLABEL in\nWAIT 2\nELSE\nWAIT 3\nENDIF\nWAIT 4") == [2, 4]


@pytest.mark.parametrize(
    ("sum_", "value"), [("7", 7), ("-7", -7), ("5+3", 8), ("5 - 3", 2), ("5 - -3", 8), ("5*-3", -15), ("1e1/4", 2.5)]
)
def test_let_counts(sum_: str, value: float) -> None:
    interpreter = Interpreter(parse_program(f"LET n = {sum_}\nLET m=n\nWAIT 1", "p", NAMES))
    interpreter.next()
    assert interpreter.variables == {"n": value, "m": value}


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("WAIT 1\nIF DI part\nLET n = 1\nENDIF\nLET m = n", "the variable n is not set yet when the program comes"),
        ("WAIT 1\nGOTO l 1\nLET n = 1\nLABEL l\nIF n = 1\nENDIF", "the variable n is not set yet"),
        ("WAIT 1\nLET n = 0\nLET m = 1\n\nLET m = m / n", "LET m: a division by n, which is 0 here"),
        ("WAIT 1\nLET n = 1e12\n\n\nLET n = n * 2", "LET n: 2e+12 is beyond -1e+12 to 1e+12"),
    ],
)
def test_what_cannot_be_counted_ends_the_program_there(text: str, fault: str) -> None:
    pause, found = run(text)
    assert isinstance(pause, Pause)
    assert isinstance(found, ProgramFault)
    assert found.line == 5
    assert found.text.startswith(fault)


# What is asked at rest


def test_numbers_need_no_stop_and_signals_do_without_look_ahead() -> None:
    text = "LET n = 1\nMJ J1=1\nIF {}\nMJ J1=2\nENDIF"
    for condition, ahead, kinds in (
        ("n = 1", 0, [JointStep, JointStep, Finished]),
        ("DI part", 1, [JointStep, JointStep, Finished]),
        ("DI part", 0, [JointStep, Decide, Decide]),
        ("DI part OR n = 1", 0, [JointStep, JointStep, Finished]),
    ):
        program = parse_program(f"LOOKAHEAD {ahead}\n" + text.format(condition), "p", NAMES)
        interpreter = Interpreter(program, known=lambda _: True)
        assert [type(interpreter.next()) for _ in range(3)] == kinds


def test_what_nobody_knows_is_decided_at_rest_also_with_look_ahead() -> None:
    interpreter = Interpreter(parse_program("LOOKAHEAD 1\nIF DI part\nWAIT 1\nELSE\nWAIT 2\nENDIF", "p", NAMES))
    step = interpreter.next()
    assert isinstance(step, Decide)
    assert step.test.holds(lambda _: None) is None
    interpreter.decide(False)
    pause = interpreter.next()
    assert isinstance(pause, Pause)
    assert pause.duration_s == 2


def test_only_a_wait_with_a_way_out_forks() -> None:
    text = "WAIT DI part OFF TIMEOUT 5\nWAIT DI part TIMEOUT 5 GOTO l\nWAIT 1\nLABEL l\nWAIT 2"
    for in_time, then in ((True, 1.0), (False, 2.0)):
        interpreter = Interpreter(parse_program(text, "p", NAMES))
        plain, way_out = interpreter.next(), interpreter.next()
        assert isinstance(plain, AwaitInput)
        assert isinstance(way_out, AwaitInput)
        assert (plain.on, plain.timeout_s, forks(plain)) == (False, 5.0, False)
        assert forks(way_out)
        assert interpreter.next() is way_out
        interpreter.decide(in_time)
        pause = interpreter.next()
        assert isinstance(pause, Pause)
        assert pause.duration_s == then


def test_a_flag_is_waited_for_or_belongs_to_the_move_before_it() -> None:
    move, wait, last = run("MJ J1=1\nM 5 ASYNC\nM 7 ASYNC\nM 3\nMJ J1=2\nm 5 async")
    assert isinstance(move, JointStep)
    assert move.switches == (FlagMark(2, 5, 1), FlagMark(3, 7, 2))
    assert isinstance(wait, AwaitAnswer)
    assert wait.flag == 3
    assert isinstance(last, JointStep)
    assert last.switches == (FlagMark(6, 5, 3),)


# For checks


def test_checks_go_both_ways_of_each_fork() -> None:
    text = """IF DI part
IF n = 1
WAIT 1
ELSE
WAIT 2
WAIT DI door TIMEOUT 1 GOTO l
WAIT 3
LABEL l
ENDIF
ELSE
WAIT 4
ENDIF
GOTO out 1
LET n = 1
LABEL out"""
    program, ways, seen = parse_program(text, "p", NAMES), Ways(), set[float]()
    for _ in ways.rounds(program.statements):
        interpreter = Interpreter(program, ways=ways)
        while not isinstance(step := interpreter.next(), Finished):
            assert not isinstance(step, ProgramFault), "variables have no values there, and are not missed"
            seen |= {step.duration_s} if isinstance(step, Pause) else set()
    assert seen == {1, 2, 3, 4}


def test_a_program_without_forks_is_gone_through_once() -> None:
    program = parse_program("WAIT 1", "p", NAMES)
    assert list(Ways().rounds(program.statements)) == [1]
