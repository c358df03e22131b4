"""The agent's core against a gateway that plays blocks exactly and a manager that says what the test wants."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from cell.config.settings import OnManagerReturn, Times
from cell.core import Ask, Frozen, Publish, Shutdown
from cell.geometry import SpaceOf, body_touches, capsules_touch
from cell.messages import (
    Command,
    Continue,
    Disable,
    Enable,
    Estop,
    Halt,
    Heard,
    Jog,
    JogFrame,
    Mode,
    Presence,
    ProgramState,
    Release,
    ResetRobot,
    Run,
    SetOverride,
    SetpointBlock,
    Step,
    Token,
    ZoneState,
    ZoneStatus,
)
from tests.unit.agent_runs import INTO_ZONE, SHORT, at_rest, enabled, ended, running, until
from tests.unit.agent_world import CYCLE_S, ZONE, AgentWorld


def distance_to_plan(world: AgentWorld) -> float:
    """Largest distance [rad] of a played sample from the chords of the planned motions' dense samples."""
    dense = [planned.motion.q(np.linspace(0.0, planned.motion.duration_s, 4000)) for planned in world.planned]
    worst = 0.0
    for q in world.played[::3]:
        nearest = np.inf
        for path in dense:
            start, way = path[:-1], np.diff(path, axis=0)
            share = np.clip(((q - start) * way).sum(1) / np.maximum((way * way).sum(1), 1e-30), 0.0, 1.0)
            nearest = min(nearest, float(np.abs(start + share[:, None] * way - q).max(axis=1).min()))
        worst = max(worst, nearest)
    return worst


def test_before_its_claim_is_accepted_an_agent_only_asks() -> None:
    world = AgentWorld(SHORT)
    effects = world.agent.step(world.now)
    assert [type(effect) for effect in effects] == [Ask]


def test_a_program_runs_to_its_end_within_the_limits() -> None:
    world = running(SHORT)
    until(world, ended(world))
    velocity = np.diff(world.played, axis=0) / CYCLE_S
    acceleration = np.diff(velocity, axis=0) / CYCLE_S
    limits = world.planner.limits
    assert (np.abs(velocity) <= limits.velocity * 1.001).all()
    assert (np.abs(acceleration) <= limits.ramp_acceleration_bounds[1] * 1.001).all()
    assert np.abs(world.commanded - world.planner.model.home).max() < 1e-9


def test_every_block_ends_at_rest() -> None:
    world = running(SHORT)
    until(world, ended(world))
    assert all(not np.any(np.diff(block.position[-3:], axis=0)) for block in world.blocks)
    assert all(not np.any(block.velocity[-1]) for block in world.blocks)


def test_presence_is_published_before_the_block_it_covers() -> None:
    world = running(SHORT)
    world.agent.receive(world._feedback(), world.now)
    kinds = [type(e.message) for e in world.agent.step(world.now) if isinstance(e, Publish)]
    assert kinds.index(Presence) < kinds.index(SetpointBlock)


def test_it_stops_in_front_of_a_zone_that_is_not_granted_and_says_who_holds_it() -> None:
    world = running(INTO_ZONE)
    world.zone = ZoneStatus(ZoneState.OCCUPIED, "right", None, (), 1, world.now)
    until(world, lambda: "held by right" in world.state.waiting_for)
    until(world, at_rest(world), seconds=0.1)
    box = ZONE.solid()
    assert not any(body_touches(presence.body, box) for presence in world.presences)
    world.grant()
    until(world, ended(world))
    assert world.state.waited_s["handover"] > 0.0


