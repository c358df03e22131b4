"""An operator forces an input: the programs of one robot see that until it follows again, and nobody else does."""

from dataclasses import replace

import numpy as np
import pytest

from cell.core import Shutdown
from cell.messages import Command, Enable, ForceInput, Halt, Mode, Reply, Run, Severity
from tests.unit.agent_runs import enabled, ended, until
from tests.unit.agent_world import AgentWorld
from tests.unit.robot_agent.agent.program.conditional_runs import WAITS, begun, j1, told, waits
from tests.unit.robot_agent.agent.zones.gate_runs import GATE, ROUND


def answer(world: AgentWorld, command: Command) -> Reply:
    call = world.call(command)
    until(world, lambda: call in world.replies)
    world.step()
    return world.replies[call]


def codes(world: AgentWorld) -> list[str]:
    return [event.code for event in world.events]


def test_a_program_that_waits_goes_on_by_the_force_and_everybody_is_told() -> None:
    world = begun(WAITS, part=False)
    until(world, waits(world))
    reply = answer(world, ForceInput("part", True))
    assert (reply.ok, reply.text) == (
        True,
        "programs of left see input part on, whatever its gateway tells; `cell input left part follow` ends that",
    )
    assert world.state.forced == {"part": True}
    assert (codes(world), world.events[-1].severity) == (["input_forced"], Severity.WARNING)
    until(world, ended(world), 4.0)


def test_a_wait_says_that_its_input_is_forced_and_what_ends_that() -> None:
    world = enabled(WAITS)
    world.inputs = {"part": True}
    world.run(0.1)
    assert answer(world, ForceInput("part", False)).ok
    world.call(Run())
    until(world, waits(world))
    assert world.state.waiting_for == (
        "input part is forced off, WAIT DI goes on when it is on; `cell input left part follow` ends that"
    )
    assert answer(world, ForceInput("part", None)).text == "programs of left see input part as its gateway tells it"
    assert (world.state.forced, codes(world)) == ({}, ["input_forced", "input_follows"])
    until(world, ended(world), 4.0)


@pytest.mark.parametrize("on", [True, False])
def test_a_branch_goes_by_the_force_even_where_nothing_is_heard(on: bool) -> None:
    world = enabled("MJ J1=10\nIF DI part\nMJ J1=20\nELSE\nMJ J1=-20\nENDIF\nEND")
    world.inputs = {"part": not on}
    world.run(0.1)
    assert answer(world, ForceInput("part", on)).ok
    world.call(Run())
    world.inputs = None
    until(world, ended(world))
    assert j1(world) == pytest.approx(20.0 if on else -20.0)


def test_after_follow_the_next_question_is_answered_by_the_gateway() -> None:
    world = begun("MJ J1=10\nWAIT DI part\nMJ J1=20\nWAIT DI part\nMJ J1=30\nEND", part=False)
    until(world, waits(world))
    answer(world, ForceInput("part", True))
    answer(world, ForceInput("part", None))
    until(world, waits(world, 4))
    world.run(1.0)
    assert j1(world) == pytest.approx(20.0)
    told(world, part=True)
    until(world, ended(world))


def test_a_force_is_noted_once_and_changes_from_on_to_off() -> None:
    world = begun(WAITS, part=False)
    answer(world, ForceInput("part", False))
    assert answer(world, ForceInput("part", False)).text.endswith("whatever its gateway tells, as before")
    answer(world, ForceInput("part", True))
    assert (world.state.forced, codes(world)) == ({"part": True}, ["input_forced"] * 2)
    answer(world, ForceInput("part", None))
    assert answer(world, ForceInput("part", None)).text.endswith("as its gateway tells it, as before")
    assert codes(world) == ["input_forced"] * 2 + ["input_follows"]


@pytest.mark.parametrize("on", [True, None])
@pytest.mark.parametrize(
    ("inputs", "why"),
    [
        ({"part": False, "door": True}, "unknown input 'prat' of left, allowed part; there are also door"),
        ({}, "unknown input 'prat' of left, allowed none: its drives file has no inputs for it"),
        (None, "the gateway of left has not told its inputs yet: call again when it has"),
    ],
)
def test_only_known_inputs_are_forced(on: bool | None, inputs: dict[str, bool | None] | None, why: str) -> None:
    world = enabled(WAITS)
    world.inputs = inputs
    world.run(0.1)
    reply = answer(world, ForceInput("prat", on))
    assert (reply.ok, reply.text, world.state.forced) == (False, why, {})


def test_an_input_that_switches_a_space_is_never_forced() -> None:
    world = AgentWorld(ROUND, spaces=(GATE,))
    world.inputs = {"door": False}
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    reply = answer(world, ForceInput("door", True))
    assert (reply.ok, reply.text) == (
        False,
        "input door of left switches space gate: only its gateway says how it is",
    )


def test_a_force_changes_no_space_whatever_its_name() -> None:
    """Should one get past the check, the space still goes by what the gateway tells."""
    world = AgentWorld(ROUND, spaces=(replace(GATE, off_while="door"),))
    world.inputs = {"door": False}
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.agent.forced.on["door"] = True
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    until(world, lambda: "space gate: input door is open" in world.state.waiting_for)
    assert np.degrees(world.commanded[0]) < 30.0


def test_a_force_outlives_a_halt_and_ends_with_the_agent() -> None:
    world = begun(WAITS, part=False)
    answer(world, ForceInput("part", False))
    answer(world, Halt())
    assert world.state.forced == {"part": False}
    world.agent.receive(Shutdown(), world.now)
    until(world, lambda: world.ended)
    assert codes(world)[-1] == "input_follows"
