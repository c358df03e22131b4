"""Random sequences of all kinds of moves in front of the example arm."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import load_model
from robot_agent.paths import Arc, Block, JointMove, Line, Sequence, Spline
from robot_agent.trajectory import Limits

MODEL = load_model(Path(__file__).parents[2] / "cell_configs" / "models" / "six_axis.yaml")
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
    blocks: list[Block] = []
    for line in range(1, int(rng.integers(2, longest + 1)) + 1):
        edge = [None, 0.0, 0.02, 0.05, 0.1][rng.integers(5)]
        speed = [None, 0.2, 0.8][rng.integers(3)]
        match int(rng.integers(0 if joint_moves else 1, 4)):
            case 0:
                target = START + rng.uniform(-0.4, 0.4, 6)
                blocks.append(JointMove(target, float(rng.uniform(0.3, 1)), line, round_m=edge))
            case 1:
                blocks.append(Line(pose(rng), speed, line, round_m=edge))
            case 2:
                blocks.append(Arc(pose(rng), pose(rng), line, speed_m_s=speed, round_m=edge))
            case _:
                poses = np.array([pose(rng) for _ in range(rng.integers(1, 4))])
                blocks.append(Spline(poses, line, speed_m_s=speed, round_m=edge))
    return Sequence(blocks)


def decorated(seed: int, longest: int = 8) -> Sequence:
    """The same, with caps on flange and joints, tools that follow the path, arcs by angle and joints not in step.

    Arcs go up to a turn and a half, both ways.
    """
    rng = np.random.default_rng([seed, 1])
    return Sequence([_decorated(block, rng) for block in sequence(seed, longest).blocks])


def _decorated(block: Block, rng: np.random.Generator) -> Block:
    block = replace(
        block,
        speed_m_s=_sometimes(rng, 0.1, 1.0),
        rotation_rad_s=_sometimes(rng, 0.2, 2.0),
        joint_speed_rad_s=_sometimes(rng, 0.2, 2.0),
    )
    chance, angle = rng.uniform(), rng.uniform(-np.pi, np.pi)
    if isinstance(block, JointMove):
        return replace(block, synchronised=False, round_m=None) if chance < 0.3 else block
    if chance < 0.2:
        block = replace(block, tangential_rad=angle)
    return replace(block, angle_rad=3.0 * angle) if isinstance(block, Arc) and chance < 0.5 else block


def _sometimes(rng: np.random.Generator, low: float, high: float) -> float | None:
    value = float(rng.uniform(low, high))
    return value if rng.uniform() < 0.4 else None
