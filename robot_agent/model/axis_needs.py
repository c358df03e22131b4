"""What a robot asks of its axes: its joints' limits through the mechanical coupling."""

from dataclasses import dataclass

import numpy as np

from robot_agent.model.robot_file import RobotFile


@dataclass(frozen=True, slots=True)
class AxisNeed:
    """One axis, so that every joint can use its limits [rad or m]."""

    linear: bool
    position: tuple[float, float]
    speed: float
    ramp: float
    """Acceleration of a braking ramp."""
    home: float
    """Where the axis is at the robot's home position."""


def axis_needs(model: RobotFile) -> dict[str, AxisNeed]:
    """What each axis must be able to do; empty when the coupling cannot be used."""
    joints = list(model.joints.values())
    if not joints or not set(model.coupling) <= set(model.joints):
        return {}
    if any(not set(sources) <= set(model.joints) for sources in model.coupling.values()):
        return {}
    matrix = model.coupling_matrix()
    share = np.eye(len(joints)) if matrix is None else np.linalg.inv(matrix)
    limits = np.array([joint.position for joint in joints])
    middle, half = share @ limits.mean(axis=1), np.abs(share) @ (limits[:, 1] - limits[:, 0]) / 2
    speed = np.abs(share) @ np.array([joint.speed for joint in joints])
    ramp = np.abs(share) @ np.array([model.ramp_factor * max(joint.accelerations) for joint in joints])
    home = share @ np.array([model.home.get(name, 0.0) for name in model.joints])
    bounds = limits if matrix is None else np.stack([middle - half, middle + half], axis=-1)
    return {
        name: AxisNeed(joint.linear, (float(low), float(high)), float(fast), float(hard), float(start))
        for (name, joint), (low, high), fast, hard, start in zip(
            model.joints.items(), bounds, speed, ramp, home, strict=True
        )
    }
