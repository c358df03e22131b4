"""WAIT DI, IF and M while a robot runs: it rests there, asks what is so then, and goes on by the answer."""

import numpy as np
import pytest

from cell.messages import AnswerFlag, Continue, Enable, Halt, Mode, ProgramState, ResetRobot, Run, SetOverride
from tests.unit.agent_runs import BACK, INTO, enabled, ended, near_zone, until
from tests.unit.agent_world import AgentWorld
from tests.unit.robot_agent.agent.program.conditional_runs import WAITS, begun, j1, told, waits


def failure(world: AgentWorld) -> str:
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    return world.state.program.error


# Inputs


def test_it_stands_until_the_input_is_on_and_says_which() -> None:
    world = begun(WAITS, part=False)
    until(world, waits(world))
    world.run(1.0)
    assert j1(world) == pytest.approx(20.0)
    assert world.state.waiting_for == (
        "input part is off, WAIT DI goes on when it is on; in a simulated cell `cell simulate input left part on`"
    )
    assert world.state.program.text == "WAIT DI part"
    assert 1.0 <= (world.state.program.waits_s or 0.0) < 1.5
    told(world, part=True)
    until(world, ended(world), 4.0)
    assert world.state.program.waits_s is None


def test_it_waits_for_an_input_to_go_off() -> None:
    world = begun(WAITS.replace("part", "part OFF"), part=True)
    until(world, waits(world))
    told(world, part=False)
    until(world, ended(world), 4.0)


@pytest.mark.parametrize(
    ("inputs", "why"),
    [
        (None, "WAIT DI: nothing young is heard of input part"),
        ({"part": None}, "WAIT DI: input part is not known"),
        ({"door": True}, "WAIT DI: the gateway has not told input part"),
    ],
)
def test_an_input_that_is_not_known_is_neither_on_nor_off(inputs: dict[str, bool | None] | None, why: str) -> None:
    for on in ("ON", "OFF"):
        world = begun(WAITS.replace("part", f"part {on}"), part=on == "OFF")
        until(world, waits(world))
        world.inputs = inputs
        world.run(1.5)
        assert world.state.waiting_for == why
        assert waits(world)()


def test_what_was_measured_before_the_robot_came_does_not_count() -> None:
    """The gateway falls silent on the way: what it said last is younger than 0.6 s, and older than the arrival."""
    world = begun("MJ J1=20\nIF DI part\nMJ J1=0\nENDIF", part=True)
    until(world, lambda: j1(world) > 19.99)
    world.inputs = None
    world.run(2.0)
    assert world.state.waiting_for == "IF: nothing young is heard of input part"
    world.inputs = {"part": False}
    until(world, ended(world), 2.0)
    assert j1(world) == pytest.approx(20.0)


def test_a_time_out_ends_the_program_with_the_name_of_the_input() -> None:
    world = begun(WAITS.replace("part", "part TIMEOUT 1"), part=False)
    until(world, waits(world))
    assert failure(world).startswith("line 2: input part was not in time, within 1 s: input part is off, WAIT DI goes")
    assert world.state.mode is Mode.READY


def test_the_time_of_a_halt_is_not_counted() -> None:
    world = begun(WAITS.replace("part", "part TIMEOUT 1"), part=False)
    until(world, waits(world))
    world.call(Halt())
    world.run(3.0)
    assert (world.state.mode, world.state.program.state) == (Mode.HALTED, ProgramState.RUNNING)
    world.call(Continue())
    world.run(0.5)
    assert world.state.program.state is ProgramState.RUNNING
    assert "not in time" in failure(world)


def test_a_time_out_with_a_label_goes_on_there() -> None:
    program = "MJ J1=20\nWAIT DI part TIMEOUT 0.5 GOTO late\nMJ J1=10\nEND\nLABEL late\nMJ J1=30\nEND"
    for part, place in ((True, 10.0), (False, 30.0)):
        world = begun(program, part=part)
        until(world, ended(world))
        assert j1(world) == pytest.approx(place)


