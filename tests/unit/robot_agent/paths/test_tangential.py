"""The tool that follows the path: its direction, the turns at corners, and what has no direction."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cell.geometry import from_xyz_abc
from robot_agent.agent.planning.dry_run import dry_run
from robot_agent.agent.planning.planner import Planner
from robot_agent.language import Names, parse_program
from robot_agent.paths import Arc, Line, Sequence, Spline
from robot_agent.paths.orientation import axis_angle
from robot_agent.paths.sequence import Move
from robot_agent.paths.tangential import aligned
from robot_agent.trajectory import Motion, PlanError, plan
from robot_agent.workspace import PlacedRobot
from tests.unit.random_moves import LIMITS, MODEL, START

HERE = MODEL.forward(START)


def at(x_mm: float = 0.0, y_mm: float = 0.0, z_mm: float = 0.0) -> np.ndarray:
    pose = HERE.copy()
    pose[:3, 3] += np.array([x_mm, y_mm, z_mm]) / 1000.0
    return pose


def planned(*moves: Move) -> Motion:
    return plan(MODEL, Sequence(moves), LIMITS, start=START)


def angles_to_the_path(motion: Motion) -> np.ndarray:
    """Degrees between the flange's y axis and its direction of travel, seen from above, wherever it travels."""
    taus = np.linspace(0.0, motion.duration_s, 800)
    q = motion.q(taus)
    v = (MODEL.jacobian(q)[:, :3] @ motion.qd(taus)[..., None])[..., 0]
    y = MODEL.forward(q)[:, :3, 1]
    angle = np.degrees(np.arctan2(y[:, 1], y[:, 0]) - np.arctan2(v[:, 1], v[:, 0]))
    return ((angle + 180.0) % 360.0 - 180.0)[np.linalg.norm(v[:, :2], axis=1) > 0.01]


@pytest.mark.parametrize("offset_deg", [0.0, 30.0, -90.0])
def test_the_tool_keeps_its_angle_on_lines_round_edges_arcs_and_splines(offset_deg: float) -> None:
    tangential = {"tangential_rad": np.radians(offset_deg)}
    motion = planned(
        Line(at(y_mm=120), 0.3, 1, round_m=0.03, **tangential),
        Line(at(x_mm=-100, y_mm=180, z_mm=30), 0.3, 2, **tangential),
        Arc(at(x_mm=-150, y_mm=240, z_mm=30), at(x_mm=-100, y_mm=300), 3, speed_m_s=0.3, **tangential),
        Spline(np.array([at(y_mm=320), at(x_mm=80, y_mm=260)]), 4, speed_m_s=0.3, **tangential),
    )
    np.testing.assert_allclose(angles_to_the_path(motion), offset_deg, atol=0.05)


def test_the_tilt_of_the_tool_stays() -> None:
    motion = planned(Spline(np.array([at(100, 100, 50), at(200, 0)]), 1, speed_m_s=0.2, tangential_rad=0.0))
    rotations = motion.pose(motion.grid)[:, :3, :3]
    np.testing.assert_allclose(rotations[:, 2], np.tile(HERE[2, :3], (len(rotations), 1)), atol=1e-5)


def test_at_a_sharp_corner_the_robot_stops_turns_the_tool_on_the_spot_and_goes_on() -> None:
    first, last = Line(at(y_mm=120), 0.3, 1, tangential_rad=0.0), Line(at(100, 120), 0.3, 2, tangential_rad=0.0)
    motion = planned(first, last)
    places = motion.pose(motion.rests)
    moved = np.linalg.norm(np.diff(places[:, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(moved[-3:], [0.12, 0.0, 0.1], atol=1e-6)
    corner = axis_angle(places[-2, :3, :3] @ places[-3, :3, :3].T)[1]
    assert np.degrees(corner) == pytest.approx(90.0, abs=1e-3)
    np.testing.assert_allclose(motion.pose(motion.ends)[:, :3, 3], [at(0, 120)[:3, 3], at(100, 120)[:3, 3]], atol=1e-6)


def test_a_round_edge_needs_no_stop() -> None:
    first = Line(at(y_mm=120), 0.3, 1, tangential_rad=0.0, round_m=0.04)
    motion = planned(first, Line(at(100, 120), 0.3, 2, tangential_rad=0.0))
    places = motion.pose(motion.rests)[:, :3, 3]
    assert (np.linalg.norm(np.diff(places, axis=0), axis=1) > 1e-6).sum() == 1


def test_behind_it_the_programmed_orientation_counts_again() -> None:
    motion = planned(Line(at(y_mm=120), 0.3, 1, tangential_rad=0.5), Line(at(y_mm=250), 0.3, 2))
    np.testing.assert_allclose(motion.pose(motion.rests[-1:])[0], at(y_mm=250), atol=1e-6)
    assert np.abs(motion.pose(motion.ends[:1])[0, :3, :3] - HERE[:3, :3]).max() > 0.1


def test_straight_up_the_tool_has_no_direction() -> None:
    with pytest.raises(PlanError, match=r"line 7.*straight up or down.*switch TANG off") as caught:
        planned(
            Line(at(y_mm=50), None, 6, tangential_rad=0.0), Line(at(y_mm=50, z_mm=100), None, 7, tangential_rad=0.0)
        )
    assert caught.value.move == 1


ANGLE = st.floats(-3.0, 3.0)


@settings(max_examples=100, deadline=None)
@given(st.tuples(ANGLE, ANGLE, ANGLE), ANGLE, ANGLE)
def test_aligning_depends_on_the_tilt_alone_and_twice_is_once(
    abc: tuple[float, ...], direction: float, angle: float
) -> None:
    rotation = from_xyz_abc(np.array([0.0, 0.0, 0.0, *abc]))[:3, :3]
    tangent = np.array([np.cos(direction), np.sin(direction), 0.3])
    once = aligned(rotation, tangent, angle)
    turned = from_xyz_abc(np.array([0.0, 0.0, 0.0, 0.0, 0.0, angle]))[:3, :3] @ rotation
    np.testing.assert_allclose(once[2], rotation[2], atol=1e-12)
    np.testing.assert_allclose(aligned(once, tangent, angle), once, atol=1e-9)
    np.testing.assert_allclose(aligned(turned, tangent, angle), once, atol=1e-9)


def test_a_program_with_tang_turns_the_tool_and_leaves_it_alone_behind_it() -> None:
    program = """TANG 1 H=-20
ML Y=100 F=200 R=20
MC QX=1100 QY=150 X=1050 Y=200 F=200
TANG 0
ML Y=250 F=200
"""
    parsed = parse_program(program, "p", Names(MODEL.joint_names))
    motions, failed = dry_run(Planner(PlacedRobot.at(MODEL), 0.004), parsed, 60.0)
    assert failed is None
    first, last = (planned.motion for planned in motions)
    np.testing.assert_allclose(angles_to_the_path(first), -20.0, atol=0.1)
    rotations = last.pose(last.grid)[:, :3, :3]
    np.testing.assert_allclose(rotations, np.tile(rotations[0], (len(rotations), 1, 1)), atol=1e-5)


def test_an_angle_of_the_tool_that_is_no_number_is_refused() -> None:
    with pytest.raises(ValueError, match="line 5: angle of the tool inf"):
        Line(np.eye(4), None, 5, tangential_rad=np.inf)