def test_in_front_of_a_zone_of_the_tcp_it_stops_with_its_tcp_and_its_body_may_be_inside() -> None:
    world = AgentWorld(INTO_ZONE)
    world.geometry = replace(ZONE, of=SpaceOf.TCP)
    world.zone = ZoneStatus(ZoneState.OCCUPIED, "right", None, (), 1, world.now)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    until(world, lambda: "held by right" in world.state.waiting_for)
    until(world, at_rest(world), seconds=0.1)
    box, last = ZONE.solid(), world.presences[-1].body
    assert body_touches(last, box)
    assert not any(body_touches(presence.body, box, SpaceOf.TCP) for presence in world.presences)
    tcp = world.planner.pose_world_base @ world.planner.model.forward(world.commanded)
    assert 0.0 < box.capsule_distance(np.stack([tcp[:3, 3]] * 2), np.zeros(())) < 0.06
    world.grant()
    until(world, lambda: any(body_touches(presence.body, box, SpaceOf.TCP) for presence in world.presences))
    assert world.presences[-1].holds == {"handover": world.zone.token}
    until(world, ended(world))


FRONT = replace(ZONE, zone="front", size_m=(0.4, 2.0, 3.0), position_m=(2.4, 0.0, 1.0))
"""Is entered before the other zone and left after that: a robot cannot stop between them."""
BY_RIGHT = ZoneStatus(ZoneState.OCCUPIED, "right", None, (), 1, 0.0)


def through_front() -> AgentWorld:
    """A program that runs through `FRONT`, which it may, into the zone."""
    world = AgentWorld(INTO_ZONE)
    world.other_zones = (FRONT,)
    until(world, lambda: world.states != [] and world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    until(world, lambda: len(world.planned) >= 2)
    return world


def entered_at(world: AgentWorld, zone: str) -> float:
    return next(crossing.enter_tau for crossing in world.planned[1].crossings if crossing.zone == zone)


def test_it_enters_none_of_two_zones_that_overlap_before_both_are_granted() -> None:
    world = through_front()
    world.zone = BY_RIGHT
    until(world, lambda: "zone handover: held by right" in world.state.waiting_for)
    until(world, at_rest(world), seconds=0.2)
    assert entered_at(world, "front") < entered_at(world, "handover") - 0.1
    assert not any(body_touches(presence.body, FRONT.solid()) for presence in world.presences)
    front_s, handover_s = (world.presences[-1].wants[zone] for zone in ("front", "handover"))
    assert front_s == handover_s < 1e-6
    world.grant()
    until(world, ended(world))


def test_it_wants_zones_that_overlap_for_the_same_moment_and_gives_none_up_before_it_has_left_it() -> None:
    world = through_front()
    world.grant()
    until(world, ended(world))
    ahead = [presence.wants for presence in world.presences if presence.wants.get("front", 0.0) > 0.0]
    assert ahead
    assert all(wants["front"] == wants["handover"] for wants in ahead)
    first = next(k for k, presence in enumerate(world.presences) if body_touches(presence.body, FRONT.solid()))
    held = ["handover" in presence.holds for presence in world.presences[first:]]
    assert held[0]
    assert sum(a != b for a, b in itertools.pairwise(held)) == 1


def test_a_robot_that_loses_the_second_zone_on_its_way_there_stops_in_front_of_it_and_may_go_back() -> None:
    world = through_front()
    world.grant()

    def tau_s() -> float:
        governor = world.state.governor if world.state.program.line == 2 else None
        return 0.0 if governor is None else governor.tau_s

    until(world, lambda: tau_s() > entered_at(world, "front") + 0.01)
    world.granting, world.zone = False, BY_RIGHT
    until(world, lambda: "zone handover: held by right" in world.state.waiting_for)
    until(world, at_rest(world), seconds=0.2)
    assert entered_at(world, "handover") - 0.01 < tau_s() <= entered_at(world, "handover")
    world.call(SetOverride(-50.0))
    until(world, lambda: tau_s() < entered_at(world, "front"))


def test_a_move_to_where_the_robot_stands_is_done_at_once() -> None:
    world = running("HOME\nHOME\nMJ J1=5\nEND")
    until(world, ended(world))
    assert world.commanded[0] == pytest.approx(np.radians(5.0))


def test_a_free_zone_costs_no_stop() -> None:
    world = running(INTO_ZONE)
    world.grant()
    until(world, ended(world))
    rates = [s.governor.rate for s in world.states if s.governor and 0.0 < s.governor.tau_s < s.governor.duration_s]
    assert min(rates) > 0.999
    assert world.state.waited_s == {}


def test_a_zone_is_given_up_once_the_body_is_outside_for_good() -> None:
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: "handover" in world.presences[-1].holds)
    box = ZONE.solid()
    until(world, ended(world))
    for presence in world.presences:
        if body_touches(presence.body, box):
            assert "handover" in presence.holds
    assert "handover" not in world.presences[-1].holds


