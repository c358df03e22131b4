"""Outputs that a program switches: at which tick, whatever the motion and the network do meanwhile."""

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.messages import (
    Command,
    Continue,
    Estop,
    Halt,
    Mode,
    OutputEvent,
    ProgramState,
    Run,
    SetOverride,
    Step,
)
from robot_agent.agent.planning import lookahead
from tests.unit.agent_rounds import ROUND, TO_START, extensions, speeds
from tests.unit.agent_runs import at_rest, ended, until
from tests.unit.agent_world import CYCLE_S
from tests.unit.measured_world import START, Measured
from tests.unit.output_ticks import FIRST_TICK, after, j1, reached, ticks
from tests.unit.robot_agent.agent.blocks.output_runs import OUTPUTS, begun, ready, switched

STRAIGHT = """MJ J1=2 F=20
SET DO gripper
MJ J1=6 F=20
RESET DO gripper
SET DO glue
MJ J1=7 F=20
END"""


def test_outputs_switch_with_the_first_sample_at_the_end_of_the_move_and_the_motion_is_that_without_them() -> None:
    world = begun(STRAIGHT)
    until(world, ended(world))
    assert switched(world) == [("gripper", True), ("gripper", False), ("glue", True)]
    assert ticks(world) == reached(world, 2.0, 6.0, 6.0)
    without = begun("\n".join(line for line in STRAIGHT.splitlines() if "DO" not in line))
    until(without, ended(without))
    assert np.array_equal(np.unique(world.played, axis=0), np.unique(without.played, axis=0))


@pytest.mark.parametrize("place", [0.5, 1.9])
def test_half_speed_and_a_halt_in_front_of_the_place_or_over_it_shift_the_tick(place: float) -> None:
    world = begun(STRAIGHT)
    world.call(SetOverride(50.0))
    until(world, lambda: after(world, place))
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED and at_rest(world)())
    world.run(0.3)
    over = after(world, 2.0)
    assert over == (place == 1.9)
    assert len(world.switched) == over
    world.call(Continue())
    until(world, ended(world))
    assert ticks(world) == reached(world, 2.0, 6.0, 6.0)


def test_going_back_over_a_place_and_passing_it_again_switches_nothing_more() -> None:
    world = begun(STRAIGHT)
    until(world, lambda: after(world, 3.0))
    world.call(SetOverride(-100.0))
    until(world, lambda: not after(world, 1.0))
    assert len(world.switched) == 1
    world.call(SetOverride(100.0))
    until(world, ended(world))
    assert ticks(world) == reached(world, 2.0, 6.0, 6.0)


def test_a_place_that_was_passed_while_all_blocks_were_lost_is_made_up_for_at_the_first_tick_possible() -> None:
    world = begun(STRAIGHT)
    world.call(SetOverride(40.0))
    until(world, lambda: after(world, 0.5) and np.degrees(world.queue[-1][0]) > 2.01)
    assert world.block is not None
    assert world.block.events == ()
    world.lose_blocks = True
    until(world, at_rest(world))
    assert after(world, 2.0)
    assert world.switched == []
    world.lose_blocks = False
    world.step()
    assert world.block.events == (OutputEvent(world.block.first_tick, 1, 1, True),)
    until(world, ended(world))
    assert ticks(world)[1:] == reached(world, 6.0, 6.0)


def test_in_front_of_moves_and_between_pauses_outputs_switch_while_the_robot_stands() -> None:
    world = begun(
        "SET DO glue\nWAIT 0.1\nRESET DO glue\nWAIT 0.1\nSET DO gripper\nMJ J1=3\nHOME\nRESET DO gripper\nEND"
    )
    until(world, ended(world))
    first, second, third, last = ticks(world)
    assert second - first == third - second == round(0.1 / CYCLE_S)
    leaves = int(np.argmax(j1(world) > 0.0)) + FIRST_TICK
    assert third <= leaves <= third + 2
    back = np.flatnonzero(j1(world) > 1e-9)[-1] + 1 + FIRST_TICK
    assert 0 <= back - last <= 1


