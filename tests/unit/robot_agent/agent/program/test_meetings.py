"""MEET in a program: the robot rests there, says so, and leaves with the tick that the manager names."""

import numpy as np

from cell.messages import Arrival, Continue, Halt, MeetingStatus, Mode, ProgramState, ResetRobot, Run
from tests.unit.agent_runs import BACK, INTO, enabled, ended, near_zone, running, until
from tests.unit.agent_world import CYCLE_S, STEP_S, AgentWorld

HALTED = "its program was halted until it was too late for that"
PROGRAM = "MJ J1=20\nMEET load\nMJ J1=0\nEND"


def waits(world: AgentWorld) -> bool:
    return bool(world.presences) and world.presences[-1].meets.waits is not None


def release(world: AgentWorld, number: int = 1, ahead_s: float = 0.3, boot: str = "boot") -> float:
    """Let the robot leave by this arrival of its own; when."""
    released = {"left": Arrival(boot, number), "right": Arrival("other", 7)}
    world.meetings = {"load": MeetingStatus((), {}, released, world.now + ahead_s)}
    return world.now + ahead_s


def at_meet(program: str = PROGRAM) -> AgentWorld:
    world = running(program)
    world.meetings = {"load": MeetingStatus(("left",), {"right": "which is halted"})}
    until(world, lambda: waits(world))
    return world


def test_it_rests_at_the_meet_and_says_for_whom_it_waits() -> None:
    world = at_meet()
    stood = world.commanded
    world.run(2.0)
    np.testing.assert_array_equal(world.commanded, stood)
    assert world.state.waiting_for == "meeting load: waits for right, which is halted"
    assert (world.state.program.line, world.state.program.text) == (2, "MEET load")
    assert world.presences[-1].mode is Mode.RUNNING


def test_it_leaves_with_the_first_tick_at_or_after_the_moment() -> None:
    world = at_meet()
    world.run(0.5)
    tick, due_s = world.tick, release(world) - world.now
    before = len(world.played)
    world.run(0.1)
    assert world.state.waiting_for == "MEET, 0.2 s left"
    assert not waits(world)
    assert world.presences[-1].meets.left == {"load": dict(world.meetings["load"].released)}
    until(world, ended(world))
    moved = np.flatnonzero(np.any(np.diff(world.played[before:], axis=0), axis=1))
    assert world.tick > tick
    # The first tick of a motion still commands where the robot stands.
    assert abs((moved[0] + 1) * CYCLE_S - due_s) <= 2 * CYCLE_S
    assert not [event for event in world.events if event.code == "late_for_meeting"]


def test_what_others_were_released_by_lets_nobody_go() -> None:
    world = at_meet()
    for number, boot in ((2, "boot"), (1, "boot before")):
        release(world, number, boot=boot)
        world.run(1.0)
        assert waits(world)


def test_one_that_hears_of_it_late_leaves_at_once_and_tells_it() -> None:
    world = at_meet()
    release(world, ahead_s=-2.0)
    until(world, ended(world), 3.0)
    (event,) = [event for event in world.events if event.code == "late_for_meeting"]
    assert event.text == "leaves meeting load not together with the others: it heard late of it"


def test_without_a_manager_it_stays() -> None:
    world = at_meet()
    world.manager_silent = True
    release(world)
    world.run(1.0)
    assert waits(world)
    assert world.state.waiting_for == "meeting load: the manager is silent"


def test_each_round_of_a_loop_is_an_arrival_of_its_own() -> None:
    world = running("LABEL again\nMJ J1=5\nMEET load\nMJ J1=0\nGOTO again 1\nEND")
    for number in (1, 2):
        until(world, lambda: waits(world))
        assert world.presences[-1].meets.waits is not None
        assert world.presences[-1].meets.waits.number == number
        world.run(1.0)
        assert waits(world), "the release of the round before lets nobody go"
        release(world, number)
        until(world, lambda: not waits(world))
    until(world, ended(world))


def test_a_halted_robot_does_not_wait_and_has_arrived_once_all_the_same() -> None:
    world = at_meet()
    world.call(Halt())
    world.run(0.1)
    assert (waits(world), world.presences[-1].mode) == (False, Mode.HALTED)
    release(world)
    world.run(1.0)
    assert not world.presences[-1].meets.left
    world.call(Continue())
    until(world, ended(world))
    assert [event.code for event in world.events if event.code == "late_for_meeting"] == ["late_for_meeting"]


