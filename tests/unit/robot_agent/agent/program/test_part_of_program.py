"""`cell run --from --to --dry`: a part of the program runs, or is refused with what to do."""

import math

import pytest

from cell.messages import Mode, ProgramState, Run
from tests.unit.agent_runs import enabled, until

PROGRAM = "MJ J1=10\nMJ J1=20\nSET DO glue\nMJ J1=30\nTRACK OFF\nEND"


def test_a_part_runs_from_where_the_robot_stands_to_its_last_line() -> None:
    world = enabled(PROGRAM, outputs=("glue",))
    world.call(Run(first_line=2, last_line=2))
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    assert world.played[-1][0] == pytest.approx(math.radians(20.0), abs=1e-6)


@pytest.mark.parametrize(("dry", "switched"), [(False, [True]), (True, [])])
def test_a_dry_run_moves_and_switches_nothing(dry: bool, switched: list[bool]) -> None:
    world = enabled(PROGRAM, outputs=("glue",))
    world.call(Run(dry=dry))
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    assert world.played[-1][0] == pytest.approx(math.radians(30.0), abs=1e-6)
    assert [event.value for _, event in world.switched] == switched


def test_what_is_no_beginning_is_refused_and_nothing_moves() -> None:
    world = enabled(PROGRAM, outputs=("glue",))
    call = world.call(Run(first_line=9))
    world.run(0.1)
    reply = world.replies[call]
    assert not reply.ok
    assert "line 9, which has no statement; the nearest is line 6" in reply.text
    assert world.state.mode is Mode.READY
