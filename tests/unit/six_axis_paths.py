"""Random smooth joint paths that the tests of the workspace share."""

import numpy as np
import pinocchio as pin

CYCLE_S = 0.004
BASE = pin.SE3(pin.utils.rotate("z", 0.7) @ pin.utils.rotate("x", np.pi), np.array([1.0, -0.5, 2.0])).homogeneous


def joint_path(seed: int, taus: np.ndarray) -> np.ndarray:
    """Joints `(m, 6)` at `taus`: sums of sines up to about 2 rad/s and 10 rad/s^2 per joint, turn-arounds included.

    With an odd seed they swing about right angles, and some joints stand still.
    """
    rng = np.random.default_rng(seed)
    centre = rng.uniform(-1, 1, 6)
    amplitude, speed = rng.uniform(0.0, 0.5, (2, 6)), rng.uniform(0.5, 4.0, (2, 6))
    phase = rng.uniform(-np.pi, np.pi, (2, 6))
    if seed % 2:
        centre = np.pi / 2 * np.rint(2.0 * centre)
        amplitude = np.where(rng.uniform(size=6) < 0.4, 0.0, amplitude)
    return centre + (amplitude * np.sin(speed * np.asarray(taus)[:, None, None] + phase)).sum(axis=1)


def evenly_between(q: np.ndarray, parts: int) -> np.ndarray:
    """Joints that move in straight lines from sample to sample, `parts` steps each."""
    at = np.linspace(0, len(q) - 1, (len(q) - 1) * parts + 1)
    return np.stack([np.interp(at, np.arange(len(q)), column) for column in q.T], axis=-1)