def test_a_halted_program_switches_nothing_behind_its_pause() -> None:
    world = begun("MJ J1=3\nWAIT 0.2\nSET DO glue\nEND")
    until(world, lambda: "WAIT" in world.state.waiting_for)
    world.call(Halt())
    world.run(0.5)
    assert world.switched == []
    world.call(Continue())
    until(world, ended(world))
    assert switched(world) == [("glue", True)]


def test_a_step_switches_what_is_at_its_end() -> None:
    world = ready(STRAIGHT)
    world.call(Step())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.run(0.1)
    assert switched(world) == [("gripper", True)]
    assert np.degrees(world.commanded[0]) == pytest.approx(2.0, abs=1e-4)


def test_a_program_that_was_stopped_switches_no_more_and_the_next_run_counts_on() -> None:
    world = begun(STRAIGHT)
    until(world, lambda: after(world, 3.0))
    world.call(Halt())
    until(world, at_rest(world))
    world.call(Run())
    until(world, ended(world))
    world.run(0.1)
    assert switched(world) == 2 * [("gripper", True)] + [("gripper", False), ("glue", True)]
    numbers = [event.number for _, event in world.switched]
    assert numbers == sorted(set(numbers))


def test_a_program_that_has_failed_switches_nothing_more_on_its_path() -> None:
    world = begun("MJ J1=2 F=20\nSET DO glue\nMJ J1=4 F=20\nRESET DO glue\nMJ J1=20 F=20\nEND")
    until(world, lambda: after(world, 6.0))
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    until(world, at_rest(world))
    world.run(0.3)
    assert switched(world) == [("glue", True), ("glue", False)]
    world = begun("MJ J1=2\nSET DO glue\nML X=9000 F=9999\nEND")
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    world.run(0.3)
    assert switched(world) == [("glue", True)]


def test_an_interrupted_program_switches_the_rest_once_it_goes_on_and_nothing_again() -> None:
    world = begun(STRAIGHT)
    until(world, lambda: after(world, 4.0))
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    until(world, at_rest(world))
    world.run(0.2)
    assert switched(world) == [("gripper", True)]
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Continue())
    until(world, ended(world))
    assert switched(world) == [("gripper", True), ("gripper", False), ("glue", True)]
    assert reached(world, 6.0)[0] < ticks(world)[1] == ticks(world)[2], "its braking led over the place"


def test_a_corner_switches_in_its_middle() -> None:
    world = begun(f"{TO_START}ML Y=40 F=200 R=20\nSET DO glue\nML Z=1400 F=200\nEND")
    until(world, ended(world))
    places = world.planner.model.forward(np.array(world.played))[:, :3, 3]
    (at,) = ticks(world)
    across = np.abs((places[:, 1] - 0.04) + (places[:, 2] - 1.35))
    moving = np.abs(places - [1.0, 0.04, 1.35]).max(axis=1) < 0.02
    assert abs(int(np.flatnonzero(moving)[np.argmin(across[moving])]) + FIRST_TICK - at) <= 1


def test_each_round_of_a_chain_that_is_extended_switches_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lookahead, "_CHAIN", 8)
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.0)
    lines = ROUND.splitlines()
    turn = "\n".join([lines[0], "SET DO glue", *lines[1:4], "RESET DO glue", *lines[4:]])
    world = begun(f"{TO_START}LABEL again\n{turn}\nGOTO again 2\nEND")
    until(world, ended(world))
    assert len(extensions(world)) > 1
    assert switched(world) == 3 * [("glue", True), ("glue", False)]
    places = world.planner.model.forward(np.array(world.played))[:, :3, 3]
    for k, y in enumerate(3 * [0.01, -0.01]):
        before, at = places[ticks(world)[k] - FIRST_TICK + np.array([-1, 0]), 1]
        assert min(before, at) - 1e-5 <= y <= max(before, at) + 1e-5
    moving = speeds(world)[ticks(world)[0] : ticks(world)[-1]]
    assert moving.min() > 0.2


