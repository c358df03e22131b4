"""A mounted tool's TCP moves on the path and keeps its speeds, told by forward kinematics of the tests' own."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.agent.planning.planner import Planner
from robot_agent.agent.planning.plans import Planned, PlanRequest
from robot_agent.kinematics import Model, load_model, model_of
from robot_agent.language import Interpreter, LineStep, Names, parse_program
from robot_agent.model.description import NOTHING, Mounted
from robot_agent.paths import Arc, JointMove, Line, Move, Sequence, Spline
from robot_agent.trajectory import Limits, Motion, plan
from robot_agent.workspace import PlacedRobot
from tests.unit.pinocchio_chains import CHAINS
from tests.unit.repository import ROOT
from tests.unit.robot_families import TOOLS, TORCH

FAMILIES = ("six_axis", "scara", "delta", "palletizer", "gantry")
each = pytest.mark.parametrize("family", FAMILIES)
LIMIT_M = 1e-6
WITH_TORCH = Mounted(("torch",))


def shipped(family: str, mounted: Mounted = WITH_TORCH) -> Model:
    """A robot of the shipped models, with the tool of the tests' families."""
    model = load_model(ROOT / "cell_configs" / "models" / f"{family}.yaml")
    return model_of(replace(model.description, tools=TOOLS, mounted=mounted))


def start_of(model: Model) -> np.ndarray:
    """Where there is room all around, away from singular poses."""
    starts = {"six_axis": [20, -25, 30, 15, 60, 10], "delta": [25, 20, 30, 0], "gantry": [0, 0, 0, 10, 45, 15]}
    start = np.radians(starts.get(model.description.family, np.degrees(model.home)))
    return np.where(model.linear, model.home, start)


def beside(pose: np.ndarray, xyz_mm: tuple[float, ...] = (0.0, 0.0, 0.0), turn_deg: float = 0.0) -> np.ndarray:
    """A pose beside another one, turned about the vertical."""
    moved = from_xyz_abc(np.array([0, 0, 0, 0, 0, np.radians(turn_deg)])) @ pose
    moved[:3, 3] = pose[:3, 3] + np.array(xyz_mm) / 1000.0
    return moved


def flanges(model: Model, q: np.ndarray) -> np.ndarray:
    """Poses `(k, 4, 4)` by Pinocchio; a delta's by Newton from the lengths of its rods."""
    lengths = model.description.geometry
    if model.description.family == "delta":
        return _platforms(lengths, q)
    peer, mixing = CHAINS[model.description.family](lengths)
    data, poses = peer.createData(), np.empty((len(q), 4, 4))
    for k, coordinates in enumerate(q @ mixing.T):
        pin.forwardKinematics(peer, data, coordinates)
        poses[k] = data.oMi[peer.njoints - 1].homogeneous
    return poses


def _platforms(g: dict[str, float], q: np.ndarray) -> np.ndarray:
    around = np.radians([0.0, 120.0, 240.0])
    outward = np.stack([np.cos(around), np.sin(around), np.zeros(3)], axis=-1)
    elbows = (g["r"] + g["h"] * np.cos(q[:, :3, None])) * outward
    elbows[..., 2] -= g["h"] * np.sin(q[:, :3])
    centre = np.tile([0.0, 0.0, -g["h"] - 0.5 * g["k"]], (len(q), 1))
    for _ in range(12):
        rods = centre[:, None] + g["s"] * outward - elbows
        missing = (rods**2).sum(axis=-1) - g["k"] ** 2
        centre -= np.linalg.solve(2.0 * rods, missing[..., None])[..., 0]
    poses = np.tile(np.eye(4), (len(q), 1, 1))
    poses[:, :2, :2] = np.moveaxis(
        np.array([[np.cos(q[:, 3]), -np.sin(q[:, 3])], [np.sin(q[:, 3]), np.cos(q[:, 3])]]), -1, 0
    )
    poses[:, :3, 3] = centre - [0.0, 0.0, g["t"]]
    return poses


def tcps(model: Model, motion: Motion, count: int = 2000) -> tuple[np.ndarray, np.ndarray]:
    """Even times `(count,)` [s] of a motion and the TCP's poses there."""
    t = np.linspace(0.0, motion.duration_s, count)
    return t, flanges(model, motion.q(t)) @ TORCH.pose_flange_tcp


def planned(model: Model, *moves: Move) -> Motion:
    return plan(model, Sequence(moves), Limits.of(model.description), start=start_of(model))


def speeds(t: np.ndarray, poses: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) / np.diff(t)


@each
def test_a_tool_of_200_mm_turns_about_its_tcp(family: str) -> None:
    model = shipped(family)
    here = flanges(model, start_of(model)[None])[0] @ TORCH.pose_flange_tcp
    motion = planned(model, Line(beside(here, turn_deg=30), None, 1))
    _, poses = tcps(model, motion)
    assert np.linalg.norm(poses[:, :3, 3] - here[:3, 3], axis=1).max() < 10 * LIMIT_M
    np.testing.assert_allclose(poses[-1], beside(here, turn_deg=30), atol=1e-6)
    moved = flanges(model, motion.q(np.array([0.0, motion.duration_s])))[:, :3, 3]
    assert np.linalg.norm(moved[1] - moved[0]) > 0.05