def leaves_after(program: str, halted_s: float) -> tuple[float, list[str]]:
    """How long after the others a robot begins to move that is halted for so long just when it knows when they leave.

    And what it tells of it.
    """
    world = at_meet(program)
    world.run(0.5)
    release(world)
    world.run(0.1)
    before = len(world.played)
    world.call(Halt())
    world.run(halted_s)
    world.call(Continue())
    until(world, ended(world))
    moved = np.flatnonzero(np.any(np.diff(world.played[before:], axis=0), axis=1))
    late = [event.text for event in world.events if event.code == "late_for_meeting"]
    return (moved[0] + 1) * CYCLE_S - 0.2, late


def test_a_halt_that_is_over_before_the_others_leave_delays_nothing() -> None:
    late_s, told = leaves_after(PROGRAM, 0.1)
    assert (abs(late_s) <= 2 * CYCLE_S, told) == (True, [])


def test_one_that_is_halted_when_the_others_leave_leaves_once_it_goes_on_and_tells_it() -> None:
    late_s, told = leaves_after(PROGRAM, 1.0)
    assert 0.8 <= late_s < 0.95
    assert told == [f"leaves meeting load not together with the others: {HALTED}"]


def test_a_halt_at_the_next_meeting_says_nothing_of_the_one_before() -> None:
    world = at_meet("MEET load\nMEET load\nEND")
    release(world)
    until(world, lambda: waits(world) and world.presences[-1].meets.left != {})
    world.call(Halt())
    world.run(0.5)
    world.call(Continue())
    world.run(0.5)
    assert not [event for event in world.events if event.code == "late_for_meeting"]


def test_a_pause_behind_a_meeting_lasts_as_it_says_however_that_was_halted() -> None:
    for halted_s in (0.1, 0.5):
        late_s, _ = leaves_after(PROGRAM.replace("load\n", "load\nWAIT 0.5\n"), halted_s)
        assert max(0.0, halted_s - 0.2) + 0.5 - 2 * CYCLE_S <= late_s < max(0.0, halted_s - 0.2) + 0.6


def test_what_is_switched_behind_a_meeting_waits_for_the_end_of_a_halt() -> None:
    world = enabled(PROGRAM.replace("load\n", "load\nSET DO gripper\n"), outputs=("gripper",))
    world.call(Run())
    until(world, lambda: waits(world))
    release(world)
    world.run(0.1)
    world.call(Halt())
    world.run(1.0)
    assert world.switched == []
    world.call(Continue())
    until(world, ended(world))
    assert [event.value for _, event in world.switched] == [True]


def test_a_robot_in_a_fault_does_not_wait() -> None:
    world = at_meet()
    world.quick_stop()
    until(world, lambda: world.state.mode is Mode.FAULT)
    world.run(0.1)
    assert (waits(world), world.presences[-1].mode) == (False, Mode.FAULT)
    world.faulty = False
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    assert not waits(world)


def test_a_time_out_ends_the_program_without_the_time_of_a_halt() -> None:
    world = at_meet(PROGRAM.replace("load", "load TIMEOUT 1"))
    world.call(Halt())
    world.run(3.0)
    assert world.state.program.state is ProgramState.RUNNING
    world.call(Continue())
    world.run(0.8)
    assert world.state.program.state is ProgramState.RUNNING
    world.run(0.4)
    assert (world.state.mode, world.state.program.state) == (Mode.READY, ProgramState.FAILED)
    why = "line 2: not left within 1 s: meeting load: waits for right, which is halted"
    assert world.state.program.error == why
    assert not waits(world)
    world.call(Run())
    until(world, lambda: waits(world))
    assert world.presences[-1].meets.waits is not None
    assert world.presences[-1].meets.waits.number == 2


def test_a_zone_behind_the_meet_is_asked_for_once_it_leaves() -> None:
    world = at_meet(f"MJ {near_zone()}\nMEET load\n{INTO}\n{BACK}\nEND")
    world.run(1.0)
    assert not any(presence.wants for presence in world.presences)
    release(world)
    world.grant()
    until(world, ended(world))
    assert any(presence.wants for presence in world.presences)


def test_outputs_after_the_meet_are_switched_when_it_leaves() -> None:
    world = enabled("MJ J1=5\nMEET load\nSET DO grip\nMEET load\nEND", outputs=("grip",))
    world.call(Run())
    until(world, lambda: waits(world))
    world.run(0.5)
    assert world.switched == []
    tick, due_s = world.tick, release(world) - world.now
    until(world, lambda: world.switched != [])
    assert world.switched[0][0] >= tick + due_s / CYCLE_S - 1
    until(world, lambda: waits(world), 2.0)
    world.run(STEP_S)
    assert world.presences[-1].meets.waits is not None
    assert world.presences[-1].meets.waits.number == 2
