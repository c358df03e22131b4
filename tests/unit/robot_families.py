"""A robot of each family, as the tests of kinematics share them; lengths are those of `tests/vectors/families.json`."""

from typing import Any

import numpy as np
import pytest

from cell.geometry import from_xyz_abc
from robot_agent.kinematics import Model, model_of
from robot_agent.model.description import CapsuleBody, JointLimits, PathSpeeds, RobotDescription, Tool
from robot_agent.model.families import FAMILIES, shape_of
from tests.unit.repository import vectors

VECTORS: dict[str, Any] = vectors("families.json")
CLOSED = tuple(name for name, family in FAMILIES.items() if family.shape is not None)
FOUR_AXES = ("scara", "palletizer", "delta")
KINDS = [(family, None) for family in CLOSED] + [("delta", 3)]
every_kind = pytest.mark.parametrize(
    ("family", "joints"), KINDS, ids=[f"{family}{joints or ''}" for family, joints in KINDS]
)
TORCH = Tool(
    "torch",
    from_xyz_abc(np.array([0.12, -0.096, 0.128, 0.4, -0.7, 1.1])),
    mass_kg=0.0,
    centre_m=(0.0, 0.0, 0.0),
    inertia_kg_m2=np.zeros((3, 3)),
    capsules=(),
)
"""Its TCP is 200 mm from the flange, and turned against it."""
TOOLS = {"torch": TORCH}
SLIDE_M = 0.6
"""Range of joints that slide, to either side."""


def described(family: str, joints: int | None = None, turn_deg: float = 180.0, **changed: Any) -> RobotDescription:
    """All joints with the same symmetric range; capsules on the first and the last links."""
    shape = shape_of(family)
    linear = shape.linear[:joints]
    n = len(linear)
    half = np.where(linear, SLIDE_M, np.radians(turn_deg))
    last = len(shape.links) - 1
    lengths = {name: value / 1000 for name, value in VECTORS[family]["model"].items()}
    values: dict[str, Any] = {
        "name": family,
        "family": family,
        "geometry": lengths,
        "joint_names": shape.joint_names(n),
        "limits": JointLimits(np.stack([-half, half], axis=-1), np.ones(n), np.ones(n), np.ones(n), 1.5),
        "path": PathSpeeds(1.0, 4.0, 40.0, 2.0, 8.0, 80.0),
        "home": np.zeros(n),
        "capsules": tuple(CapsuleBody(i, (0.0, 0.02, 0.0), (0.1, 0.0, 0.05), 0.05) for i in range(last + 1)),
        "linear": linear,
    }
    return RobotDescription(**(values | changed))


def robot(family: str, joints: int | None = None, turn_deg: float = 180.0, **changed: Any) -> Model:
    return model_of(described(family, joints, turn_deg, **changed))


def random_joints(family: str, count: int, joints: int | None = None, seed: int = 3) -> np.ndarray:
    """Joint sets `(count, n)` all over the range; those of a delta are ones in which it can be built."""
    rng = np.random.default_rng(seed)
    linear = np.array(shape_of(family).linear[:joints])
    q = rng.uniform(-np.pi, np.pi, (count, len(linear)))
    if family == "delta":
        q[:, :3] = np.radians(rng.uniform(-40, 80, (count, 3)))
    q[:, linear] = rng.uniform(-SLIDE_M, SLIDE_M, (count, linear.sum()))
    return q


def units(model: Model) -> np.ndarray:
    """Joints in mm and deg -> SI."""
    return np.where(model.linear, 1e-3, np.pi / 180)


def pose_of(mm_deg: list[float]) -> np.ndarray:
    return from_xyz_abc(np.append(np.array(mm_deg[:3]) / 1000, np.radians(mm_deg[3:])))


def off(model: Model, found: np.ndarray, expected: np.ndarray) -> np.ndarray:
    """Distance of joints, whole turns aside."""
    away = found - expected
    return abs(np.where(model.linear, away, away - 2 * np.pi * np.rint(away / (2 * np.pi))))
