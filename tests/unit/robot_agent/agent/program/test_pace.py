"""Override, steps and manual speed: what an operator's calls do to a running program."""

import numpy as np

from cell.messages import (
    Continue,
    Halt,
    Mode,
    Run,
    SetManual,
    SetOverride,
    Step,
    Token,
    ZoneState,
    ZoneStatus,
)
from tests.unit.agent_runs import BACK, INTO, INTO_ZONE, SHORT, at_rest, enabled, ended, near_zone, running, until
from tests.unit.agent_world import CYCLE_S, AgentWorld

TWO_LINES = "MJ J1=20 J2=-20 J3=30 J5=60\nML Y=200 F=9999\nML Y=400\nEND"


def say(world: AgentWorld, command: object) -> str:
    id = world.call(command)
    until(world, lambda: id in world.replies)
    return world.replies[id].text if world.replies[id].ok else f"refused: {world.replies[id].text}"


def tau(world: AgentWorld) -> float:
    assert world.state.governor is not None
    return world.state.governor.tau_s


def test_override_slows_the_motion_and_is_told() -> None:
    world = running(SHORT)
    say(world, SetOverride(30.0))
    until(world, lambda: world.state.governor is not None and abs(world.state.governor.rate - 0.3) < 1e-9)
    assert world.state.governor is not None
    assert world.state.governor.ruled_by == "override 30 %"
    assert world.state.pace.override == 0.3
    say(world, SetOverride(100.0))
    until(world, ended(world))


def test_override_outside_its_range_is_refused() -> None:
    assert "-100 to 100 % are allowed" in say(running(SHORT), SetOverride(101.0))


def test_with_an_override_of_0_the_zone_in_front_of_the_robot_is_given_back() -> None:
    world = running(f"MJ {near_zone()}\nWAIT 1\n{INTO}\n{BACK}\nEND")
    world.grant()
    until(world, lambda: world.state.program.line == 3)
    say(world, SetOverride(0.0))
    until(world, at_rest(world))
    world.run(0.1)
    assert (world.presences[-1].holds, world.presences[-1].wants) == ({}, {})
    say(world, SetOverride(100.0))
    until(world, ended(world))


def test_negative_override_goes_back_to_the_beginning_of_the_motion_and_then_on() -> None:
    world = running(SHORT)
    until(world, lambda: world.state.governor is not None and tau(world) > 0.3)
    say(world, SetOverride(-50.0))
    until(world, lambda: tau(world) == 0.0)
    until(world, lambda: "beginning" in world.state.waiting_for)
    say(world, SetOverride(100.0))
    until(world, ended(world))
    assert np.abs(world.commanded - world.planner.model.home).max() < 1e-9


def test_backwards_it_does_not_enter_a_zone_that_it_has_given_up() -> None:
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: world.presences[-1].holds != {})
    until(world, lambda: world.presences[-1].holds == {} and tau(world) > 0.0)
    world.granting = False
    say(world, SetOverride(-100.0))
    before = len(world.played)
    until(world, lambda: world.state.governor is not None and world.state.governor.rate < 0.0)
    world.run(6.0)
    leaving = [planned for planned in world.planned if planned.crossings][-1]
    held_back = leaving.motion.q(np.array(leaving.crossings[-1].leave_tau))
    assert np.abs(world.commanded - held_back).max() < 1e-3
    assert np.any(np.diff(world.played[before:], axis=0))
    assert "zone handover" in world.state.waiting_for


def test_backwards_it_names_the_holder_of_a_zone_by_what_the_manager_says_now() -> None:
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: world.presences[-1].holds != {})
    until(world, lambda: world.presences[-1].holds == {} and tau(world) > 0.0)
    world.granting = False
    world.zone = ZoneStatus(ZoneState.OCCUPIED, "right", Token(5, 90), (), 1, 0.0)
    say(world, SetOverride(-100.0))
    until(world, lambda: world.state.waiting_for.startswith("zone handover: held by right"))
    waited_s = world.state.waited_s["handover"]
    world.run(1.0)
    assert world.state.waited_s["handover"] > waited_s + 0.9
    world.zone = ZoneStatus(ZoneState.FREE, None, None, (), 1, world.now)
    world.step()
    assert "held by right" not in world.state.waiting_for


def test_a_program_does_not_begin_backwards() -> None:
    world = running(SHORT)
    until(world, ended(world))
    say(world, SetOverride(-20.0))
    assert "a program begins forwards" in say(world, Run())


def test_steps_go_block_by_block_and_halt_in_between() -> None:
    world = running(TWO_LINES)
    lines = []
    say(world, Step())
    for _ in range(2):
        until(world, lambda: world.state.mode is Mode.HALTED)
        assert not world.state.pace.stepping
        newest = world.agent.executive.timeline.newest
        assert np.abs(newest.planned.motion.ends - newest.segment.stop_tau).min() < 1e-5
        lines.append(world.state.program.line)
        say(world, Step())
    assert lines == [1, 2]
    until(world, ended(world))
    assert world.state.mode is Mode.READY


def test_a_step_ends_where_the_plan_would_still_accelerate() -> None:
    world = enabled("MJ J1=5\nMJ J1=10\nMJ J1=15\nEND")
    say(world, Step())
    until(world, lambda: world.state.mode is Mode.HALTED)
    assert world.state.program.line == 1


def test_continue_after_a_step_goes_on_to_the_end() -> None:
    world = running(TWO_LINES)
    say(world, Step())
    until(world, lambda: world.state.mode is Mode.HALTED)
    say(world, Continue())
    until(world, ended(world))


def test_manual_operation_bounds_the_speed_of_the_flange() -> None:
    world = running(SHORT)
    say(world, Halt())
    world.run(1.0)
    say(world, SetManual(True))
    say(world, Continue())
    before = len(world.played)
    world.run(3.0)
    places = world.planner.model.forward(np.array(world.played[before:]))[:, :3, 3]
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1) / CYCLE_S
    assert 0.2 < speed.max() <= 0.25
    assert world.state.pace.manual


def test_a_step_asked_for_too_late_for_this_block_ends_with_the_next() -> None:
    world = running("MJ J1=20 J2=-20 J3=30 J5=60\nML Y=100 R=20 F=9999\nML Y=200 Z=1200 R=20\nML Y=300\nEND")
    until(world, lambda: world.state.program.line == 2)
    motion = world.agent.executive.timeline.newest.planned.motion
    until(world, lambda: float(motion.ends[0]) - 0.05 < tau(world) < float(motion.ends[0]))
    say(world, Step())
    until(world, lambda: world.state.mode is Mode.HALTED)
    assert abs(tau(world) - motion.ends[1]) < 1e-5
    say(world, Continue())
    until(world, ended(world))
