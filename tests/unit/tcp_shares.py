"""What the flange uses of its limits of acceleration and jerk, by differences of its twist."""

import numpy as np

from robot_agent.model.description import PathSpeeds
from robot_agent.trajectory import Motion

STEP_S = 2.5e-4
SLOWEST = np.array([1e-3, np.radians(1.0)])
"""Speed and angular speed below which the flange reverses, as docs/motion.md says."""


def tcp_shares(
    motion: Motion, limits: PathSpeeds, on_path: list[bool], every_s: float, apart_s: float = 0.0
) -> np.ndarray:
    """Shares `(k, 5)` along way and turn, across the way, and of the jerk of both, as docs/motion.md means them.

    Where moves `on_path` `(moves,)` are moves of the flange, `apart_s` before and after too.
    """
    middle = np.arange(STEP_S, motion.duration_s - STEP_S, every_s)
    held = np.array(on_path)[motion.move_at(middle[:, None] + max(STEP_S, apart_s) * np.linspace(-1.0, 1.0, 7))]
    at = middle[held.all(axis=1), None] + STEP_S * np.array([-1.0, 0.0, 1.0])
    twist = (motion.model.jacobian(motion.q(at)) @ motion.qd(at)[..., None])[..., 0]
    before, here, after = np.moveaxis(twist.reshape(*at.shape, 2, 3), 1, 0)
    change, third = (after - before) / (2.0 * STEP_S), (after - 2.0 * here + before) / STEP_S**2
    speed = np.linalg.norm(here, axis=2)
    way = here / np.maximum(speed, 1e-9)[..., None]
    along = (change * way).sum(axis=2)
    across = np.linalg.norm(change - along[..., None] * way, axis=2)
    jerk = (third * way).sum(axis=2) + across**2 / np.maximum(speed, SLOWEST)
    linear, angular = limits.acceleration_m_s2, limits.angular_acceleration_rad_s2
    allowed = np.array([linear, angular, linear, limits.jerk_m_s3, limits.angular_jerk_rad_s3])
    return np.asarray(np.abs(np.column_stack([along, across[:, 0], jerk])) / allowed)
