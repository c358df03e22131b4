"""Long chains of moves: the motion that runs is extended, and nothing else changes for the operator."""

import pickle

import numpy as np
import pytest

from cell.geometry import body_touches
from cell.messages import Continue, Enable, Halt, Mode, ProgramState, ResetRobot, Run, SetOverride, Step
from robot_agent.agent.planning import lookahead
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.plans import Extended
from robot_agent.language import Names, parse_program
from robot_agent.model.description import NOTHING
from robot_agent.trajectory.timing.optimal.interior_point import Search
from tests.unit.agent_rounds import ROUND, TO_START, extensions, speeds
from tests.unit.agent_runs import enabled, running, until
from tests.unit.agent_world import CYCLE_S, ZONE, AgentWorld
from tests.unit.measured_world import START, Measured, shares

HALF_M, RADIUS_M, SPEED_M_S = 0.01, 0.05, 0.3
ROUND_S = (4.0 * HALF_M + 2.0 * np.pi * RADIUS_M) / SPEED_M_S
ENDLESS = f"{TO_START}LABEL again\n{ROUND}GOTO again"


@pytest.fixture
def few_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """Extend early, so that a test need not run for long."""
    monkeypatch.setattr(lookahead, "_CHAIN", 10)
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.0)


def on_its_rounds(program: str = ENDLESS) -> AgentWorld:
    world = running(program)
    until(world, lambda: world.state.program.line == 5)
    return world


def off_the_round(world: AgentWorld, since: int) -> float:
    """Largest distance [m] of the flange from the programmed curve: all of it is at one distance of a line."""
    x, y, z = world.planner.model.forward(np.array(world.played[since:]))[:, :3, 3].T
    across = np.hypot(y - np.clip(y, -HALF_M, HALF_M), z - 1.4)
    return float(np.hypot(across - RADIUS_M, x - 1.0).max())


def test_endless_round_of_66_tangential_moves_never_stops_and_what_is_kept_does_not_grow(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(lookahead, "_KEPT_S", 1.0)
    world = on_its_rounds()
    since = len(world.played)
    world.run(11.0 * ROUND_S)
    moving = speeds(world)[since:]
    assert moving.min() > 0.8 * SPEED_M_S
    assert moving.max() < 1.002 * SPEED_M_S
    assert off_the_round(world, since) < 1.2e-4
    limits, q = world.planner.limits, np.array(world.played[since:])
    for order, limit in enumerate((limits.velocity, limits.acceleration, limits.jerk), 1):
        assert (np.abs(np.diff(q, order, axis=0)).max(axis=0) < 1.001 * limit * CYCLE_S**order + 1e-9).all()
    sizes = [len(each.sweep.points) for each in extensions(world)]
    assert max(sizes[2:]) < 1.05 * sizes[1]


def test_dry_run_shows_a_long_chain_as_it_runs() -> None:
    arm = AgentWorld("END").planner
    program = parse_program(TO_START + 5 * ROUND + "MJ J1=20\nEND", "long.prog", Names(arm.model.joint_names))
    motions, failed = dry_run(arm, program, 60.0)
    assert failed is None
    assert [len(planned.lines) for planned in motions] == [1, 31, 1]
    assert motions[1].lines == tuple(range(2, 33))
    assert len(motions[1].motion.rests) == 3


def test_spline_of_many_points_is_one_curve_however_many_of_them_are_planned_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    along = np.arange(1.0, 26.0)
    places = np.stack([1000.0 + 20.0 * np.sin(1.7 * along), 60.0 * np.sin(0.9 * along), 1450.0 + 0.0 * along], axis=1)
    points = "".join(f"MS X={x:.2f} Y={y:.2f} Z={z:.2f} F=200\n" for x, y, z in places)
    arm = AgentWorld("END").planner
    program = parse_program(f"{TO_START}{points}END", "spline.prog", Names(arm.model.joint_names))
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.0)
    found = []
    for at_once, count in ((10, 1001), (100, 20_001)):
        monkeypatch.setattr(lookahead, "_CHAIN", at_once)
        motion = dry_run(arm, program, 60.0)[0][-1].motion
        assert len(motion.rests) == 2
        found.append(motion.pose(np.linspace(0.0, motion.duration_s, count))[:, :3, 3])
    away = [np.linalg.norm(place - found[1], axis=1).min() for place in found[0]]
    assert max(away) < 2.5e-4  # each point is blended, by 0.1 mm at most