def test_a_robot_that_brakes_out_of_a_zone_keeps_it_until_it_stands() -> None:
    def leaving() -> AgentWorld:
        world = running(INTO_ZONE)
        world.planning_s = 0.05
        world.grant()
        until(world, lambda: "handover" in world.presences[-1].holds)
        return world

    whole, world = leaving(), leaving()
    began = len(whole.presences)
    until(whole, lambda: "handover" not in whole.presences[-1].holds)
    until(world, lambda: len(world.presences) - began == len(whole.presences) - began - 2)
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    stopped = len(world.presences)
    until(world, at_rest(world))
    world.run(0.3)
    braking = [presence for presence in world.presences[stopped:] if presence.stop_time_s > 0.0]
    assert any(not body_touches(presence.body, ZONE.solid()) for presence in braking), "or nothing is tested"
    assert all("handover" in presence.holds for presence in braking)
    assert "handover" not in world.presences[-1].holds


def test_a_grant_that_was_given_up_once_is_never_used_again() -> None:
    world = running(SHORT)
    world.zone = ZoneStatus(ZoneState.GRANTED, "left", Token(5, 1), (), 1, 0.0)
    world.run(0.1)
    assert world.presences[-1].holds == {}
    assert not world.agent.zones.permitted("handover", world.now)
    world.agent.zones.update_holds(world.now, inside=set(), needed={"handover"})
    assert world.agent.zones.holds == {}


def test_the_published_body_covers_where_the_robot_goes() -> None:
    world = running(SHORT)
    until(world, lambda: len(world.blocks) > 60)
    presence, start = world.presences[-1], len(world.played)
    world.lose_blocks = True
    world.run(2.0)
    radii = world.planner.model.capsule_radii
    poses = presence.body.poses
    for q in world.played[start:]:
        gaps = np.linalg.norm(poses - world.planner.model.capsules(q), axis=-1).max(axis=(1, 2))
        assert (gaps <= presence.body.growth_m + 1e-9).any()
    assert len(radii) == poses.shape[1]


def test_halt_brakes_on_the_path_and_continue_goes_on() -> None:
    world = running(SHORT)
    until(world, lambda: world.state.governor is not None and world.state.governor.tau_s > 0.3)
    world.call(Halt())
    until(world, at_rest(world))
    assert world.state.mode is Mode.HALTED
    world.call(Continue())
    until(world, ended(world))
    assert distance_to_plan(world) < 2e-6


def test_a_few_lost_blocks_cost_no_speed() -> None:
    world = running(SHORT)
    until(world, lambda: world.state.governor is not None and world.state.governor.tau_s > 0.2)
    world.lose_blocks = True
    world.run(0.06)
    world.lose_blocks = False
    until(world, ended(world))
    rates = [s.governor.rate for s in world.states if s.governor and 0.0 < s.governor.tau_s < s.governor.duration_s]
    assert min(rates) > 0.999


def test_without_blocks_the_robot_ends_at_rest_on_its_path_and_goes_on_when_they_return() -> None:
    world = running(SHORT)
    until(world, lambda: world.state.governor is not None and world.state.governor.tau_s > 0.3)
    world.lose_blocks = True
    until(world, at_rest(world))
    world.lose_blocks = False
    until(world, ended(world))
    assert distance_to_plan(world) < 2e-6


