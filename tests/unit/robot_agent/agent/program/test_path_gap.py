"""How far a robot is from a stretch of its path, against dense samples of that stretch."""

from functools import cache

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.config.settings import PathWindow
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.plans import Planned
from robot_agent.agent.program.path_gap import Gap, Stretch
from robot_agent.language import Names, parse_program
from tests.unit.agent_world import AgentWorld

PROGRAM = "MJ J5=30\nML Y=150 F=200\nEND"
WINDOW = PathWindow()


@cache
def line() -> Planned:
    planner = AgentWorld(PROGRAM).planner
    return dry_run(planner, parse_program(PROGRAM, "left.prog", Names(planner.model.joint_names)), 60.0)[0][1]


@settings(max_examples=30, deadline=None)
@given(
    share=st.floats(0.0, 1.0), low=st.floats(0.0, 0.9), beside=st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6)
)
def test_the_nearest_point_is_that_of_dense_samples(share: float, low: float, beside: list[float]) -> None:
    motion = line().motion
    first, last = low * motion.duration_s, min(low + 0.3, 1.0) * motion.duration_s
    place = Stretch(line(), first, last, first)
    q = motion.q(np.array(first + share * (last - first))) + WINDOW.turn_rad * np.array(beside)
    gap = Gap.between(place, q, motion.model, WINDOW)
    taus = np.linspace(first, last, 20_001)
    nearest = np.abs(motion.q(taus) - q).max(axis=1).min() / WINDOW.turn_rad
    assert abs(gap.excess - nearest) < 1e-2
    assert gap.excess <= np.abs(beside).max() + 1e-3
    if gap.on_path:
        assert np.abs(motion.q(np.array(gap.tau)) - q).max() <= WINDOW.turn_rad * 1.000001
    else:
        assert gap.tau == place.left_tau
