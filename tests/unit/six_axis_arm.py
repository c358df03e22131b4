"""The six-axis arm that the tests of geometry, kinematics and workspace share."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import SixAxis
from robot_agent.model.description import (
    Capsule,
    CapsuleBody,
    JointLimits,
    Mounted,
    PathSpeeds,
    RobotDescription,
    Tool,
)
from tests.unit.repository import vectors

VECTORS: dict[str, Any] = vectors("six_axis.json")

CAPSULES = (
    CapsuleBody(0, (0.0, 0.0, 0.1), (0.0, 0.0, 0.5), 0.25),
    CapsuleBody(1, (0.0, 0.0, 0.0), (0.4, 0.0, 0.68), 0.2),
    CapsuleBody(2, (0.0, 0.0, 0.0), (0.0, 0.0, 1.1), 0.15),
    CapsuleBody(3, (0.0, 0.0, 0.1), (0.766, 0.0, 0.23), 0.14),
    CapsuleBody(4, (0.0, 0.02, 0.0), (0.345, 0.0, 0.03), 0.1),
    CapsuleBody(5, (0.0, 0.0, 0.0), (0.1, 0.0, 0.05), 0.09),
    CapsuleBody(6, (-0.05, 0.0, 0.0), (0.2, 0.1, -0.15), 0.05),
)


def description(position_deg: float = 180.0, **geometry: float) -> RobotDescription:
    """The textbook's example arm; all joints with the same symmetric range."""
    lengths = {name: value / 1000 for name, value in VECTORS["model"].items()} | geometry
    limits = JointLimits(
        position=np.radians([[-position_deg, position_deg]] * 6),
        velocity=np.full(6, 2.0),
        acceleration=np.full(6, 8.0),
        jerk=np.full(6, 60.0),
        ramp_factor=1.5,
    )
    return RobotDescription(
        name="example",
        family="six_axis",
        geometry=lengths,
        joint_names=("J1", "J2", "J3", "J4", "J5", "J6"),
        limits=limits,
        path=PathSpeeds(1.0, 4.0, 40.0, 2.0, 8.0, 80.0),
        home=np.zeros(6),
        capsules=CAPSULES,
    )


@cache
def arm(position_deg: float = 180.0) -> SixAxis:
    """Always the same one: to find how far it reaches takes longer than many a test."""
    return SixAxis(description(position_deg))


def with_tip() -> SixAxis:
    """The arm with a tool whose TCP is far beside all of its capsules."""
    tip = Tool(
        name="tip",
        pose_flange_tcp=from_xyz_abc(np.array([0.7, 0.3, -0.4, 0.2, -0.5, 1.1])),
        mass_kg=1.0,
        centre_m=(0.0, 0.0, 0.0),
        inertia_kg_m2=np.eye(3) * 0.01,
        capsules=(Capsule((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.04),),
    )
    return SixAxis(replace(description(), tools={"tip": tip}, mounted=Mounted(("tip",))))