@pytest.mark.parametrize(
    ("choice", "mode"), [(OnManagerReturn.CONTINUE, Mode.RUNNING), (OnManagerReturn.OPERATOR, Mode.HALTED)]
)
def test_a_silent_manager_stops_the_robot_on_its_path(choice: OnManagerReturn, mode: Mode) -> None:
    world = running(SHORT, choice)
    until(world, lambda: world.state.governor is not None and world.state.governor.tau_s > 0.3)
    world.manager_silent = True
    until(world, at_rest(world))
    assert world.state.mode is mode
    world.manager_silent = False
    world.run(0.1)
    if choice is OnManagerReturn.OPERATOR:
        world.call(Continue())
    until(world, ended(world))
    assert distance_to_plan(world) < 2e-6


def test_a_call_that_echoes_an_old_state_is_refused() -> None:
    world = enabled(SHORT)
    old = Heard(world.state.boot, world.state.sequence)
    world.run(0.6)
    id = world.call(Run(), old)
    world.step()
    assert not world.replies[id].ok
    assert "too old" in world.replies[id].text
    assert world.state.mode is Mode.READY


def test_a_run_that_was_meant_for_the_agent_before_a_restart_is_not_carried_out() -> None:
    world = enabled(SHORT)
    id = world.call(Run(), Heard("the boot before", world.state.sequence))
    world.step()
    assert not world.replies[id].ok
    assert world.state.mode is Mode.READY


def test_after_a_freeze_every_earlier_call_is_old() -> None:
    world = enabled(SHORT)
    world.agent.receive(Frozen(0.4), world.now)
    id = world.call(Run())
    world.step()
    assert not world.replies[id].ok


def test_halt_is_taken_however_old_it_is() -> None:
    world = running(SHORT)
    id = world.call(Halt(), Heard("another", 1))
    world.step()
    assert world.replies[id].ok


def test_an_unreachable_target_ends_the_program_in_front_of_it_and_names_its_line() -> None:
    world = running("MJ J1=10\nML X=9000 F=9999\nEND")
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    assert world.state.program.line == 2
    assert "line 2" in world.state.program.error
    assert "program" in [event.code for event in world.events]
    assert world.state.mode is Mode.READY


def test_an_emergency_stop_brakes_and_only_an_operator_starts_again() -> None:
    world = running(SHORT)
    until(world, lambda: world.state.governor is not None and world.state.governor.tau_s > 0.3)
    world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
    until(world, at_rest(world))
    assert world.state.mode is Mode.ESTOP
    assert world.presences[-1].estop_acknowledged == "e1"
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    world.agent.receive(Estop("e1", True, "test", "a late copy"), world.now)
    world.run(1.0)
    assert world.state.mode is Mode.HALTED
    assert world.state.program.state is ProgramState.INTERRUPTED
    assert at_rest(world)()
    world.call(Run())
    until(world, ended(world))


@pytest.mark.parametrize("command", [Run(), Continue(), Enable(), Step()])
@pytest.mark.parametrize("faulty", [False, True])
def test_what_an_operator_wanted_while_the_robot_was_stopped_is_not_carried_out_once_it_no_longer_is(
    command: Command, faulty: bool
) -> None:
    world = running(SHORT)
    world.run(0.5)
    if faulty:
        world.feedback_lost = True
        until(world, lambda: world.state.mode is Mode.FAULT)
        world.feedback_lost = False
        world.run(0.5)
    else:
        world.agent.receive(Estop("e1", True, "test", "a hand in the cell"), world.now)
        until(world, at_rest(world))
    stopped = Heard(world.state.boot, world.state.sequence)
    if faulty:
        world.call(ResetRobot())
        world.run(0.1)
    else:
        world.agent.receive(Estop("e1", False, "test", ""), world.now)
    id = world.call(command, stopped)
    world.step()
    assert not world.replies[id].ok
    assert "a state of left in which it was stopped" in world.replies[id].text
    world.run(0.3)
    assert world.state.mode is Mode.HALTED
    assert at_rest(world)()


