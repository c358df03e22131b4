"""Random smooth paths of six joints, for comparing timings along them."""

import numpy as np

from robot_agent.trajectory.joints.joint_path import JointPath, Stretch
from robot_agent.trajectory.joints.pieces import Pieces

VELOCITY = np.array([2.0, 1.8, 2.2, 3.0, 3.0, 4.0])
ACCELERATION = np.array([5.0, 4.5, 5.0, 9.0, 9.0, 10.0])


def smooth_path(seed: int) -> JointPath:
    """Three to six sines per joint over a way of 1, as quintic pieces; only the joints' limits hold along it."""
    rng = np.random.default_rng(seed)
    terms = int(rng.integers(3, 7))
    amplitude = rng.uniform(-0.5, 0.5, (terms, 6)) / np.arange(1, terms + 1)[:, None]
    speed = np.pi * np.arange(1, terms + 1)[:, None] * rng.uniform(0.5, 1.0, (terms, 6))
    phase = rng.uniform(0.0, 2.0 * np.pi, (terms, 6))
    s = np.linspace(0.0, 1.0, 161)
    angle = s[:, None, None] * speed + phase
    states = [
        (amplitude * np.sin(angle)).sum(axis=1),
        (amplitude * speed * np.cos(angle)).sum(axis=1),
        (-amplitude * speed**2 * np.sin(angle)).sum(axis=1),
    ]
    still = np.zeros((len(s), 2))
    pieces = Pieces.through(s, *[np.column_stack([state, still]) for state in states])
    free = Stretch(1.0, 0, 1.0, np.inf, np.inf, on_path=False)
    return JointPath(pieces, (free,), np.zeros((0, 2)), (), (1.0, 0.0), None)
