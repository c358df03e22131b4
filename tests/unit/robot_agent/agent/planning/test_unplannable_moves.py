"""A move that cannot be planned: the robot goes as far as it can, and says there why it stands."""

import numpy as np
import pytest

from cell.messages import Mode, ProgramState
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.language import Names, parse_program
from tests.unit.agent_runs import running, until
from tests.unit.agent_world import AgentWorld

TO_START = "MJ J1=0 J2=-20 J3=30 J4=0 J5=60 J6=0\n"
FAR = "ML X=9000 F=300\nML Y=0\nEND"


def failed(program: str) -> AgentWorld:
    world = running(program)
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    return world


def place(world: AgentWorld) -> list[float]:
    """Of the TCP [mm]."""
    return [1000.0 * float(value) for value in world.planner.model.forward(world.commanded)[:3, 3]]


def test_moves_before_one_that_cannot_be_planned_are_run_and_the_robot_stands_before_it() -> None:
    world = failed(f"{TO_START}ML Y=-100 F=300 R=20\nML Z=1300\n{FAR}")
    assert place(world)[1:] == pytest.approx([-100.0, 1300.0], abs=0.01)
    assert (world.state.mode, world.state.program.line) == (Mode.READY, 4)
    assert world.state.program.error.startswith("line 4")
    assert world.events[-1].text == world.state.program.error
    assert world.state.alarms == (world.state.program.error,)


@pytest.mark.parametrize("line", [2, 4])
def test_what_a_path_comes_to_stops_it_at_the_end_of_the_move_before(line: int) -> None:
    """Where the first move of a chain is the one, nothing of it begins, as ever."""
    moves = ["ML Y=-100 F=300 R=10", "ML Z=1300 R=10", "ML Y=100 R=10", "ML Z=1400"]
    world = failed(TO_START + "\n".join([*moves[: line - 2], FAR]))
    expected = {2: TO_START, 4: TO_START + "\n".join(moves[:2])}[line]
    there = running(f"{expected}\nEND")
    until(there, lambda: there.state.program.state is ProgramState.DONE)
    assert world.state.program.line == line
    np.testing.assert_allclose(world.commanded, there.commanded, atol=1e-6)


def test_a_curve_that_would_be_another_one_without_the_move_is_not_begun() -> None:
    world = failed(f"{TO_START}ML Z=1350 F=300\nMS Y=100\nMS Y=150 Z=1400\n{FAR}")
    assert world.state.program.line == 5
    assert place(world)[1:] == pytest.approx([0.0, 1350.0], abs=0.01)


def test_a_check_names_the_same_line_and_shows_what_comes_before() -> None:
    arm = AgentWorld("END").planner
    program = parse_program(f"{TO_START}ML Z=1350 F=300\nML Y=50\n{FAR}", "p", Names(arm.model.joint_names))
    motions, refused = dry_run(arm, program, 60.0)
    assert [planned.lines for planned in motions] == [(1,), (2, 3)]
    assert refused is not None
    assert refused.line == 4
