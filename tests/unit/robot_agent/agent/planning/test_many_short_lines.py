"""Programs of many short lines within a tolerance: read ahead by time, and run without a stop that is not asked for."""

import numpy as np
import pytest

from cell.messages import Continue, Halt, Mode, ProgramState, SetOverride
from robot_agent.agent.planning import lookahead
from tests.unit.agent_rounds import TO_START, extensions, speeds
from tests.unit.agent_runs import running, until
from tests.unit.agent_world import AgentWorld

TOLERANCE_M, FEED_M_S, LINE_M, RADIUS_M = 5e-5, 0.1, 5e-4, 0.05
PLACES = [
    (RADIUS_M * np.sin(turn), RADIUS_M * (1.0 - np.cos(turn))) for turn in np.arange(1, 301) * LINE_M / RADIUS_M
]
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
