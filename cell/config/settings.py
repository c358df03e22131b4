"""The cell file as the processes use it: SI units, absolute paths, every default filled in."""

import math
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path
from typing import Self

import numpy as np

from cell.geometry import SpaceOf, pose_from, quaternion
from cell.geometry.arrays import Array

Points = tuple[tuple[float, float, float], ...]
"""Measured points [m]."""


class OnManagerReturn(Enum):
    """What a robot does that stopped on its path because the manager fell silent, once the manager is back."""

    CONTINUE = "continue"
    OPERATOR = "operator"


class MountedAtStart(Enum):
    """What is known of tool and part when the agent of a robot starts whose program changes them."""

    ASK = "ask"
    AS_DESCRIBED = "as_described"
    """The tool of the cell file or the robot file and no part: somebody sees to that before each start."""


@dataclass(frozen=True, slots=True)
class PoseSettings:
    """A pose, in world where nothing else is said: position [m] and orientation as quaternion (x, y, z, w)."""

    position_m: tuple[float, float, float]
    quaternion_xyzw: tuple[float, float, float, float]

    @classmethod
    def of(cls, pose: Array) -> Self:
        """Of a matrix `(4, 4)`."""
        x, y, z = pose[:3, 3].tolist()
        qx, qy, qz, qw = quaternion.from_matrix(pose[:3, :3]).tolist()
        return cls((x, y, z), (qx, qy, qz, qw))

    def matrix(self) -> Array:
        """As matrix `(4, 4)`."""
        return pose_from(np.array(self.position_m), np.array(self.quaternion_xyzw))


@dataclass(frozen=True, slots=True)
class FrameSettings:
    """A frame of the cell: its pose in world by the cell file; the manager says where it is now."""

    name: str
    parent: str | None
    """The frame in which the file gives it; `None`: world."""
    pose: PoseSettings
    fixed: tuple[str, ...] = ()
    """What stands in it, or in a frame that lies in it, and must not move while the cell runs; for people."""


@dataclass(frozen=True, slots=True)
class InFrame:
    """A pose that is given in a frame."""

    frame: str
    pose: PoseSettings
    """In that frame."""


class SensorFrame(Enum):
    """In whose axes a sensor measures."""

    BASE = "base"
    TOOL = "tool"


@dataclass(frozen=True, slots=True)
class ConveyorSettings:
    """A belt that runs along X of `pose`, and its encoder."""

    name: str
    pose: PoseSettings
    counts_per_metre: float
    largest_speed_m_s: float
    parts: bool = False
    """Parts are told: who follows the belt waits for the next one."""


@dataclass(frozen=True, slots=True)
class CorrectionSettings:
    """What a robot may follow on its path, and how far: exactly one of `sensor` and `conveyor`."""

    name: str
    sensor: SensorFrame | None
    conveyor: ConveyorSettings | None
    largest_m: float
    largest_turn_rad: float
    """0: this sensor measures no turns."""
    settle_s: float
    fresh_s: float
    """Older measurements stop the robot."""
    speed_m_s: float
    """How fast the correction approaches what is measured."""
    acceleration_m_s2: float


@dataclass(frozen=True, slots=True)
class BoxShape:
    """Edge lengths [m]; the pose is in its middle."""

    size_m: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class HullShape:
    """All that points span, [m] in the axes of the pose."""

    points_m: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class SphereShape:
    """A ball about its pose."""

    radius_m: float


@dataclass(frozen=True, slots=True)
class CylinderShape:
    """A round column about Z; the pose is in its middle."""

    radius_m: float
    length_m: float


@dataclass(frozen=True, slots=True)
class HalfSpaceShape:
    """All below the plane Z = 0 of its pose."""


@dataclass(frozen=True, slots=True)
class MeshShape:
    """Triangles of an STL or OBJ file in whose numbers 1 is `unit_m`."""

    file: Path
    unit_m: float


Shape = BoxShape | HullShape | SphereShape | CylinderShape | HalfSpaceShape | MeshShape


@dataclass(frozen=True, slots=True)
class ThingSettings:
    """Something that stands in the cell."""

    name: str
    shape: Shape
    pose: PoseSettings
    margin_m: float
    """Nearer no robot comes."""
    may_touch: dict[str, tuple[str, ...]]
    """By robot the names of links that are not kept away."""
    in_frame: InFrame | None = None
    """Where it stands in a frame; `pose` is where that is by the cell file, while the manager may have moved it."""


class SpaceKind(Enum):
    """What a space is for."""

    SAFE = "safe"
    FORBIDDEN = "forbidden"
    SLOW = "slow"


@dataclass(frozen=True, slots=True)
class SpaceSettings:
    """A space of one robot: it stays inside the safe ones, out of forbidden ones, and is slow in slow ones."""

    name: str
    kind: SpaceKind
    shape: Shape
    pose: PoseSettings
    margin_m: float
    of: SpaceOf = SpaceOf.BODY
    by_program: bool = False
    """Programs switch it."""
    off_while: str | None = None
    """It is off while this input is known to be closed."""
    speed_m_s: float | None = None
    """Of the TCP in a slow space."""


@dataclass(frozen=True, slots=True)
class OrientationSettings:
    """Where the tool may point: an axis of the TCP's frame within a cone about a direction in world."""

    axis: int
    """0, 1, 2: X, Y, Z."""
    towards: tuple[float, float, float]
    """Of length 1."""
    within_rad: float