def test_robot_goes_back_to_the_beginning_of_what_is_kept_and_on_again(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lookahead, "_KEPT_S", 1.0)
    world = on_its_rounds()
    until(world, lambda: any(each.cut_s > 0.0 for each in extensions(world)))
    world.run(0.5)
    since = len(world.played)
    world.call(SetOverride(-100.0))
    until(world, lambda: "is not known any more" in world.state.waiting_for)
    world.run(0.1)
    assert np.ptp(world.played[-10:], axis=0).max() == 0.0
    world.call(SetOverride(100.0))
    seen = len(extensions(world))
    until(world, lambda: len(extensions(world)) > seen + 1)
    assert off_the_round(world, since) < 1.2e-4


def test_extension_that_arrives_while_halted_is_taken_and_the_robot_goes_on_without_another_stop() -> None:
    world = on_its_rounds()
    world.plans_held, asked = True, len(world.planned)
    until(world, lambda: len(world.planned) > asked)
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.run(1.0)
    world.plans_held = False
    world.release_plans()
    world.call(Continue())
    until(world, lambda: world.state.tcp_speed_m_s > 0.8 * SPEED_M_S)
    since = len(world.played)
    world.run(2.0 * ROUND_S)
    assert speeds(world)[since:].min() > 0.8 * SPEED_M_S
    assert off_the_round(world, since) < 1.2e-4


def test_extension_that_comes_too_late_is_dropped_and_the_robot_goes_on_from_where_it_rests() -> None:
    world = on_its_rounds()
    world.plans_held = True
    until(world, lambda: world.state.governor.tau_s >= world.state.governor.duration_s)
    world.run(0.2)
    assert np.ptp(world.played[-10:], axis=0).max() == 0.0
    world.plans_held, since = False, len(world.played)
    world.release_plans()
    seen = len(extensions(world))
    until(world, lambda: len(extensions(world)) > seen)
    assert off_the_round(world, since) < 1.2e-4


def test_extension_that_is_late_is_asked_for_again_farther_ahead() -> None:
    """Its last move, which asks for a stop after it, says nothing about how its first one is joined."""
    world = running(TO_START + 4 * ROUND + "ML Y=10 F=300 R=0\nML Z=1340\nEND")
    until(world, lambda: len(world.planned) > 1)
    world.plans_held = True
    until(world, lambda: extensions(world) != [])
    until(world, lambda: world.state.governor.tau_s > extensions(world)[0].splice_s)
    world.plans_held = False
    world.release_plans()
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    first, second = extensions(world)
    assert first.lines == second.lines
    assert second.splice_s > first.splice_s + 0.5


def test_move_that_cannot_be_planned_behind_many_that_can_ends_the_program_where_these_end() -> None:
    fine = TO_START + 5 * ROUND
    world = on_its_rounds(fine + "ML X=9000 F=9999\nEND")
    until(world, lambda: world.state.program.state is ProgramState.FAILED)
    assert world.state.program.line == 3 + 5 * 6
    assert "line 33" in world.state.program.error
    assert off_the_round(world, len(world.played) - 1) < 1.2e-4
    assert world.state.mode is Mode.READY


