"""What an agent tells everyone about its robot."""

from dataclasses import dataclass, field
from enum import Enum


class Mode(Enum):
    """What the agent can do at the moment."""

    STARTING = "starting"
    """No claim on the gateway yet, or no drive feedback."""
    DISABLED = "disabled"
    """Claimed; the drives have no torque, the command follows the measured position."""
    ENABLING = "enabling"
    READY = "ready"
    """Enabled, at rest, no program running."""
    RUNNING = "running"
    HALTED = "halted"
    """The program is stopped on its path, or no farther from it than its window, and waits for `continue`."""
    OFF_PATH = "off_path"
    """Enabled, at rest, an interrupted program's path farther away than its window: `return`, or start anew."""
    RETURNING = "returning"
    """Slowly on the way back to the path, or coming to rest on it."""
    JOGGING = "jogging"
    """An operator's jog key is held, or the robot comes to rest behind it."""
    FAULT = "fault"
    ESTOP = "estop"


class ProgramState(Enum):
    NONE = "none"
    LOADED = "loaded"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    INTERRUPTED = "interrupted"
    """By a fault, an emergency stop or drives switched off; it may go on once the robot is on its path again."""


@dataclass(frozen=True, slots=True)
class ProgramStatus:
    """The program, the line being executed and its text. `line` counts from 1; 0 means not started."""

    name: str
    state: ProgramState
    line: int
    text: str
    error: str = ""


@dataclass(frozen=True, slots=True)
class GovernorStatus:
    """How fast path time advances and who rules; `ruled_by` is empty when nobody asks for less than the plan."""

    rate: float
    tau_s: float
    duration_s: float
    ruled_by: str


@dataclass(frozen=True, slots=True)
class PaceStatus:
    """What an operator has set: share of the planned speed (-1 to 1), reduced speed, and going block by block."""

    override: float = 1.0
    manual: bool = False
    stepping: bool = False


@dataclass(frozen=True, slots=True)
class CorrectionStatus:
    """What the program follows, and how far that is from the programmed path at present, in the axes of the sensor."""

    name: str
    offset_m: tuple[float, float, float]
    turn_rad: tuple[float, float, float]
    """Rotation vector."""


@dataclass(frozen=True, slots=True)
class RobotState:
    """The robot as its agent knows it, at about 50 Hz."""

    robot: str
    boot: str
    sequence: int
    mode: Mode
    program: ProgramStatus
    joints: tuple[float, ...] | None
    """Measured joints [rad or m]."""
    tcp_position_m: tuple[float, float, float] | None
    """Measured flange or tool centre point in world."""
    tcp_quaternion_xyzw: tuple[float, float, float, float] | None
    tcp_speed_m_s: float | None
    """Commanded speed of the TCP."""
    governor: GovernorStatus | None
    pace: PaceStatus = PaceStatus()
    zones: tuple[str, ...] = ()
    """Zones held."""
    waiting_for: str = ""
    """Why the robot does not move although its program runs, or jogs slower than wished; for people."""
    waited_s: dict[str, float] = field(default_factory=dict)
    """Zone: time spent at rest waiting for it since the program started."""
    alarms: tuple[str, ...] = ()
    correction: CorrectionStatus | None = None
