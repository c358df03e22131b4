"""Programs of many short lines within a tolerance: read ahead by time, and run without a stop that is not asked for."""

import numpy as np
import pytest

from cell.messages import Continue, Halt, Mode, ProgramState, SetOverride
from robot_agent.agent.planning import lookahead
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.reading import ReadAhead
from robot_agent.language import Interpreter, Names, parse_program
from tests.unit.agent_rounds import TO_START, extensions, speeds
from tests.unit.agent_runs import running, until
from tests.unit.agent_world import AgentWorld

NAMES = Names(tuple(f"J{k}" for k in range(1, 7)))
TOLERANCE_M, FEED_M_S, LINE_M, RADIUS_M = 5e-5, 0.1, 5e-4, 0.05
PLACES = [(RADIUS_M * np.sin(turn), RADIUS_M * (1.0 - np.cos(turn))) for turn in np.arange(1, 301) * LINE_M / RADIUS_M]
CIRCLE = "".join(f"ML Y={1000.0 * y:.4f} Z={1350.0 + 1000.0 * z:.4f}\n" for y, z in PLACES)
PROGRAM = f"{TO_START}TOL 0.05\nML Y=0 Z=1350 F=100\n{CIRCLE}"


def off_the_circle(world: AgentWorld, since: int) -> float:
    """Largest distance [m] of the flange from the circle, whose chords are 0.6 um away from it."""
    x, y, z = world.planner.model.forward(np.array(world.played[since:]))[:, :3, 3].T
    return float(np.hypot(np.hypot(y, z - 1.4) - RADIUS_M, x - 1.0).max())


