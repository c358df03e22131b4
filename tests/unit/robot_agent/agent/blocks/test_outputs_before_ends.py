"""Outputs at a way or a time in front of the end of a move: on the path, however it is gone through."""

import random

import numpy as np
import pytest

from cell.messages import Continue, Halt, Mode, ProgramState, SetOverride
from robot_agent.agent.planning import lookahead
from robot_agent.language import Names, ProgramError, parse_program
from tests.unit.agent_rounds import TO_START, extensions
from tests.unit.agent_runs import ended, until
from tests.unit.agent_world import CYCLE_S, AgentWorld
from tests.unit.output_ticks import FIRST_TICK, ticks
from tests.unit.robot_agent.agent.blocks.output_runs import begun, switched

LINE = """MJ J1=0 J2=-20 J3=30 J4=0 J5=60 J6=0
ML Y=-100 Z=1400 F=400
ML Y=100
SET DO glue BEFORE 150 MM
RESET DO glue BEFORE 30.5 mm
SET DO gripper
ML Y=0
END"""


def y_mm(world: AgentWorld) -> np.ndarray:
    return 1000.0 * world.planner.model.forward(np.array(world.played))[:, 1, 3]


def passed(world: AgentWorld, *places: float) -> list[int]:
    """The first ticks at which the TCP, on the line in Y, has come to these places [mm], in their order."""
    y, found, since = y_mm(world), list[int](), int(np.argmin(y_mm(world)))
    for place in places:
        since += int(np.argmax(y[since:] >= place - 0.005))
        found.append(since + FIRST_TICK)
    return found


def test_outputs_switch_where_so_much_way_is_left() -> None:
    world = begun(LINE)
    until(world, ended(world))
    assert switched(world) == [("glue", True), ("glue", False), ("gripper", True)]
    *before, at_end = ticks(world)
    *expected, end = passed(world, -50.0, 69.5, 100.0)
    assert before == expected
    assert 0 <= at_end - end < 6  # the last micrometres take some ticks


@pytest.mark.parametrize("seed", range(2))
def test_override_halts_and_going_back_neither_shift_nor_lose_nor_double_them(seed: int) -> None:
    drawn, world = random.Random(seed), begun(LINE)
    while world.state.program.state is not ProgramState.DONE:
        world.step()
        assert world.now < 250.0
        if drawn.random() < 0.08:
            world.call(SetOverride(drawn.choice([100.0, 100.0, 60.0, -40.0])))
        elif drawn.random() < 0.03:
            world.call(Halt())
            world.run(0.02 * drawn.randint(1, 30))
            world.call(Continue())
        elif world.state.pace.override < 0 and drawn.random() < 0.5:
            world.call(SetOverride(100.0))
    assert switched(world) == [("glue", True), ("glue", False), ("gripper", True)]
    *before, at_end = ticks(world)
    *expected, end = passed(world, -50.0, 69.5, 100.0)
    assert before == expected
    assert 0 <= at_end - end < 6  # the last micrometres take some ticks


def test_a_time_is_that_of_the_plan() -> None:
    world = begun("MJ J1=10 F=20\nSET DO glue BEFORE 0.2 S\nMJ J1=11\nEND")
    until(world, ended(world))
    moving = np.flatnonzero(np.diff(np.array(world.played)[:, 0]))
    (motion, *_) = world.planned
    left = float(motion.motion.duration_s if len(motion.lines) == 1 else motion.motion.ends[0]) - 0.2
    assert ticks(world)[0] - (moving[0] + FIRST_TICK) == pytest.approx(left / CYCLE_S, abs=1.5)


def test_what_is_farther_than_its_move_is_long_is_at_its_beginning_and_never_before_what_stands_above_it() -> None:
    world = begun(LINE.replace("150 MM", "999 MM").replace("SET DO gripper", "SET DO gripper BEFORE 120 MM"))
    until(world, ended(world))
    assert switched(world) == [("glue", True), ("glue", False), ("gripper", True)]
    assert ticks(world)[1:] == passed(world, 69.5, 69.5)
    assert 0 <= ticks(world)[0] - passed(world, -100.0)[0] < 3


def test_a_round_edge_counts_from_its_middle_and_arcs_by_their_length() -> None:
    program = LINE.replace("ML Y=100\n", "MC QY=0 QZ=1500 Y=100 Z=1400\n").replace("150 MM", "157.079633 MM")
    world = begun(program)
    until(world, ended(world))
    first = ticks(world)[0] - FIRST_TICK
    assert y_mm(world)[first - 1] < 0.01 <= y_mm(world)[first] + 0.02  # half of the half circle is left


def test_in_a_long_chain_that_is_extended_each_is_at_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lookahead, "_CHAIN", 6)
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.0)
    moves = "".join(f"ML Y={20 * k}\n{('SET', 'RESET')[k % 2]} DO glue BEFORE 7.5 MM\n" for k in range(1, 20))
    world = begun(f"{TO_START}ML Y=0 Z=1400 F=100\n{moves}END")
    until(world, ended(world))
    assert extensions(world) != []
    assert ticks(world) == passed(world, *(20.0 * k - 7.5 for k in range(1, 20)))


def test_at_rest_it_switches_at_once() -> None:
    world = begun("MJ J1=3\nWAIT 0.1\nSET DO glue BEFORE 50 MM\nMJ J1=0\nEND")
    until(world, lambda: world.state.mode is Mode.READY)
    assert switched(world) == [("glue", True)]


@pytest.mark.parametrize(
    ("words", "column"), [("50", 13), ("BEFORE 50", 13), ("BEFORE 0 MM", 20), ("BEFORE -1 S", 20), ("BEFORE 5 KM", 13)]
)
def test_a_place_has_a_positive_value_and_a_unit(words: str, column: int) -> None:
    with pytest.raises(ProgramError) as error:
        parse_program(f"SET DO glue {words}", "p", Names(("J1",)))
    assert str(error.value).startswith(f"p:1:{column}: found ")