def test_with_several_stops_the_robot_stays_stopped_until_the_last_is_cleared() -> None:
    world = running(SHORT)
    for stop in ("e1", "e2"):
        world.agent.receive(Estop(stop, True, "test", "a hand in the cell"), world.now)
    until(world, at_rest(world))
    world.run(0.1)
    world.agent.receive(Estop("e1", False, "test", ""), world.now)
    world.run(0.2)
    assert world.state.mode is Mode.ESTOP
    assert world.presences[-1].estop_acknowledged == "e2"
    world.agent.receive(Estop("e2", False, "test", ""), world.now)
    world.run(0.2)
    assert world.state.mode is not Mode.ESTOP
    assert world.presences[-1].estop_acknowledged is None


def test_lost_feedback_is_a_fault_that_an_operator_must_reset() -> None:
    world = running(SHORT)
    world.run(0.5)
    world.feedback_lost = True
    until(world, lambda: world.state.mode is Mode.FAULT)
    world.feedback_lost = False
    world.run(1.0)
    assert world.state.mode is Mode.FAULT
    world.call(ResetRobot())
    world.run(0.1)
    assert world.state.mode is Mode.HALTED
    assert world.state.program.state is ProgramState.INTERRUPTED


def test_with_another_quick_stop_told_the_robot_is_planned_for_anew_and_with_an_equal_one_as_before() -> None:
    world = enabled(SHORT)
    first = world.agent._planner
    for brakes, same in (((), True), ((10.0, 20.0, 30.0, 40.0, 50.0, 60.0), False), ((10.0, 20.0), False)):
        world.brakes = brakes
        world.agent.link.lose_claim()
        until(world, lambda: world.agent.link.owned is not None)
        world.run(0.1)
        assert (world.agent._planner is first) == same
        assert world.agent._planner.quick_stop == brakes


def test_feedback_of_before_its_reset_is_no_new_fault() -> None:
    world = running(SHORT)
    world.run(0.5)
    world.quick_stop()
    until(world, lambda: world.state.mode is Mode.FAULT)
    seen = len(world.states)
    world.call(ResetRobot())
    until(world, lambda: not world.faulty)
    world.faulty = True
    world.run(0.1)
    world.faulty = False
    world.run(0.1)
    modes = [state.mode for state in world.states[seen:]]
    assert [mode for mode, before in zip(modes[1:], modes, strict=False) if mode is not before] == [Mode.DISABLED]


def test_an_answer_to_the_reset_of_an_earlier_fault_does_not_acknowledge_the_next_one() -> None:
    world = running(SHORT)
    world.run(0.5)
    world.quick_stop()
    until(world, lambda: world.state.mode is Mode.FAULT)
    world.answers_held = True
    world.call(ResetRobot())
    world.run(0.1)
    world.answers_held, late = False, list(world._answers)
    world._answers.clear()
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    world.feedback_lost = True
    until(world, lambda: world.state.mode is Mode.FAULT)
    world.feedback_lost = False
    for answer in late:
        world.agent.receive(answer, world.now)
    world.run(0.2)
    assert world.state.mode is Mode.FAULT


def test_the_zone_rule_is_the_managers_own() -> None:
    """Published bodies are judged with the same function by agent and manager: here against the capsules themselves."""
    world = running(INTO_ZONE)
    world.grant()
    until(world, lambda: body_touches(world.presences[-1].body, ZONE.solid()))
    until(world, ended(world))
    inside = [
        capsules_touch(world.planner.model.capsules(q), world.planner.model.capsule_radii, ZONE.solid()).any()
        for q in world.played[::5]
    ]
    assert any(inside)