@dataclass(frozen=True, slots=True)
class JointRange:
    """The same two numbers of the cell file for a joint that turns and for one that slides."""

    turn_rad: tuple[float, float]
    slide_m: tuple[float, float]


@dataclass(frozen=True, slots=True)
class PathWindow:
    """How far each joint of a stopped robot may be from its path, so that its program goes on without a return."""

    turn_rad: float = math.radians(0.5)
    slide_m: float = 0.001


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """One robot of the cell: which model, on which gateway, where it stands, what it runs."""

    name: str
    model: Path
    gateway: str
    base: PoseSettings
    program: Path
    corrections: dict[str, CorrectionSettings] = field(default_factory=dict)
    path_window: PathWindow = PathWindow()
    things: tuple[ThingSettings, ...] = ()
    """All that stands in the cell."""
    spaces: tuple[SpaceSettings, ...] = ()
    orientation: OrientationSettings | None = None
    joints: dict[str, JointRange] = field(default_factory=dict)
    """Ranges by joint, narrower than those of the model."""
    kept_apart: bool = False
    """The cell keeps its robots apart wherever they are."""
    points: Path = Path("points.yaml")
    """What it was taught; the file need not be there."""
    mounted_at_start: MountedAtStart = MountedAtStart.ASK
    tool: str | None = None
    """On its flange when its agent starts; None: what its model says."""

    @property
    def program_spaces(self) -> frozenset[str]:
        """The spaces that SPACE in its program may name."""
        return frozenset(space.name for space in self.spaces if space.by_program)


@dataclass(frozen=True, slots=True)
class GatewayEndpoint:
    """One gateway: where it listens and which file describes its bus and drives."""

    name: str
    endpoint: str
    drives: Path


@dataclass(frozen=True, slots=True)
class ZoneSettings:
    """An exclusive zone: a solid and the robots that may ask for it."""

    name: str
    size_m: tuple[float, ...]
    """The lengths of its shape."""
    pose: PoseSettings
    robots: tuple[str, ...]
    shape: str = "box"
    """Its word in `cell.geometry.MEASURED`."""
    of: SpaceOf = SpaceOf.BODY
    """What of a robot is inside."""
    priority: dict[str, int] = field(default_factory=dict)
    """By robot, before how many others that wait it goes; 0 where none is given."""
    in_frame: InFrame | None = None
    """Its pose as the file gives it; None: in world."""


@dataclass(frozen=True, slots=True)
class PairMargin:
    """How far two robots keep apart."""

    robots: tuple[str, str]
    margin_m: float


@dataclass(frozen=True, slots=True)
class SeparationSettings:
    """How far the robots of a cell keep apart, wherever they are (`docs/architecture.md`, section 4.5)."""

    margin_m: float
    pairs: tuple[PairMargin, ...] = ()
    """Where it is another margin."""

    def margin_of(self, one: str, other: str) -> float:
        """Of two robots [m]."""
        return next((pair.margin_m for pair in self.pairs if set(pair.robots) == {one, other}), self.margin_m)


@dataclass(frozen=True, slots=True)
class Times:
    """Deadlines of `docs/architecture.md`, section 6 [s]."""

    fresh_s: float = 0.25
    """Age limit, by echo, of a presence and of a manager state."""
    command_s: float = 0.5
    """Age limit, by echo, of an operator's call."""
    nominal_s: float = 0.12
    """Length of the nominal part of a set-point block, before its ramp."""
    lead_s: float = 0.032
    """How far ahead of the feedback's tick a new block joins."""
    feedback_lost_s: float = 0.25
    """Silence of drive feedback that is a fault."""
    owner_silent_s: float = 0.5
    """Silence of set-point blocks, at rest, that ends a claim."""
    estop_delay_s: float = 2.0
    """From a software emergency stop to the gateway's own quick stop of a robot that is not at rest by then."""
    clock_error_s: float = 0.05
    """A robot that knows cell time less well begins nothing at a common moment."""
    idle_off_s: float | None = None
    """A robot that has had no program for so long is switched off; `None`: it stays on."""

    @property
    def moves_alone_s(self) -> float:
        """A robot that has been silent for longer is at rest [s], if it has an agent of the cell.

        That relies on the manager for at most `fresh_s` after it was heard last; what it has sent by then ends after
        the nominal part of a block and the longest ramp.
        """
        return self.fresh_s + self.nominal_s + self.estop_delay_s


@dataclass(frozen=True, slots=True)
class CellSettings:
    """A whole cell. `digest` is the same on two hosts exactly when their configurations mean the same."""

    name: str
    file: Path
    manager_endpoint: str
    robots: dict[str, RobotSettings]
    gateways: dict[str, GatewayEndpoint]
    zones: dict[str, ZoneSettings]
    times: Times
    on_manager_return: OnManagerReturn
    digest: str
    conveyors: dict[str, ConveyorSettings] = field(default_factory=dict)
    frames: dict[str, FrameSettings] = field(default_factory=dict)
    separation: SeparationSettings | None = None
    """None: zones alone keep robots apart."""
    meetings: dict[str, tuple[str, ...]] = field(default_factory=dict)
    """By name, the robots that meet."""
    variables: dict[str, str] = field(default_factory=dict)
    """Of the cell: by name, the robot whose programs set it."""

    def meetings_of(self, robot: str) -> frozenset[str]:
        """The meetings that MEET in a robot's program may name."""
        return frozenset(name for name, robots in self.meetings.items() if robot in robots)
