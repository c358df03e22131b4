"""What an agent tells everyone about its robot."""

from dataclasses import dataclass, field
from enum import Enum
from typing import Annotated

from annotated_types import Ge, Le

from cell.messages.common import ClockStatus, Count, Duration, Few, Length, Name, Number, Text, Vector, Words
from cell.messages.state import state


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
    """An operator's jog key is held, or the robot comes to rest after it."""
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

    name: Text
    state: ProgramState
    line: Count
    text: Text
    error: Text = ""
    planned_to: Count = 0
    """Line of the newest move that is planned, or being planned; 0 for none."""
    variables: Annotated[dict[Name, Number], Few] = field(default_factory=dict)
    """Those that are set, as far as the program is interpreted, which is ahead of the motion."""
    flag: Count | None = None
    """Of the `M` at which the program waits until somebody answers it."""
    waits_s: Duration | None = None
    """How long it has waited at the present WAIT DI, M or IF, without the time that it was halted; None elsewhere."""
    raised: Annotated[dict[Name, Count], Few] = field(default_factory=dict)
    """Flag of `M n ASYNC`: how often it was raised since the program began."""
    planned_in: Text = ""
    """The file of the line `planned_to`; empty for none."""


@dataclass(frozen=True, slots=True)
class GovernorStatus:
    """How fast path time advances and who rules; `ruled_by` is empty when nobody asks for less than the plan."""

    rate: Number
    tau_s: Number
    duration_s: Duration
    ruled_by: Text


@dataclass(frozen=True, slots=True)
class PaceStatus:
    """What an operator has set: share of the planned speed (-1 to 1), reduced speed, and going block by block."""

    override: Annotated[float, Ge(-1.0), Le(1.0)] = 1.0
    manual: bool = False
    stepping: bool = False


@dataclass(frozen=True, slots=True)
class CorrectionStatus:
    """What the program follows, and how far that is from the programmed path at present, in the axes of the sensor."""

    name: Name
    offset_m: Vector
    turn_rad: Vector
    """Rotation vector."""


@dataclass(frozen=True, slots=True)
class Reserve:
    """How much motion is left where the robot is."""

    singular: Text
    """The singularity that is nearest."""
    from_singular: Annotated[float, Ge(0.0), Le(1.0)]
    """How far it is from that: 0 is singular, 1 the farthest."""
    manipulability: Number
    """Product of the singular values of the Jacobian of the flange, in m and rad; of six axes |det J|."""
    joint: Name
    """The joint that is nearest to one of its limits, as a share of its range."""
    from_limit: Number
    """How far it is from that limit [rad or m]; below zero beyond it."""


@dataclass(frozen=True, slots=True)
class MoveStatus:
    """The move of the program that the robot is on: how long it is, how much of that is done, and where it ends."""

    length_m: Length
    """Way of the TCP, without a tool of the flange; also of a joint move."""
    done_m: Length
    duration_s: Duration
    """As planned, without an override, a hold or a wait."""
    done_s: Duration
    target_joints: Annotated[tuple[Number, ...], Few]
    """[rad or m]"""
    target_position_m: Vector
    """Of the TCP in world; where a corner is rounded, in its middle. What is followed leads beside it."""
    target_quaternion_xyzw: tuple[Number, Number, Number, Number]


@dataclass(frozen=True, slots=True)
class ParameterStatus:
    """A parameter that an operator has set."""

    value: Number
    unit: Name
    by: Words
    since_s: Duration
    """So long ago."""


@dataclass(frozen=True, slots=True)
class VirtualStatus:
    """A program that runs without its robot, told as `RobotState` tells one that moves it: a picture."""

    mode: Mode
    """Running or halted, like `program` that of the picture."""
    program: ProgramStatus
    joints: Annotated[tuple[Number, ...], Few] | None
    tcp_position_m: Vector | None
    tcp_quaternion_xyzw: tuple[Number, Number, Number, Number] | None
    tcp_speed_m_s: Number | None
    governor: GovernorStatus | None
    move: MoveStatus | None = None
    pace: PaceStatus = PaceStatus()
    waiting_for: Text = ""
    outputs: Annotated[dict[Name, bool], Few] = field(default_factory=dict)
    """What the robot's outputs would be; none of them is switched."""
    tool: Name | None = ""
    part: Name | None = ""


@state("robot/{robot}/state")
@dataclass(frozen=True, slots=True)
class RobotState:
    """The robot as its agent knows it, at about 50 Hz."""

    robot: Name
    boot: Name
    sequence: Count
    mode: Mode
    program: ProgramStatus
    joints: Annotated[tuple[Number, ...], Few] | None
    """Measured joints [rad or m]."""
    tcp_position_m: Vector | None
    """Measured place of the TCP of the mounted tool in world; without a tool, of the flange."""
    tcp_quaternion_xyzw: tuple[Number, Number, Number, Number] | None
    tcp_speed_m_s: Number | None
    """Commanded speed of the TCP."""
    governor: GovernorStatus | None
    pace: PaceStatus = PaceStatus()
    zones: Annotated[tuple[Name, ...], Few] = ()
    """Zones held."""
    waiting_for: Text = ""
    """Why the robot does not move although its program runs, or jogs slower than wished; for people."""
    waited_s: Annotated[dict[Name, Duration], Few] = field(default_factory=dict)
    """Zone: time spent at rest waiting for it since the program started."""
    alarms: Annotated[tuple[Text, ...], Few] = ()
    correction: CorrectionStatus | None = None
    frames: Annotated[dict[Name, Count], Few] = field(default_factory=dict)
    """Frame in which a thing stands: the version by which the next motions are planned."""
    reserve: Reserve | None = None
    tool: Name | None = ""
    """The mounted tool, of its robot file, empty for none; None where nobody has said it yet."""
    part: Name | None = ""
    """What the robot holds: a part of its robot file, empty for none; None where nobody has said it yet."""
    forced: Annotated[dict[Name, bool], Few] = field(default_factory=dict)
    """Input that an operator has forced: what programs of this robot see of it, on or off."""
    clock: ClockStatus | None = None
    """None before a manager's state has answered this agent."""
    move: MoveStatus | None = None
    """None where no program runs or is halted."""
    parameters: Annotated[dict[Name, ParameterStatus], Few] = field(default_factory=dict)
    """Those that an operator has set since the agent was started; the others are as the files say."""
    virtual: VirtualStatus | None = None
    """The picture of a virtual run while there is one; all else here is about the robot itself."""
