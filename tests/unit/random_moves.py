"""Random sequences of all kinds of moves in front of the example arm."""

from dataclasses import replace

import numpy as np

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import Model, load_model
from robot_agent.paths import Arc, JointMove, Line, Move, Sequence, Spline
from robot_agent.trajectory import Limits
from tests.unit.repository import ROOT

MODEL = load_model(ROOT / "cell_configs" / "models" / "six_axis.yaml")
LIMITS = Limits.of(MODEL.description)
START = MODEL.home + np.radians([0, 0, 0, 20, -25, 0])
_CENTRE = MODEL.forward(START)


def pose(rng: np.random.Generator) -> np.ndarray:
    """Within 300 mm and about 25 deg of the centre."""
    made = np.eye(4)
    turn = from_xyz_abc(np.array([0.0, 0.0, 0.0, *rng.uniform(-0.3, 0.3, 3)]))[:3, :3]
    made[:3, :3], made[:3, 3] = turn @ _CENTRE[:3, :3], _CENTRE[:3, 3] + rng.uniform(-0.3, 0.3, 3)
    return made


def sequence(seed: int, longest: int = 20, joint_moves: bool = True) -> Sequence:
    """Two to `longest` moves with random speeds and round edges."""
    rng = np.random.default_rng(seed)
    moves: list[Move] = []
    for line in range(1, int(rng.integers(2, longest + 1)) + 1):
        edge = [None, 0.0, 0.02, 0.05, 0.1][rng.integers(5)]
        speed = [None, 0.2, 0.8][rng.integers(3)]
        match int(rng.integers(0 if joint_moves else 1, 4)):
            case 0:
                target = START + rng.uniform(-0.4, 0.4, 6)
                moves.append(JointMove(target, float(rng.uniform(0.3, 1)), line, round_m=edge))
            case 1:
                moves.append(Line(pose(rng), speed, line, round_m=edge))
            case 2:
                moves.append(Arc(pose(rng), pose(rng), line, speed_m_s=speed, round_m=edge))
            case _:
                poses = np.array([pose(rng) for _ in range(rng.integers(1, 4))])
                moves.append(Spline(poses, line, speed_m_s=speed, round_m=edge))
    return Sequence(moves)


def decorated(seed: int, longest: int = 8) -> Sequence:
    """The same, with caps on flange and joints, tools that follow the path, arcs by angle and joints not in step.

    Arcs go up to a turn and a half, both ways.
    """
    rng = np.random.default_rng([seed, 1])
    return Sequence([_decorated(move, rng) for move in sequence(seed, longest).moves])


def _decorated(move: Move, rng: np.random.Generator) -> Move:
    move = replace(
        move,
        speed_m_s=_sometimes(rng, 0.1, 1.0),
        rotation_rad_s=_sometimes(rng, 0.2, 2.0),
        joint_speed_rad_s=_sometimes(rng, 0.2, 2.0),
    )
    chance, angle = rng.uniform(), rng.uniform(-np.pi, np.pi)
    if isinstance(move, JointMove):
        return replace(move, synchronised=False, round_m=None) if chance < 0.3 else move
    if chance < 0.2:
        move = replace(move, tangential_rad=angle)
    return replace(move, angle_rad=3.0 * angle) if isinstance(move, Arc) and chance < 0.5 else move


def _sometimes(rng: np.random.Generator, low: float, high: float) -> float | None:
    value = float(rng.uniform(low, high))
    return value if rng.uniform() < 0.4 else None


def round_sequence(model: Model, seed: int, longest: int = 8) -> Sequence:
    """Moves of all kinds by round steps from home: level, upright, symmetric, mirrored, there and back, on one place.

    What people type: exact zeros, right angles and half turns, which random floats never hit.
    """
    rng = np.random.default_rng([seed, 2])
    home = model.forward(model.home)
    poses = [home]

    def drawn() -> np.ndarray:
        if rng.uniform() < 0.3:
            return poses[rng.integers(len(poses))].copy()
        made = poses[-1].copy()
        steps = rng.choice([0.0, 0.0, 0.1, -0.1, 0.2, -0.2], 3)
        made[:3, 3] = made[:3, 3] + steps if rng.uniform() < 0.8 else made[:3, 3] * [1.0, -1.0, 1.0]
        if rng.uniform() < 0.3:
            about = np.zeros(6)
            about[rng.integers(3, 6) if model.n == 6 else 5] = np.radians(rng.choice([90.0, -90.0, 180.0]))
            made[:3, :3] = from_xyz_abc(about)[:3, :3] @ made[:3, :3]
        poses.append(made)
        return made

    moves: list[Move] = []
    for line in range(1, int(rng.integers(2, longest + 1)) + 1):
        edge, along = [None, None, 0.0, 0.05][rng.integers(4)], [None, None, None, 0.0][rng.integers(4)]
        match int(rng.integers(5)):
            case 0:
                turns = np.radians(rng.choice([0.0, 0.0, 0.0, 30.0, -30.0, 90.0], model.n))
                target = model.home + np.where(model.linear, rng.choice([0.0, 0.1, -0.1], model.n), turns)
                moves.append(JointMove(target, 1.0, line, round_m=edge))
                poses.append(model.forward(target))
            case 1 | 2:
                moves.append(Line(drawn(), None, line, round_m=edge, tangential_rad=along))
            case 3:
                angle = [None, None, np.pi, -np.pi, 2.0 * np.pi][rng.integers(5)]
                moves.append(Arc(drawn(), drawn(), line, angle, round_m=edge, tangential_rad=along))
            case _:
                points = np.array([drawn() for _ in range(rng.integers(1, 4))])
                moves.append(Spline(points, line, round_m=edge, tangential_rad=along))
    return Sequence(moves)
