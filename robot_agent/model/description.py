"""A robot file as the agent uses it: SI units, every default filled in."""

import math
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray


class ProfileKind(Enum):
    """How the way along a path grows with time."""

    S_CURVE = "s_curve"
    SINUSOIDAL = "sinusoidal"
    BEZIER = "bezier"
    TRAPEZOIDAL = "trapezoidal"
    QUINTIC = "quintic"


NO_TOOL = "none"
TOOL = "tool"
"""Where links are named: the body of the mounted tool, which is not the flange's."""
JERK_PER_ACCELERATION = 10.0
"""[1/s] A jerk limit that is not given is so many times the acceleration limit: full acceleration after 0.1 s."""


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
    acceleration_down: NDArray[np.float64] | None = None
    """`(n,)` towards lower values of each joint; None: as towards higher ones."""


@dataclass(frozen=True, slots=True)
class PathSpeeds:
    """Default and largest speeds along a path."""

    speed_m_s: float
    acceleration_m_s2: float
    jerk_m_s3: float
    angular_speed_rad_s: float
    angular_acceleration_rad_s2: float
    angular_jerk_rad_s3: float


@dataclass(frozen=True, slots=True)
class Shaping:
    """How motions are shaped beyond what the limits ask for."""

    profile: ProfileKind = ProfileKind.S_CURVE
    filter_s: float = 0.0
    """Window of the filter on every axis; 0: none."""
    blend_m: float = 1e-4
    """How far blending a step of the curvature may leave the programmed curve."""

    def __post_init__(self) -> None:
        if self.profile is ProfileKind.TRAPEZOIDAL and self.filter_s == 0.0:
            raise ValueError("a trapezoidal profile without a filter found, allowed with a filter: its jerk has no end")


DEFAULT_SHAPING = Shaping()


@dataclass(frozen=True, slots=True)
class CapsuleBody:
    """A capsule that moves with a link. Link 0 is the base, the last one the flange; points are in its frame."""

    link: int
    start_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    radius_m: float


@dataclass(frozen=True, slots=True)
class Capsule:
    """Everything within `radius_m` of the line from `start_m` to `end_m`."""

    start_m: tuple[float, float, float]
    end_m: tuple[float, float, float]
    radius_m: float


@dataclass(frozen=True, slots=True, eq=False)
class Tool:
    """What is mounted on a flange."""

    name: str
    pose_flange_tcp: NDArray[np.float64]
    """`(4, 4)`"""
    mass_kg: float
    centre_m: tuple[float, float, float]
    """Centre of mass in the flange frame."""
    inertia_kg_m2: NDArray[np.float64]
    """`(3, 3)` about the centre of mass, along the axes of the flange frame."""
    capsules: tuple[Capsule, ...]
    """Its body in the flange frame."""


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """What a gripper can hold, as it is held: everything in the TCP's frame, without a tool in that of the flange."""

    name: str
    mass_kg: float
    centre_m: tuple[float, float, float]
    """Centre of mass."""
    inertia_kg_m2: NDArray[np.float64]
    """`(3, 3)` about the centre of mass."""
    capsules: tuple[Capsule, ...]


@dataclass(frozen=True, slots=True, eq=False)
class LinkMass:
    """What a link weighs, and how. Links are numbered as in `CapsuleBody`; everything is in the link's frame."""

    link: int
    mass_kg: float
    centre_m: tuple[float, float, float]
    inertia_kg_m2: NDArray[np.float64]
    """`(3, 3)` about the centre of mass."""
    source: str
    """Where its numbers are from."""


