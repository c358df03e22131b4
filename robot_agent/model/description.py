"""A robot file as the agent uses it: SI units, every default filled in."""

from dataclasses import dataclass
from enum import Enum

import numpy as np
from numpy.typing import NDArray


class Family(Enum):
    """Kinematic families; each has its own closed form."""

    SIX_AXIS = "six_axis"


@dataclass(frozen=True, slots=True, eq=False)
class JointLimits:
    """Limits per joint, SI. `ramp_factor` times acceleration and jerk is what a braking ramp may use (section 5.2)."""

    position: NDArray[np.float64]
    """`(n, 2)` lower and upper [rad or m]."""
    velocity: NDArray[np.float64]
    """`(n,)` [rad/s or m/s]."""
    acceleration: NDArray[np.float64]
    jerk: NDArray[np.float64]
    ramp_factor: float


@dataclass(frozen=True, slots=True)
class PathLimits:
    """Default and largest speeds along a path."""

    speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    angular_speed_rad_s: float
    angular_acceleration_rad_s2: float
    angular_jerk_rad_s3: float


@dataclass(frozen=True, slots=True)
class CapsuleBody:
    """A capsule that moves with a link. Link 0 is the base, link `n` the flange; points are in that link's frame."""

    link: int
    start_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    radius_m: float


@dataclass(frozen=True, slots=True, eq=False)
class RobotDescription:
    """One robot model. `geometry` holds the family's named lengths [m]."""

    name: str
    family: Family
    geometry: dict[str, float]
    joint_names: tuple[str, ...]
    limits: JointLimits
    path: PathLimits
    home: NDArray[np.float64]
    """`(n,)` joints of the home position."""
    capsules: tuple[CapsuleBody, ...]