def test_moves_that_join_are_planned_and_played_as_one_motion_without_a_stop() -> None:
    world = running(
        "MJ J1=20 J2=-20 J3=30 J5=60 F=60\nML Y=200 R=40 F=9999\nML Z=1900 R=40\nMC QY=250 QZ=1850 Y=300\nHOME\nEND"
    )
    until(world, ended(world))
    joined = next(planned for planned in world.planned if len(planned.lines) > 1)
    assert joined.lines == (2, 3, 4)
    assert len(joined.motion.rests) == 2
    assert [joined.line_at(float(tau)) for tau in joined.motion.ends - 1e-3] == [2, 3, 4]
    assert distance_to_plan(world) < 1e-5


def test_mistake_in_one_of_the_moves_that_join_is_named_with_its_line() -> None:
    world = running("MJ J1=20 J2=-20 J3=30 J5=60 F=60\nML Y=200 R=40 F=9999\nML X=9000\nHOME\nEND")
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    assert world.state.program.line == 3


def test_disabling_is_no_fault_even_when_the_feedback_is_faster_than_the_answer() -> None:
    world = enabled(SHORT)
    world.answers_held = True
    world.call(Disable())
    world.run(0.1)
    assert world.state.mode is Mode.DISABLED
    world.release_answers()
    world.run(0.1)
    assert world.state.mode is Mode.DISABLED


def test_disabling_is_no_fault_when_feedback_and_answer_come_at_once() -> None:
    world = enabled(SHORT)
    world.call(Disable())
    world.run(0.1)
    assert world.state.mode is Mode.DISABLED


def test_an_agent_that_is_stopped_ends_when_its_gateway_has_taken_the_robot_back() -> None:
    world = running(SHORT)
    world.agent.receive(Shutdown(), world.now)
    world.answers_held = True
    until(world, lambda: world.asked_last is Release)
    assert not world.ended
    world.release_answers()
    world.run(0.1)
    assert world.ended


def test_a_robot_that_is_refused_because_it_still_settles_is_offered_again() -> None:
    world = enabled(SHORT)
    world.agent.receive(Shutdown(), world.now)
    world.settling = True
    world.run(0.3)
    assert not world.ended
    world.settling = False
    world.run(0.1)
    assert world.ended


def test_a_gateway_that_does_not_answer_keeps_no_agent_from_ending() -> None:
    world = enabled(SHORT)
    world.agent.receive(Shutdown(), world.now)
    world.answers_held = True
    world.run(1.2)
    assert world.ended


def test_an_agent_without_its_gateway_leaves_once_everything_sent_is_played() -> None:
    world = running(SHORT)
    until(world, lambda: (world.state.tcp_speed_m_s or 0.0) > 0.3)
    world.lose_blocks = True
    world.step()  # what is sent now is never heard of again
    world.feedback_lost = True
    world.agent.receive(Shutdown(), world.now)
    world.run(2.0)
    assert world.ended


def test_nothing_is_said_about_a_robot_whose_drives_are_not_heard() -> None:
    world = running(SHORT)
    world.feedback_lost = True
    world.run(Times().feedback_lost_s + 0.1)
    assert world.state.mode is Mode.FAULT
    assert (world.state.tcp_speed_m_s, world.state.tcp_position_m, world.state.governor) == (None, None, None)
    assert world.state.reserve is None


def test_the_state_says_how_much_motion_is_left() -> None:
    world = running(SHORT)
    until(world, lambda: world.state.reserve is not None)
    reserve, model, q = world.state.reserve, world.planner.model, np.array(world.state.joints)
    assert reserve is not None
    assert reserve.singular == model.singularity(q).name
    assert reserve.from_singular == model.singularity(q).nearest
    assert reserve.manipulability == model.manipulability(q)
    assert reserve.from_limit == model.from_limits(q)[model.joint_names.index(reserve.joint)]