def test_a_run_is_refused_when_the_gateway_does_not_know_an_output() -> None:
    world = ready("HOME\nSET DO laser\nEND")
    call = world.call(Run())
    world.step()
    assert not world.replies[call].ok
    assert "line 2 of left.prog switches the output 'laser'" in world.replies[call].text
    assert "glue, gripper" in world.replies[call].text


def test_on_a_corrected_path_outputs_switch_at_the_same_place_of_the_path() -> None:
    world = Measured(f"{START}TRACK seam\nML Y=280 F=60\nSET DO glue\nML Y=290 F=60\nRESET DO glue\nTRACK OFF\nEND")
    world.outputs, world.offset_m = OUTPUTS, (0.0, 0.0, 0.01)
    world.start()
    world.until(ended(world))
    y = world.planner.model.forward(np.array(world.played))[:, 1, 3]
    assert switched(world) == [("glue", True), ("glue", False)]
    on, off = (tick - FIRST_TICK for tick in ticks(world))
    assert y[on - 1] < 0.28 <= y[on] + 1e-5
    assert y[off] == pytest.approx(0.29, abs=1e-4)


DISTURBED = """LABEL again
MJ J1=2
SET DO glue
MJ J1=4
RESET DO glue
SET DO gripper
WAIT 0.05
RESET DO gripper
MJ J1=0
SET DO glue
GOTO again 1
END"""
EXPECTED = 2 * [
    ("glue", True, 2.0),
    ("glue", False, 4.0),
    ("gripper", True, 4.0),
    ("gripper", False, 4.0),
    ("glue", True, 0.0),
]
CALLS = st.sampled_from([Halt(), SetOverride(50.0), SetOverride(-60.0), SetOverride(100.0)])


@settings(max_examples=2, deadline=None)
@given(st.sampled_from([0.0, 0.05, 0.2, 0.7]), st.integers(0, 10**6), st.lists(CALLS, max_size=6))
def test_each_switch_is_executed_once_in_order_and_behind_its_place(
    loss: float, seed: int, calls: list[Command]
) -> None:
    world, rng = begun(DISTURBED), random.Random(seed)
    for call in [*calls, SetOverride(100.0)]:
        for _ in range(rng.randrange(1, 20)):
            world.lose_blocks = rng.random() < loss
            world.step()
        if world.state.program.state is ProgramState.RUNNING:
            world.call(call)
    for _ in range(1500):
        if ended(world)():
            break
        if world.state.mode is Mode.HALTED:
            world.call(Continue())
        world.lose_blocks = rng.random() < loss
        world.step()
    assert switched(world) == [(output, on) for output, on, _ in EXPECTED]
    before = FIRST_TICK
    for tick, (_, _, place) in zip(ticks(world), EXPECTED, strict=True):
        way = j1(world)[before - FIRST_TICK : tick - FIRST_TICK + 1]
        assert way.min() - 1e-4 <= place <= way.max() + 1e-4
        before = tick


def test_blocks_say_that_a_program_runs_from_its_start_to_its_end_in_pauses_too_and_not_while_it_is_halted() -> None:
    world = ready("MJ J1=1 F=50\nWAIT 0.3\nMJ J1=12 F=20\nEND")
    assert not world.blocks[-1].program
    world.call(Run())
    until(world, lambda: "WAIT" in world.state.waiting_for)
    assert world.blocks[-1].program
    until(world, lambda: after(world, 1.5))
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED and at_rest(world)())
    assert not world.blocks[-1].program
    world.call(Continue())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    world.run(0.04)
    assert world.blocks[-1].program
    until(world, ended(world))
    world.run(0.04)
    assert not world.blocks[-1].program
