"""What an agent does while it does not know yet what its gateway has accepted: no move twice, none left out."""

import random
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.messages import Continue, Estop, Halt, Mode, ResetRobot, Run, SetOverride, SetpointBlock
from tests.unit.agent_runs import at_rest, ended, until
from tests.unit.agent_world import CYCLE_S
from tests.unit.output_ticks import FIRST_TICK, after, reached, ticks
from tests.unit.playout_world import PlayoutWorld

THREE = "MJ J1=4\nMJ J1=0\nMJ J2=4\nEND"


def begun(program: str, outputs: tuple[str, ...] = ()) -> PlayoutWorld:
    world = PlayoutWorld(program, outputs)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.enabled = True
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    return world


def turns_back(block: SetpointBlock, degrees: float) -> bool:
    """Whether a block begins the move that leads back from J1 = `degrees`."""
    j1 = np.degrees(block.position[:, 0])
    return bool(abs(j1[0] - degrees) < 1e-6 and j1[-1] < degrees - 1e-3)


def ends(world: PlayoutWorld, joint: int) -> list[float]:
    """Where a joint turns round or comes to rest [deg], in order."""
    q = np.degrees(np.array(world.played)[:, joint])
    moves = q[np.concatenate([[True], np.abs(np.diff(q)) > 1e-9])]
    turns = np.flatnonzero(np.diff(np.sign(np.diff(moves)))) + 1
    return [round(float(moves[i]), 3) for i in (*turns, -1)]


def go_on_after_the_stop(world: PlayoutWorld) -> None:
    """The emergency stop is over, for the gateway too; an operator lets the program go on, to its end."""
    world.gateway_outputs.barred = ""
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Continue())
    until(world, ended(world))


def test_a_block_of_the_old_motion_that_is_accepted_behind_the_first_of_the_next_leaves_no_move_out() -> None:
    world = begun(THREE)
    until(world, lambda: turns_back(world.blocks[-1], 4.0))
    first = world.blocks[-1].sequence
    world.delays = lambda block: [] if block.sequence == first + 2 else [0]
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED and at_rest(world)())
    world.call(Continue())
    until(world, ended(world))
    assert ends(world, 0) == [4.0, 0.0]
    assert ends(world, 1) == [4.0]


def test_what_the_gateway_did_not_switch_because_it_heard_of_a_stop_first_is_switched_once_the_robot_goes_on() -> None:
    world = begun("MJ J1=2 F=20\nSET DO gripper\nMJ J1=6 F=20\nRESET DO gripper\nMJ J1=7 F=20\nEND", ("gripper",))
    until(world, lambda: after(world, 1.95))
    world.gateway_outputs.barred = "an emergency stop is active"
    until(world, lambda: after(world, 3.5))
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    until(world, at_rest(world))
    assert world.switched == []
    go_on_after_the_stop(world)
    assert [event.value for _, event in world.switched] == [True, False]
    assert ticks(world)[1:] == reached(world, 6.0)


def test_a_pause_begins_when_the_robot_has_arrived_also_behind_a_halt_just_before_that() -> None:
    world = begun("MJ J1=4\nWAIT 0.3\nSET DO gripper\nMJ J1=0\nEND", ("gripper",))
    until(world, lambda: np.degrees(world.blocks[-1].position[-1, 0]) > 4.0 - 1e-9)
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED and at_rest(world)())
    assert not after(world, 4.0 - 1e-3)
    world.run(0.5)
    world.call(Continue())
    until(world, ended(world))
    (arrives,) = reached(world, 4.0 - 1e-4)
    assert ticks(world)[0] - arrives >= 0.3 / CYCLE_S


def test_what_is_switched_between_two_pauses_is_on_for_as_long_as_the_program_says_also_over_a_stop() -> None:
    world = begun("SET DO gripper\nWAIT 0.2\nRESET DO gripper\nMJ J1=1\nEND", ("gripper",))
    world.gateway_outputs.barred = "an emergency stop is active"
    world.run(0.1)
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    world.run(0.5)
    assert world.switched == []
    go_on_after_the_stop(world)
    on, off = ticks(world)
    assert off - on == round(0.2 / CYCLE_S)


STAIRS = """MJ J1=2
SET DO glue
MJ J2=2
WAIT 0.06
SET DO gripper
WAIT 0.06
RESET DO gripper
MJ J1=2.1
RESET DO glue
SET DO gripper
MJ J2=4
WAIT 0
RESET DO gripper
END"""
CORNERS = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [2.1, 2.0], [2.1, 4.0]])
SWITCHED = [
    ("glue", True, 2.0),
    ("gripper", True, 4.0),
    ("gripper", False, 4.0),
    ("glue", False, 4.1),
    ("gripper", True, 4.1),
    ("gripper", False, 6.1),
]
"""Each with the way [deg] after which it is due."""


