"""The state says how long the present move is, how much of it is done, and where it ends."""

import numpy as np
import pytest

from cell.messages import Mode
from tests.unit.agent_runs import ended, running, until


def test_a_line_is_as_long_as_it_is_drawn_and_done_as_far_as_the_tcp_has_come() -> None:
    world = running("MJ J1=20 J2=-20 J3=30 J5=60 F=60\nML Y=200 F=300\nML Z=1500 F=300\nEND")
    until(world, ended(world))
    for line in (2, 3):
        on = [
            state
            for state in world.states
            if state.program.line == line and state.move is not None and state.mode is Mode.RUNNING
        ]
        assert len({state.move.target_joints for state in on if state.move}) == 1
        last = on[-1].move
        assert last is not None
        target = np.array(last.target_position_m)
        begins = np.array(on[0].tcp_position_m)
        for state in on:
            assert state.move is not None
            left_m = np.linalg.norm(target - np.array(state.tcp_position_m))
            assert state.move.length_m - state.move.done_m == pytest.approx(left_m, abs=2e-3)
            assert 0.0 <= state.move.done_s <= state.move.duration_s
        assert last.length_m >= np.linalg.norm(target - begins) - 1e-3
        assert last.done_s > 0.9 * last.duration_s
    assert world.state.move is None
    np.testing.assert_allclose(world.states[-1].joints or (), last.target_joints, atol=1e-6)


def test_a_joint_move_ends_at_its_joints() -> None:
    world = running("MJ J1=20 J2=-20 F=60\nMJ J1=0 R=10\nHOME\nEND")
    until(world, lambda: world.state.move is not None)
    assert world.state.move is not None
    np.testing.assert_allclose(np.degrees(world.state.move.target_joints[:2]), [20.0, -20.0], atol=1e-6)
    assert world.state.move.length_m > 0.5