def test_a_robot_is_still_starting_until_all_its_drives_are_heard() -> None:
    world = AgentWorld(SHORT)
    world.drives_silent = True
    world.run(0.5)
    assert world.state.mode is Mode.STARTING
    assert world.presences == []
    world.drives_silent = False
    world.run(0.1)
    assert world.state.mode is Mode.DISABLED


def test_a_robot_without_a_program_is_switched_off_after_its_time_and_no_other() -> None:
    world = AgentWorld("MJ J1=5\nWAIT 3\nEND", times=Times(idle_off_s=1.0))
    world.run(0.3)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.READY)
    world.call(Run())
    until(world, ended(world))
    assert world.enabled
    until(world, lambda: world.state.mode is Mode.DISABLED, seconds=1.5)
    assert not world.enabled
    assert "idle_off" in [event.code for event in world.events]
    world.run(3.0)
    assert world.state.mode is Mode.DISABLED


@pytest.mark.parametrize("command", [Run(), Step(), Enable(), Jog("p", "J1", 0.1, JogFrame.BASE)])
def test_nothing_is_begun_while_the_drives_are_being_switched_off(command: Command) -> None:
    world = enabled(SHORT)
    world.answers_held = True
    off, other = world.call(Disable()), world.call(command)
    world.step()
    late = world.call(command)
    world.step()
    for id in (other, late):
        assert "is being switched off" in world.replies[id].text
    world.release_answers()
    world.run(0.1)
    assert world.replies[off].ok
    assert world.state.mode is Mode.DISABLED
    assert world.state.program.state is ProgramState.LOADED


def test_drives_that_a_gateway_did_not_switch_off_take_calls_again() -> None:
    world = enabled(SHORT)
    world.keeps_enabled = True
    world.call(Disable())
    world.step()
    world.call(Run())
    world.run(0.1)
    assert world.state.mode is Mode.RUNNING


def test_with_a_zone_whose_place_was_not_heard_a_program_says_what_it_waits_for() -> None:
    world = enabled(SHORT)
    world.geometry_lost = True
    world.zone = replace(world.zone, version=2)
    world.call(Run())
    world.run(1.0)
    assert world.state.mode is Mode.RUNNING
    assert "has not said yet where zone handover is" in world.state.waiting_for


def test_an_older_geometry_of_a_zone_does_not_take_the_place_of_the_present_one() -> None:
    world = enabled(SHORT)
    world.step()
    older = replace(ZONE, version=7, position_m=(50.0, 0.0, 0.0))
    world.agent.receive(older, world.now)
    assert world.agent.zones.geometry == (ZONE,)


def test_while_a_zone_is_changed_nothing_moves_and_what_was_planned_before_is_never_driven_on() -> None:
    world = running(INTO_ZONE)
    until(world, lambda: (world.state.tcp_speed_m_s or 0.0) > 0.1)
    world.zone_change = "handover"
    until(world, lambda: world.state.mode is Mode.HALTED)
    until(world, at_rest(world), seconds=2.0)
    assert world.state.waiting_for == "zone handover is being changed"
    assert [event.code for event in world.events if event.text == "halted: zone handover is being changed"] == [
        "zone_change"
    ]
    id = world.call(Run())
    until(world, lambda: id in world.replies)
    assert world.replies[id].text.startswith("left stays at rest: zone handover is being changed")
    larger = replace(ZONE, size_m=(3.0, 2.0, 3.0), version=2)
    world.geometry, world.zone = larger, ZoneStatus(ZoneState.OCCUPIED, "right", None, (), 2, world.now)
    world.zone_change, stood = None, world.commanded.copy()
    world.call(Continue())
    world.run(1.0)
    assert np.abs(world.commanded - stood).max() < 1e-9
    assert all(presence.stop_time_s == 0.0 for presence in world.presences[-40:])