@dataclass(frozen=True)
class Trouble:
    """What happens to the messages and to the robot, drawn anew from the seed at each step."""

    seed: int
    loss: float
    late: float
    feedback_ticks: int
    often: float


def troubled(trouble: Trouble) -> PlayoutWorld:
    """A run of STAIRS with messages lost, late, doubled and overtaken, halts, changes of pace and emergency stops."""
    rng, world = random.Random(trouble.seed), begun(STAIRS, ("glue", "gripper"))

    def delay() -> int:
        return rng.randrange(1, 25) if rng.random() < trouble.late else rng.randrange(3)

    world.delays = lambda _: [delay() for _ in range(1 + (rng.random() < 0.1)) if rng.random() >= trouble.loss]
    deaf_until = 0.0
    for count in range(3000):
        if ended(world)():
            return world
        world.feedback_ticks = rng.randrange(trouble.feedback_ticks + 1)
        world.feedback_lost = rng.random() < trouble.loss
        if rng.random() < 0.02 * trouble.often:
            deaf_until = world.now + rng.uniform(0.3, 0.6)
        world.manager_silent = world.now < deaf_until
        if rng.random() < trouble.often and count < 1000:
            strike(world, rng)
        if world.state.mode is Mode.HALTED and rng.random() < 0.2:
            world.call(Continue())
        if world.state.mode is Mode.ESTOP and world.presences[-1].estop_acknowledged is not None:
            # The end of a stop that came before the manager was heard does not count: it is reset once more.
            world.agent.receive(Estop(world.presences[-1].estop_acknowledged, False, "test", ""), world.now)
        if world.state.mode is Mode.FAULT:
            world.call(ResetRobot())
        if count == 1000:
            world.call(SetOverride(100.0))
        world.step()
    raise AssertionError(f"not ended: {world.state}")


def strike(world: PlayoutWorld, rng: random.Random) -> None:
    if rng.random() < 0.85:
        world.call(rng.choice([Halt(), SetOverride(30.0), SetOverride(0.0), SetOverride(100.0), SetOverride(100.0)]))
        return
    estop = f"e{world.tick}"
    world.gateway_outputs.barred = "an emergency stop is active"
    for _ in range(rng.randrange(8)):
        world.step()
    world.agent.receive(Estop(estop, True, "test", "a hand in the cell"), world.now)
    world.run(0.3)
    until(world, at_rest(world))
    world.gateway_outputs.barred = ""
    world.agent.receive(Estop(estop, False, "test", ""), world.now)


def check(world: PlayoutWorld) -> None:
    """Each move is gone through once, without a way back; each output is switched once, in order, at its place."""
    q = np.degrees(np.array(world.played))
    way, sums = q[:, 0] + q[:, 1], CORNERS.sum(axis=1)
    on_stairs = np.stack([np.interp(way, sums, CORNERS[:, k]) for k in (0, 1)], axis=1)
    assert np.abs(q[:, :2] - on_stairs).max() < 1e-4
    assert np.diff(way).min() > -1e-4
    assert abs(way[-1] - sums[-1]) < 1e-4
    executed = [(world.outputs[event.output], event.value) for _, event in world.switched]
    assert executed == [each[:2] for each in SWITCHED]
    at = way[np.array(ticks(world)) - FIRST_TICK]
    assert (at >= np.array([place for _, _, place in SWITCHED]) - 1e-3).all()
    assert ticks(world)[2] - ticks(world)[1] >= 0.06 / CYCLE_S


troubles = st.builds(
    Trouble,
    seed=st.integers(0, 10**6),
    loss=st.sampled_from([0.0, 0.2, 0.5, 0.7]),
    late=st.sampled_from([0.0, 0.1, 0.3]),
    feedback_ticks=st.sampled_from([0, 5, 8]),
    often=st.sampled_from([0.0, 0.05, 0.15]),
)


@settings(max_examples=2, deadline=None)
@given(troubles)
def test_no_move_and_no_switch_is_left_out_or_done_twice_whatever_is_lost_late_or_stopped(trouble: Trouble) -> None:
    check(troubled(trouble))


@pytest.mark.soak
@settings(max_examples=300, deadline=None)
@given(troubles)
def test_nor_in_many_runs(trouble: Trouble) -> None:
    check(troubled(trouble))