def test_what_comes_behind_a_wait_is_planned_already_and_behind_a_fork_is_not() -> None:
    for words, planned in (("WAIT DI part", 2), ("WAIT DI part TIMEOUT 9 GOTO l", 1), ("M 5", 2)):
        world = begun(f"MJ J1=20\n{words}\nMJ J1=0\nLABEL l\nEND", part=False)
        until(world, waits(world))
        world.run(0.2)
        assert len(world.planned) == planned, words


def test_a_pause_behind_a_wait_begins_when_that_is_over() -> None:
    world = begun("MJ J1=5\nWAIT DI part\nWAIT 1\nMJ J1=0\nEND", part=False)
    until(world, waits(world))
    world.run(2.0)
    told(world, part=True)
    went_on = world.now
    until(world, lambda: world.state.program.line == 4)
    assert world.now - went_on == pytest.approx(1.0, abs=0.3)


def test_a_zone_behind_a_wait_is_not_held_meanwhile() -> None:
    world = begun(f"MJ {near_zone()}\nWAIT DI part\n{INTO}\n{BACK}\nEND", part=False)
    world.grant()
    until(world, waits(world))
    world.run(1.0)
    assert not any(presence.holds or presence.wants for presence in world.presences[-20:])
    told(world, part=True)
    until(world, ended(world))
    assert any(presence.holds for presence in world.presences)


def test_a_robot_without_the_input_or_output_does_not_begin() -> None:
    for program, asked in (("IF DI gate\nENDIF\nEND", "input gate"), ("IF DO glue\nENDIF\nEND", "output glue")):
        world = enabled(program)
        world.inputs = {"part": True}
        world.run(0.1)
        call = world.call(Run())
        world.run(0.1)
        assert f"line 1 of left.prog asks for the {asked}, which its gateway" in world.replies[call].text


# Branches


@pytest.mark.parametrize(("part", "place"), [(True, 40.0), (False, -10.0)])
def test_an_if_goes_by_what_is_so_where_the_robot_is(part: bool, place: float) -> None:
    world = begun("MJ J1=20\nIF DI part\nMJ J1=40\nELSE\nMJ J1=-10\nENDIF\nMJ J2=5\nEND", part=not part)
    until(world, lambda: j1(world) > 15.0)
    told(world, part=part)
    until(world, ended(world))
    assert j1(world) == pytest.approx(place)


def test_an_output_that_was_just_switched_is_on() -> None:
    program = (
        "MJ J1=5\nSET DO gripper\nIF DO gripper\nMJ J1=10\nENDIF\nRESET DO gripper\nIF DO gripper\nMJ J1=20\nENDIF"
    )
    world = begun(program, outputs=("gripper",))
    until(world, ended(world))
    assert j1(world) == pytest.approx(10.0)


JOINED = (
    "MJ J1=0 J2=0 J3=0 J4=0 J5=30 J6=0\nLET n = 0\nLABEL l\nMJ J1=10 R=20\nMJ J2=10 R=20\nMJ J1=0 R=20\nMJ J2=0 R=20\n"
)


def rests(world: AgentWorld) -> int:
    """How often it came to rest on its way."""
    still = ~np.any(np.diff(world.played, axis=0), axis=1)
    return int(np.count_nonzero(still[1:] & ~still[:-1]))


def test_numbers_and_what_is_decided_ahead_need_no_stop() -> None:
    loop = "LET n = n + 1\nIF {}\nGOTO l\nENDIF\nEND"
    found = list[int]()
    for condition, ahead in (("n < 2", 0), ("n < 2 AND DI part", 1), ("n < 2 AND DI part", 0)):
        world = begun(f"LOOKAHEAD {ahead}\n{JOINED}{loop.format(condition)}", part=True)
        until(world, ended(world))
        found.append(rests(world))
    number, looked_ahead, asked = found
    assert number == looked_ahead
    assert asked == number + 1  # the second time the number alone decides


def test_variables_are_told_and_begin_anew() -> None:
    world = begun("LET n = 4\nMJ J1=5\nLET n = n / 8\nEND")
    until(world, ended(world))
    assert world.state.program.variables == {"n": 0.5}
    world = begun("MJ J1=5\nIF DI part\nLET n = 1\nENDIF\nLET m = n\nEND", part=True)
    until(world, ended(world))
    assert world.state.program.variables == {"n": 1.0, "m": 1.0}
    told(world, part=False)
    world.call(Run())
    assert failure(world) == "the variable n is not set yet when the program comes here: LET it first"
    assert world.state.program.line == 5