def extension_of(feed_mm_s: float, monkeypatch: pytest.MonkeyPatch) -> tuple[Extended, int]:
    """The first extension of a chain of 40 rounded moves of 100 and 12 mm, and how many intervals were searched."""
    moves = "".join(
        f"ML Y={-300 + 12 * (k // 2)} Z={1350 + 100 * (k % 4 in (1, 2))} F={feed_mm_s} R=5\n" for k in range(40)
    )
    planner = AgentWorld("END").planner
    program = parse_program(f"{TO_START}{moves}END", "long.prog", Names(planner.model.joint_names))
    ahead, searched = lookahead.Lookahead(), []
    ahead.start(program, planner.model.home, NOTHING)
    while ahead.open is None:
        for effect in ahead.fill(()):
            ahead.planned(planner.plan(effect.request))
        if ahead.open is None:
            ahead.advance()
    step = Search._step
    monkeypatch.setattr(Search, "_step", lambda search: searched.append(len(search.limited.h)) or step(search))
    end_s = ahead.open.motion.duration_s
    (effect,) = next(asked for tau in np.arange(0.0, end_s, 0.1) if (asked := ahead.extend((0.0, tau), tau, ())))
    longer = planner.plan(effect.request)
    monkeypatch.setattr(Search, "_step", step)
    assert isinstance(longer, Extended)
    assert (longer.motion.rests > longer.splice_s).sum() == 1, "it stops only at its end"
    return longer, sum(searched)


def test_extension_of_a_slow_chain_costs_no_more_than_that_of_a_fast_one(monkeypatch: pytest.MonkeyPatch) -> None:
    fast, searched_fast = extension_of(300.0, monkeypatch)
    slow, searched_slow = extension_of(5.0, monkeypatch)
    assert slow.motion.duration_s > 20.0 * fast.motion.duration_s
    assert searched_slow < 4.0 * searched_fast
    assert len(pickle.dumps(slow)) < 5.0 * len(pickle.dumps(fast))


def test_steps_end_at_every_block_of_an_extended_motion_and_behind_them_it_is_extended_again() -> None:
    world = on_its_rounds()
    until(world, lambda: extensions(world) != [])
    ends = 0
    for override in (100.0, 100.0, -100.0, -100.0, -100.0):
        world.call(SetOverride(override))
        world.call(Step())
        until(world, lambda: world.state.mode is Mode.RUNNING)
        until(world, lambda: world.state.mode is Mode.HALTED)
        tau, planned = world.state.governor.tau_s, extensions(world)[-1]
        ends += int(np.abs(planned.motion.ends - tau).min() < 2e-5)
    assert ends == 5
    world.call(SetOverride(100.0))
    world.call(Continue())
    until(world, lambda: world.state.tcp_speed_m_s > 0.8 * SPEED_M_S)
    since, seen = len(world.played), len(extensions(world))
    until(world, lambda: len(extensions(world)) > seen)
    assert speeds(world)[since:].min() > 0.8 * SPEED_M_S


def test_zone_that_an_extension_enters_is_not_entered_before_it_is_granted() -> None:
    world = on_its_rounds(TO_START + 4 * ROUND + "ML X=2450 Y=0 Z=1400 F=800\nML X=1500 F=800\nEND")
    until(world, lambda: world.state.waiting_for.startswith("zone handover"))
    box = ZONE.solid()
    assert extensions(world) != []
    assert not any(body_touches(each.body, box) for each in world.presences)
    world.grant()
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    assert any(body_touches(each.body, box) for each in world.presences)


def test_short_moves_are_planned_far_enough_ahead_and_the_robot_does_not_stop_between_them() -> None:
    """Far more of them than of long ones, so that there is time to plan the next ones."""
    moves = "".join(f"ML Y={6 * number} F=300\n" for number in range(100))
    world = running(f"{TO_START}{moves}ML Y=800 F=300\nEND")
    until(world, lambda: world.state.program.line == 9)
    since = len(world.played)
    until(world, lambda: world.state.program.line == 103)
    assert speeds(world)[since:].min() > 0.99 * SPEED_M_S
    assert [len(planned.lines) for planned in world.planned] == [1, 24, 102]


