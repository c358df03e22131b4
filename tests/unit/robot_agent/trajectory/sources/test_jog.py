"""Jogging from any state: straight, inside every limit, always able to stop, and never silent about why it stands."""

import random
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import from_xyz_abc
from cell.messages import JogFrame
from robot_agent.kinematics import load_model
from robot_agent.trajectory import Limits
from robot_agent.trajectory.sources import JOG_SPEED_M_S, States
from robot_agent.trajectory.sources.admission import SOFT_MARGIN
from tests.unit.jog_world import ARM, CYCLE_S, START, Jogged
from tests.unit.repository import ROOT
from tests.unit.robot_families import robot

LOWER, UPPER = ARM.limits.position.T
WITHIN = 1.01
"""The gateway's own tolerance for differences of samples."""


def tcp_speeds(jogged: Jogged) -> np.ndarray:
    return np.linalg.norm(np.diff(jogged.tcp()[:, :3, 3], axis=0), axis=1) / CYCLE_S


def test_a_joint_jog_moves_one_joint_at_the_wished_speed_and_stops() -> None:
    jogged = Jogged()
    key = jogged.press(3, -0.3)
    jogged.run(key, 40)
    assert key.state.qd[3] == pytest.approx(-0.3)
    jogged.stop(key)
    moved = np.array(jogged.played)[:, np.arange(6) != 3]
    np.testing.assert_array_equal(moved, np.tile(moved[0], (len(moved), 1)))
    assert (jogged.shares() < WITHIN).all()


def test_the_tool_never_exceeds_reduced_speed_however_fast_the_wish() -> None:
    for axis in (0, "Y", "B"):
        jogged = Jogged()
        jogged.run(jogged.press(axis, 9.0), 40)
        assert tcp_speeds(jogged).max() < JOG_SPEED_M_S * 1.001


@pytest.mark.parametrize("frame", [JogFrame.BASE, JogFrame.TOOL])
def test_a_tool_jog_is_straight_keeps_the_orientation_and_stops_on_its_line(frame: JogFrame) -> None:
    jogged = Jogged()
    start = ARM.forward(START)
    axis = np.eye(3)[2] if frame is JogFrame.BASE else start[:3, 2]
    key = jogged.press("Z", -0.15, frame=frame)
    jogged.run(key, 40)
    jogged.stop(key)
    way = jogged.tcp()[:, :3, 3] - start[:3, 3]
    np.testing.assert_allclose(way - np.outer(way @ axis, axis), 0.0, atol=1e-9)
    np.testing.assert_allclose(jogged.tcp()[:, :3, :3], np.tile(start[:3, :3], (len(way), 1, 1)), atol=1e-9)
    assert (way @ axis)[-1] < -0.1
    assert (np.diff(way @ axis) < 1e-12).all()


def test_a_turn_leaves_the_tcp_where_it_is() -> None:
    jogged = Jogged()
    jogged.run(jogged.press("C", 0.2, frame=JogFrame.TOOL), 40)
    poses = jogged.tcp()
    np.testing.assert_allclose(poses[:, :3, 3], np.tile(poses[0, :3, 3], (len(poses), 1)), atol=1e-9)
    np.testing.assert_allclose(poses[-1, :3, 2], poses[0, :3, 2], atol=1e-9)
    assert (poses[-1, :3, 0] @ poses[0, :3, 0]) < np.cos(0.1)


@pytest.mark.parametrize(("axis", "speed", "step"), [(1, -0.2, 0.1), ("X", 0.1, 0.04), ("B", 0.3, 0.2)])
def test_a_step_ends_exactly_and_by_itself(axis: int | str, speed: float, step: float) -> None:
    jogged = Jogged()
    key = jogged.press(axis, speed, step)
    jogged.run(key, 80)
    assert key.arrived
    expected = ARM.forward(START)
    if isinstance(axis, int):
        expected = ARM.forward(START + step * np.sign(speed) * np.eye(6)[axis])
    elif axis == "X":
        expected[0, 3] += step
    else:
        expected[:3, :3] = from_xyz_abc(np.array([0, 0, 0, 0, step, 0]))[:3, :3] @ expected[:3, :3]
    np.testing.assert_allclose(ARM.forward(jogged.q), expected, atol=2e-6)


def test_it_stops_at_a_soft_limit_says_which_and_leaves_it_again() -> None:
    jogged = Jogged()
    key = jogged.press(4, 1.0)
    jogged.run(key, 250)
    assert jogged.q[4] == pytest.approx(UPPER[4] - SOFT_MARGIN, abs=3e-3)
    assert "J5 at its limit" in key.ruled_by
    back = jogged.press(4, -0.2)
    jogged.run(back, 20)
    assert jogged.q[4] < UPPER[4] - 0.03