# Flags


def test_it_waits_at_a_flag_until_that_is_answered() -> None:
    world = begun("MJ J1=20\nM 7\nMJ J1=0\nEND")
    early = world.call(AnswerFlag(7))
    until(world, waits(world))
    assert world.replies[early].text == (
        "left: no program waits at a flag: it goes on by `cell flag left N` with the number of the M at which it waits"
    )
    world.run(0.5)
    assert world.state.waiting_for == "M 7 waits for an answer: `cell flag left 7`"
    assert world.state.program.flag == 7
    wrong = world.call(AnswerFlag(8))
    world.run(0.1)
    assert not world.replies[wrong].ok
    assert world.state.program.flag == 7
    right = world.call(AnswerFlag(7))
    until(world, ended(world))
    assert (world.replies[right].ok, world.state.program.flag) == (True, None)


def test_the_answer_to_one_flag_is_none_to_the_next_of_the_same_number() -> None:
    world = begun("LABEL l\nM 7\nGOTO l 1\nEND")
    for _ in range(2):
        until(world, lambda: world.state.program.flag == 7)
        world.run(0.5)
        assert world.state.program.flag == 7
        world.call(AnswerFlag(7))
        world.run(0.02)
    until(world, ended(world))


def test_a_halted_program_may_be_answered_and_goes_on_when_it_continues() -> None:
    world = begun("MJ J1=20\nM 7\nMJ J1=0\nEND")
    until(world, waits(world))
    world.call(Halt())
    world.run(0.2)
    call = world.call(AnswerFlag(7))
    world.run(1.0)
    assert (world.replies[call].ok, j1(world)) == (True, pytest.approx(20.0))
    world.call(Continue())
    until(world, ended(world))


ROUND = JOINED.replace("MJ J2=10 R=20\n", "MJ J2=10 R=20\nM 5 ASYNC\n") + "M 6 ASYNC\nGOTO l 1\nM 6 ASYNC\nEND"


def test_a_flag_that_nobody_answers_is_counted_without_a_stop() -> None:
    world, plain = begun(ROUND), begun(ROUND.replace("M 5 ASYNC\n", "").replace("M 6 ASYNC\n", ""))
    until(world, ended(world))
    until(plain, ended(plain))
    assert world.state.program.raised == {"5": 2, "6": 3}
    assert rests(world) == rests(plain)
    counted = [state.program.raised.get("5", 0) for state in world.states]
    assert counted == sorted(counted)
    world.call(Run())
    until(world, lambda: world.state.program.raised == {})


def test_going_back_counts_nothing_and_asks_nothing() -> None:
    world = begun("MJ J1=20 F=20\nM 5 ASYNC\nMJ J1=40 F=20\nWAIT DI part TIMEOUT 1\nEND", part=False)
    until(world, lambda: world.state.program.line == 3)
    world.run(0.3)
    assert world.state.program.raised == {"5": 1}
    until(world, waits(world, 4))
    world.call(SetOverride(-50.0))
    until(world, lambda: world.state.program.line == 3)
    world.run(1.5)
    assert world.state.program.state is ProgramState.RUNNING
    told(world, part=True)
    world.run(1.0)
    assert world.state.program.state is ProgramState.RUNNING
    world.call(SetOverride(100.0))
    until(world, ended(world))
    assert world.state.program.raised == {"5": 1}


# Stops at any time


@pytest.mark.parametrize("words", ["WAIT DI part", "M 7", "IF DI part"])
def test_after_a_fault_it_waits_on_where_it_was(words: str) -> None:
    closing = "ENDIF\n" if words.startswith("IF") else ""
    world = begun(f"MJ J1=20\n{words}\n{closing}MJ J1=0\nEND", part=None)
    until(world, waits(world))
    world.quick_stop()
    until(world, lambda: world.state.mode is Mode.FAULT)
    world.faulty = False
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    told(world, part=True)
    world.run(0.5)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Continue())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    if words == "M 7":
        until(world, waits(world))
        world.call(AnswerFlag(7))
    until(world, ended(world))