@pytest.mark.usefixtures("few_ahead")
def test_endless_round_of_three_short_rounded_moves_never_stops() -> None:
    corners = "ML Y=40 F=200 R=10\nML Z=1400 F=200 R=10\nML Y=-10 Z=1350 F=200 R=10\n"
    world = running(f"{TO_START}LABEL again\n{corners}GOTO again")
    until(world, lambda: world.state.program.line == 5)
    since = len(world.played)
    until(world, lambda: len(extensions(world)) > 1)
    world.run(1.0)
    assert speeds(world)[since:].min() > 0.02


@pytest.mark.usefixtures("few_ahead")
def test_long_chain_on_a_belt_is_extended_and_does_not_stop_on_it() -> None:
    moves = "".join(f"ML Y={280 + 8 * number} F=80\n" for number in range(17))
    world = Measured(f"{START}TRACK belt\n{moves}TRACK OFF\nEND")
    world.belt_m_s = 0.05
    world.start()
    world.until_line(6)
    since = len(world.played)
    world.until_line(17)
    assert extensions(world) != []
    along, across = np.diff(world.places()[since:, :2], axis=0).T / CYCLE_S
    assert across.min() > 0.5 * 0.08
    np.testing.assert_allclose(along[100:], 0.05, atol=2e-3)
    world.until(lambda: world.done)
    assert (shares(world) < 1.01).all()


@pytest.mark.usefixtures("few_ahead")
def test_stop_while_an_extension_is_planned_leaves_out_no_move() -> None:
    world = on_its_rounds(f"{TO_START}{3 * ROUND}END")
    world.plans_held = True
    until(world, lambda: len(world.planned) > 0 and isinstance(world.planned[-1], Extended))
    world.quick_stop()
    world.run(0.1)
    world.plans_held = False
    world.release_plans()
    world.call(ResetRobot())
    until(world, lambda: world.state.mode is Mode.DISABLED)
    world.call(Enable())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Continue())
    since = len(world.played)
    before = world.state.program.line
    lines = [before]
    while world.state.program.state is not ProgramState.DONE:
        world.step()
        assert world.now < 200.0
        if world.state.program.line != lines[-1]:
            lines.append(world.state.program.line)
    assert lines == list(range(before, 22))
    assert off_the_round(world, since) < 1.2e-4


SLOW_M_S = 0.005


def slow_battlements(moves: int) -> str:
    """Moves of 4 mm and 2 mm by turns at `SLOW_M_S`, a rounded right angle after each of them."""
    up = "".join(f"ML {f'Y={4 * (k // 2) - 6}' if k % 2 == 0 else f'Z={1350 + k % 4}'} F=5 R=1\n" for k in range(moves))
    return f"{TO_START}{up}END"


@pytest.mark.parametrize("planning_s", [None, 5.0], ids=["what it takes", "5 s"])
def test_slow_chain_is_extended_after_the_time_that_planning_took_and_never_stops(planning_s: float | None) -> None:
    world = enabled(slow_battlements(60))
    world.planning_s = planning_s
    world.call(Run())
    until(world, lambda: world.state.program.line == 4)
    since = len(world.played)
    until(world, lambda: world.state.program.line == 30, 60.0)
    assert speeds(world)[since:].min() > 0.3 * SLOW_M_S
    last_lines = [each.lines[-1] for each in extensions(world)]
    assert len(last_lines) == len(set(last_lines)) > 0, "an extension came too late"


def test_new_run_has_nothing_planned_any_more_for_the_one_before() -> None:
    world = enabled(ENDLESS)
    world.plans_held = True
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(Run())
    until(world, lambda: world.state.mode is Mode.RUNNING)
    world.step()
    assert world.unplanned == [1]


def test_extension_that_the_robot_can_not_wait_for_is_planned_no_longer() -> None:
    world = on_its_rounds()
    world.plans_held = True
    until(world, lambda: extensions(world) != [])
    late = extensions(world)[0].id
    until(world, lambda: world.unplanned == [late])
