"""Everything that is said on the cell's Zenoh keys, as frozen dataclasses, one file per sender.

Units are SI: metres, radians, seconds; poses and capsules are in the cell's world frame. A missing reading is `None`.
On which key a message travels stands above its class (`@state`, `@command`); how it becomes bytes is the business of
`cell.net.codec`.
"""

from cell.messages.call import COMMANDS, Call, ClaimGrant, Command, Reply, Who
from cell.messages.common import CellTime, Heard, Token, TokenGone
from cell.messages.correction import ConveyorCount, Correction
from cell.messages.drive_fault import Fault, FaultDrive
from cell.messages.drives import AxisStatus, DriveFeedback, PlayoutState
from cell.messages.estop import Estop
from cell.messages.event import Event, KeptEvent, KeptEvents, Severity
from cell.messages.frame import FramePose
from cell.messages.gateway_commands import (
    AcceptPosition,
    Claim,
    DisableDrives,
    EnableDrives,
    HoldSetup,
    Home,
    MoveAxes,
    PressAxis,
    ReadObject,
    RecordBus,
    Release,
    ResetDrives,
    ScanBus,
    SimulateInput,
    SwitchOutput,
    WriteObject,
)
from cell.messages.gateway_state import BusCounters, GatewayState, IoStatus, NodeStatus
from cell.messages.jog import JogFrame, JogHeld
from cell.messages.manager_commands import (
    AdoptZone,
    ClearSetup,
    ClearZone,
    ListEvents,
    PlaceFrame,
    ResetEstop,
    SetEstop,
    TeachFrame,
)
from cell.messages.manager_state import Deadlock, ManagerState, SetupStatus, ZoneState, ZoneStatus
from cell.messages.meeting import Arrival, Attendance, MeetingStatus, Meets
from cell.messages.presence import Body, Presence
from cell.messages.robot_commands import (
    AnswerFlag,
    Continue,
    Disable,
    Enable,
    Halt,
    Jog,
    ResetRobot,
    Return,
    Run,
    SetManual,
    SetOverride,
    SetPart,
    Step,
)
from cell.messages.robot_state import (
    ClockStatus,
    CorrectionStatus,
    GovernorStatus,
    Mode,
    PaceStatus,
    ProgramState,
    ProgramStatus,
    Reserve,
    RobotState,
)
from cell.messages.sections import Clearance, PlannedWay, Refusal, Sections, Way
from cell.messages.setpoints import OutputEvent, SetpointBlock
from cell.messages.state import STATES, Urgency
from cell.messages.zone import ZoneGeometry

__all__ = [
    "COMMANDS",
    "STATES",
    "AcceptPosition",
    "AdoptZone",
    "AnswerFlag",
    "Arrival",
    "Attendance",
    "AxisStatus",
    "Body",
    "BusCounters",
    "Call",
    "CellTime",
    "Claim",
    "ClaimGrant",
    "ClearSetup",
    "ClearZone",
    "Clearance",
    "ClockStatus",
    "Command",
    "Continue",
    "ConveyorCount",
    "Correction",
    "CorrectionStatus",
    "Deadlock",
    "Disable",
    "DisableDrives",
    "DriveFeedback",
    "Enable",
    "EnableDrives",
    "Estop",
    "Event",
    "Fault",
    "FaultDrive",
    "FramePose",
    "GatewayState",
    "GovernorStatus",
    "Halt",
    "Heard",
    "HoldSetup",
    "Home",
    "IoStatus",
    "Jog",
    "JogFrame",
    "JogHeld",
    "KeptEvent",
    "KeptEvents",
    "ListEvents",
    "ManagerState",
    "MeetingStatus",
    "Meets",
    "Mode",
    "MoveAxes",
    "NodeStatus",
    "OutputEvent",
    "PaceStatus",
    "PlaceFrame",
    "PlannedWay",
    "PlayoutState",
    "Presence",
    "PressAxis",
    "ProgramState",
    "ProgramStatus",
    "ReadObject",
    "RecordBus",
    "Refusal",
    "Release",
    "Reply",
    "Reserve",
    "ResetDrives",
    "ResetEstop",
    "ResetRobot",
    "Return",
    "RobotState",
    "Run",
    "ScanBus",
    "Sections",
    "SetEstop",
    "SetManual",
    "SetOverride",
    "SetPart",
    "SetpointBlock",
    "SetupStatus",
    "Severity",
    "SimulateInput",
    "Step",
    "SwitchOutput",
    "TeachFrame",
    "Token",
    "TokenGone",
    "Urgency",
    "Way",
    "Who",
    "WriteObject",
    "ZoneGeometry",
    "ZoneState",
    "ZoneStatus",
]