@dataclass(frozen=True, slots=True)
class Motor:
    """A rotary servomotor and the gear to its axis; torques and speeds are the shaft's."""

    type: str
    source: str
    """Where its numbers are from."""
    gear: float
    """Motor turns per turn behind the gear."""
    feed_m: float | None
    """Way of a linear axis per turn behind the gear; None: the axis turns."""
    pole_pairs: int
    rated_speed_rpm: float
    maximum_speed_rpm: float
    rated_torque_nm: float
    peak_torque_nm: float
    torque_constant_nm_a: float
    """Per ampere rms."""
    inertia_kg_m2: float
    """Of the rotor, brake included."""

    @property
    def ratio(self) -> float:
        """Shaft [rad] per axis [rad or m]: axis torque [Nm], or force [N], per shaft torque."""
        return self.gear if self.feed_m is None else 2 * math.pi * self.gear / self.feed_m

    @property
    def fastest(self) -> float:
        """Speed of the axis [rad/s or m/s] at the maximum speed."""
        return self.maximum_speed_rpm * math.pi / (30 * self.ratio)

    @property
    def peak_current_a(self) -> float:
        """[A rms] at the peak torque."""
        return self.peak_torque_nm / self.torque_constant_nm_a

    def rpm(self, axis_speed: float) -> float:
        """Shaft speed at an axis speed [rad/s or m/s]."""
        return axis_speed * self.ratio * 30 / math.pi

    def rotor_torque_nm(self, axis_acceleration: float) -> float:
        """What the rotor alone takes at an axis acceleration [rad/s2 or m/s2]."""
        return self.inertia_kg_m2 * self.ratio * axis_acceleration


@dataclass(frozen=True, slots=True)
class UrdfSource:
    """Where the chain of a robot of family `urdf` comes from."""

    file: Path
    flange: str | None = None
    """The link that is the flange; None: the only link without a child."""


@dataclass(frozen=True, slots=True)
class Apart:
    """How the links of one robot keep away from each other."""

    margin_m: float = 0.0
    may_touch: tuple[tuple[str, str], ...] = ()
    """Pairs of links, of a link and `TOOL`, or of a link and a part, that are not kept apart."""


ALL_APART = Apart()


@dataclass(frozen=True, slots=True)
class Mounted:
    """What a robot carries at its flange. Several of a kind where it may be any of them: the body has all of these."""

    tools: tuple[str, ...] = ()
    """The mounted tool."""
    parts: tuple[str, ...] = ()
    """The part that it holds."""


NOTHING = Mounted()


@dataclass(frozen=True, slots=True, eq=False)
class RobotDescription:
    """One robot model. `geometry` holds the family's named lengths [m]."""

    name: str
    family: str
    """Its name in the register (`robot_agent.model.families`)."""
    geometry: dict[str, float]
    joint_names: tuple[str, ...]
    limits: JointLimits
    path: PathSpeeds
    home: NDArray[np.float64]
    """`(n,)` joints of the home position."""
    capsules: tuple[CapsuleBody, ...]
    linear: tuple[bool, ...] = ()
    """Whether each joint slides; empty when all joints turn."""
    coupling: NDArray[np.float64] | None = None
    """`(n, n)` joints per axis, lower triangular: joints = coupling @ axes. None: each joint is its own axis."""
    tools: dict[str, Tool] = field(default_factory=dict)
    parts: dict[str, Part] = field(default_factory=dict)
    """What the robot can hold."""
    mounted: Mounted = NOTHING
    urdf: UrdfSource | None = None
    motors: dict[str, Motor] = field(default_factory=dict)
    """By axis; empty where the file says nothing about motors."""
    masses: tuple[LinkMass, ...] = ()
    """Of the links; empty where the file says nothing about them. Those of a URDF robot are in its URDF."""
    shaping: Shaping = DEFAULT_SHAPING
    apart: Apart = ALL_APART

    @property
    def tool(self) -> Tool | None:
        """The mounted tool; None for none, and where it may be any of several."""
        return self.tools[self.mounted.tools[0]] if len(self.mounted.tools) == 1 else None

    @property
    def poses_flange_tcp(self) -> tuple[NDArray[np.float64], ...]:
        """Each `(4, 4)`: where the TCP may be, by which tool is mounted."""
        poses = tuple(self.tools[name].pose_flange_tcp for name in self.mounted.tools)
        return poses if len(poses) == 1 else (*poses, np.eye(4))

    @property
    def pose_flange_tcp(self) -> NDArray[np.float64]:
        """`(4, 4)`; without a tool the TCP is the flange."""
        return np.eye(4) if self.tool is None else self.tool.pose_flange_tcp