@pytest.fixture
def short_ahead(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read so little ahead that a program of 3 s is extended several times."""
    monkeypatch.setattr(lookahead, "_BEGIN_S", 1.2)
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.6)


@pytest.mark.usefixtures("short_ahead")
def test_three_hundred_lines_run_at_their_feed_with_a_halt_and_an_override_in_between() -> None:
    world = running(PROGRAM + "END")
    until(world, lambda: world.state.program.line > 60)
    since = len(world.played)
    world.call(SetOverride(60.0))
    until(world, lambda: world.state.program.line > 120)
    slow = speeds(world)[since:]
    assert slow.min() > 0.55 * FEED_M_S
    world.call(Halt())
    until(world, lambda: world.state.mode is Mode.HALTED)
    world.call(SetOverride(100.0))
    world.call(Continue())
    until(world, lambda: world.state.tcp_speed_m_s > 0.95 * FEED_M_S)
    again = len(world.played)
    until(world, lambda: world.state.program.line > 280)
    assert speeds(world)[again:].min() > 0.95 * FEED_M_S
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    assert off_the_circle(world, since) < TOLERANCE_M
    assert speeds(world)[since:].max() < 1.002 * FEED_M_S
    assert extensions(world) != []


def test_coordinates_that_are_not_named_keep_the_value_of_the_program_over_all_extensions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(lookahead, "_BEGIN_S", 1.2)
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.6)
    wave = "".join(f"ML Y={k / 2:g} Z={1350 + 0.3 * np.sin(k / 3):.4f}\n" for k in range(1, 500))
    world = running(f"{TO_START}TOL 0.05\nML Y=0 Z=1350 F=100\n{wave}TOL 0\nML Y=260\nEND")
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    last = world.planner.model.forward(np.array(world.played[-1:]))[0, :3, 3]
    assert extensions(world) != []
    assert last == pytest.approx([1.0, 0.26, 1.35 + 3e-4 * np.sin(499 / 3)], abs=2e-6)


def test_what_asks_for_rest_ends_the_curve_exactly_at_the_line_before_it() -> None:
    lines = CIRCLE.splitlines(keepends=True)
    world = running(
        f"{TO_START}TOL 0.05\nML Y=0 Z=1350 F=100\n{''.join(lines[:40])}WAIT 0.3\n{''.join(lines[40:80])}END"
    )
    until(world, lambda: world.state.program.line == 44)
    until(world, lambda: world.state.program.line == 45)
    rests = [q for q, after in zip(world.played, world.played[1:], strict=False) if np.array_equal(q, after)]
    places = world.planner.model.forward(np.array(rests))[:, :3, 3]
    away = np.linalg.norm(places - [1.0, PLACES[39][0], 1.35 + PLACES[39][1]], axis=1)
    assert away.min() < 2e-6


def test_outputs_switch_where_the_end_of_their_line_lies_and_the_robot_does_not_slow_down() -> None:
    lines = CIRCLE.splitlines(keepends=True)
    text = f"{''.join(lines[:100])}SET DO gripper\n{''.join(lines[100:200])}RESET DO gripper\n{''.join(lines[200:])}"
    program = parse_program(f"{TO_START}TOL 0.05\nML Y=0 Z=1350 F=100\n{text}END", "p", NAMES)
    motions, failed = dry_run(AgentWorld("END").planner, program, 60.0)
    assert failed is None
    path = motions[-1]
    marked = [k for k, marks in enumerate(path.switches) if marks]
    assert [path.lines[k] for k in marked] == [104, 205]
    places = path.motion.pose(path.motion.ends[marked])[:, 1:3, 3]
    assert places == pytest.approx(np.array([PLACES[99], PLACES[199]]) + np.array([0.0, 1.35]), abs=TOLERANCE_M)
    inside = np.linspace(path.motion.ends[60], path.motion.ends[240], 2000)
    assert path.motion.tcp_speed(inside).min() > 0.98 * FEED_M_S


def test_the_robot_goes_back_over_the_lines_and_on_again() -> None:
    world = running(PROGRAM + "END")
    until(world, lambda: world.state.program.line > 150)
    since = len(world.played)
    world.call(SetOverride(-100.0))
    until(world, lambda: world.state.program.line < 80)
    world.call(SetOverride(100.0))
    until(world, lambda: world.state.program.state is ProgramState.DONE)
    assert off_the_circle(world, since) < TOLERANCE_M


def test_steps_are_read_ahead_in_portions_and_by_how_long_they_last() -> None:
    lines = "".join(f"ML Y={k / 10:g}\n" for k in range(1, 2001))
    program = parse_program(f"TOL 0.05\nML X=0 Y=0 Z=0 F=100\n{lines}END", "p", NAMES)
    ahead = ReadAhead(Interpreter(program), 300)
    assert not ahead.reaches(1.0)
    assert len(ahead.lines) == 301
    while not ahead.reaches(1.0):
        pass
    assert ahead.lasting_s == pytest.approx(1.0, abs=2e-3)
    taken = [ahead.next()[0] for _ in range(500)]
    assert ahead.lasting_s == pytest.approx(0.5, abs=3e-3)
    ahead.give_back(taken)
    assert ahead.lasting_s == pytest.approx(1.0, abs=3e-3)
    assert [ahead.next()[0].line for _ in range(3)] == [2, 3, 4]
    assert len(ahead.moves_beyond(60)) == 60
    while not ahead.reaches(1e9):
        pass
    assert len(ahead.lines) == 1999


def test_an_endless_program_keeps_no_more_the_longer_it_runs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lookahead, "_BEGIN_S", 1.2)
    monkeypatch.setattr(lookahead, "_AHEAD_S", 1.6)
    monkeypatch.setattr(lookahead, "_KEPT_S", 0.5)
    turn = np.arange(1, 101) * np.pi / 50.0
    loop = "".join(f"ML Y={20 * np.sin(a):.4f} Z={1370 - 20 * np.cos(a):.4f}\n" for a in turn)
    world = running(f"{TO_START}TOL 0.05\nML Y=0 Z=1350 F=100\nLABEL again\n{loop}GOTO again")
    until(world, lambda: len(extensions(world)) > 7)
    blocks = [len(each.lines) for each in extensions(world)]
    assert max(blocks[3:]) < 1.3 * min(blocks[3:])
    inside = speeds(world)[-800:]
    assert inside.min() > 0.95 * FEED_M_S