def test_a_joint_outside_its_soft_limits_may_only_come_back() -> None:
    start = np.append(UPPER[0] - 0.1 * SOFT_MARGIN, START[1:])
    out, back = Jogged(start), Jogged(start)
    out.run(out.press(0, 0.2), 20)
    back.run(back.press(0, -0.2), 20)
    np.testing.assert_array_equal(out.q, start)
    assert back.q[0] < UPPER[0] - SOFT_MARGIN


def test_near_a_singularity_the_tool_slows_down_and_the_ruling_joint_is_named() -> None:
    jogged = Jogged(np.array([0.0, -0.2, 0.4, 0.0, 0.03, 0.0]))
    key = jogged.press("Y", 0.2)
    jogged.run(key, 20)
    assert 0.0 < tcp_speeds(jogged).max() < 0.1
    assert key.ruled_by.startswith(("J4", "J6"))
    assert "wrist" in key.ruled_by
    assert (jogged.shares() < WITHIN).all()


def test_in_a_singular_pose_it_stands_and_says_why() -> None:
    jogged = Jogged(np.zeros(6))
    key = jogged.press("Y", 0.1)
    jogged.run(key, 5)
    np.testing.assert_array_equal(jogged.q, np.zeros(6))
    assert "no joints move the tool this way" in key.ruled_by


def test_at_the_edge_of_its_reach_it_stands_and_says_so() -> None:
    jogged = Jogged(np.array([0.3, 0.55, -1.2, 0.09, 2.0, 0.3]))
    key = jogged.press("Z", 0.25)
    jogged.run(key, 160)
    assert "reach" in key.ruled_by or "elbow" in key.ruled_by
    assert tcp_speeds(jogged)[-5:].max() == 0.0
    assert (jogged.shares() < WITHIN).all()


def test_a_robot_with_four_joints_does_not_tilt_its_tool() -> None:
    scara = robot("scara")
    start = np.array([0.3, 0.7, 0.1, 0.2])
    jogged = Jogged(start, scara, Limits.of(scara.description))
    tilt, line = jogged.press("A", 0.2), jogged.press("X", 0.05)
    jogged.run(tilt, 3)
    np.testing.assert_array_equal(jogged.q, start)
    assert tilt.ruled_by
    jogged.run(line, 30)
    assert scara.forward(jogged.q)[0, 3] > scara.forward(start)[0, 3] + 0.002


MODELS = sorted((ROOT / "cell_configs" / "models").glob("*.yaml"))


@pytest.mark.parametrize("file", MODELS, ids=lambda file: file.stem)
def test_a_tool_of_every_family_goes_up_straight_and_within_the_limits(file: Path) -> None:
    model = load_model(file)
    jogged = Jogged(model.home, model, Limits.of(model.description))
    jogged.run(jogged.press("Z", 0.05), 12)
    way = jogged.tcp()[:, :3, 3] - jogged.tcp()[0, :3, 3]
    assert way[-1, 2] > 1e-3
    np.testing.assert_allclose(way[:, :2], 0.0, atol=1e-6)
    assert (jogged.shares() < WITHIN).all()


def test_what_is_in_the_way_is_approached_and_not_passed() -> None:
    wall = ARM.forward(START)[0, 3] + 0.05

    def clear(states: States) -> str:
        return "the wall" if (ARM.forward(states.q)[:, 0, 3] > wall).any() else ""

    jogged = Jogged()
    key = jogged.press("X", 0.2, clear=clear)
    jogged.run(key, 70)
    reached = jogged.tcp()[:, 0, 3].max()
    assert wall - 2e-3 < reached <= wall
    assert key.ruled_by == "the wall"


PRESSES = st.tuples(
    st.sampled_from([0, 1, 2, 3, 4, 5, "X", "Y", "Z", "A", "B", "C"]),
    st.floats(-1.5, 1.5).filter(lambda speed: abs(speed) > 0.02),
    st.sampled_from([JogFrame.BASE, JogFrame.TOOL]),
    st.integers(1, 25),
    st.booleans(),
)


@settings(max_examples=6, deadline=None)
@given(
    st.lists(st.floats(-1.0, 1.0), min_size=6, max_size=6),
    st.lists(PRESSES, min_size=1, max_size=5),
    st.randoms(use_true_random=False),
)
def test_any_keys_with_lost_blocks_keep_all_limits_and_end_at_rest(
    start: list[float], presses: list[tuple[int | str, float, JogFrame, int, bool]], luck: random.Random
) -> None:
    jogged = Jogged(START + 0.8 * np.array(start))
    for axis, speed, frame, blocks, release in presses:
        key = jogged.press(axis, speed, frame=frame)
        for _ in range(blocks):
            jogged.block(key, lost=luck.random() < 0.2)
            assert not jogged.way.qd[-1].any()
        if release:
            jogged.stop(key)
    jogged.run(jogged.press(0, 0.1), 1)
    rest = jogged.way.q
    assert (jogged.shares() < WITHIN).all()
    assert tcp_speeds(jogged).max() < JOG_SPEED_M_S * 1.005
    assert (rest > LOWER).all()
    assert (rest < UPPER).all()