@each
def test_f_is_the_speed_of_the_tcp_on_a_line_on_which_the_tool_turns(family: str) -> None:
    model = shipped(family)
    here = flanges(model, start_of(model)[None])[0] @ TORCH.pose_flange_tcp
    motion = planned(model, Line(beside(here, (30, 40, 0), 20), 0.05, 1))
    t, poses = tcps(model, motion)
    way = np.array([0.6, 0.8, 0.0])
    off = poses[:, :3, 3] - here[:3, 3]
    assert np.linalg.norm(off - np.outer(off @ way, way), axis=1).max() < LIMIT_M
    speed = speeds(t, poses)
    assert speed.max() == pytest.approx(0.05, rel=1e-3)
    assert (speed > 0.0499).mean() > 0.3


@each
def test_an_arc_and_its_speed_are_those_of_the_tcp(family: str) -> None:
    model = shipped(family)
    here = flanges(model, start_of(model)[None])[0] @ TORCH.pose_flange_tcp
    motion = planned(model, Arc(beside(here, (25, 25, 0), 10), beside(here, (50, 0, 0), 20), 1, speed_m_s=0.05))
    t, poses = tcps(model, motion)
    radius = poses[:, :3, 3] - beside(here, (25, 0, 0))[:3, 3]
    assert abs(np.linalg.norm(radius, axis=1) - 0.025).max() < LIMIT_M
    assert abs(radius[:, 2]).max() < LIMIT_M
    assert speeds(t, poses).max() == pytest.approx(0.05, rel=2e-3)


Moves = Callable[[np.ndarray], tuple[Move, ...]]
PATHS: dict[str, Moves] = {
    "round edge": lambda here: (
        Line(beside(here, (60, 0, 0), 10), 0.1, 1, round_m=0.02),
        Line(beside(here, (60, 60, 0), 20), 0.1, 2),
    ),
    "spline": lambda here: (
        Spline(np.stack([beside(here, (30, 20, 0)), beside(here, (60, 0, 10), 10)]), 1, 0.1),
        Spline(beside(here, (90, 20, 0), 15)[None], 2, 0.1),
    ),
}


@pytest.mark.parametrize("path", PATHS)
@each
def test_round_edges_and_splines_are_the_curves_that_a_flange_without_tool_follows(family: str, path: str) -> None:
    model, gantry = shipped(family), shipped("gantry", NOTHING)
    here = flanges(model, start_of(model)[None])[0] @ TORCH.pose_flange_tcp
    _, poses = tcps(model, planned(model, *PATHS[path](here)), 400)
    bare = plan(gantry, Sequence(PATHS[path](_standing(gantry))), Limits.of(gantry.description), start=start_of(gantry))
    curve = flanges(gantry, bare.q(np.linspace(0.0, bare.duration_s, 4000)))[:, :3, 3] - _standing(gantry)[:3, 3]
    tool = poses[:, :3, 3] - here[:3, 3]
    assert max(_distance(point, curve) for point in tool) < 2 * LIMIT_M  # both follow their path to 1 um


def _standing(model: Model) -> np.ndarray:
    pose: np.ndarray = flanges(model, start_of(model)[None])[0]
    return pose


def _distance(point: np.ndarray, curve: np.ndarray) -> float:
    """Of a point from a curve given by its points `(m, 3)`, straight between them."""
    way, off = np.diff(curve, axis=0), point - curve[:-1]
    share = np.clip((off * way).sum(axis=1) / np.maximum((way**2).sum(axis=1), 1e-30), 0.0, 1.0)
    return float(np.linalg.norm(off - share[:, None] * way, axis=1).min())


@each
def test_caps_of_a_joint_move_are_those_of_the_tcp(family: str) -> None:
    model = shipped(family)
    target = start_of(model) - np.where(model.linear, 0.05, 0.2)
    t, poses = tcps(model, planned(model, JointMove(target, 1.0, 1, speed_m_s=0.05)))
    assert speeds(t, poses).max() == pytest.approx(0.05, rel=5e-3)


def test_a_program_speaks_of_the_tcp_and_tang_turns_the_tool() -> None:
    model = shipped("six_axis")
    down = np.diag([1.0, -1.0, -1.0, 1.0])  # the tool works downwards
    down[:3, 3] = 1.6, 0.2, 1.0
    start = model.solve(down, near=model.home)
    program = parse_program("TANG 1\nML X=1700 Y=300 F=100 R=20\nML Y=400 F=100", "here", Names(model.joint_names))
    interpreter = Interpreter(program, WITH_TORCH)
    steps = tuple(step for step in (interpreter.next() for _ in program.statements) if isinstance(step, LineStep))
    request = PlanRequest(1, steps, start, ())
    made = Planner(PlacedRobot.at(model), 0.004).plan(request)
    assert isinstance(made, Planned), made
    _, poses = tcps(model, made.motion)
    np.testing.assert_allclose(poses[-1, :3, 3], [1.7, 0.4, 1.0], atol=1e-6)
    way = np.gradient(poses[:, :2, 3], axis=0)
    moving = np.linalg.norm(way, axis=1) > 1e-5
    along = way[moving] / np.linalg.norm(way[moving], axis=1, keepdims=True)
    assert (along * poses[moving, :2, 0]).sum(axis=1).min() > 0.9999
