"""Random sequences of all kinds of moves in front of the example arm."""

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
