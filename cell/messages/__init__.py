"""Everything that is said on the cell's Zenoh keys, as frozen dataclasses, one file per sender.

Units are SI: metres, radians, seconds; poses and capsules are in the cell's world frame. A missing reading is `None`.
How a message becomes bytes is the business of `cell.net.codec`; on which key it travels, of `cell.net.keys`.
"""

from cell.messages.commands import (
    AcceptPosition,
    AdoptZone,
    Call,
    Claim,
    ClaimGrant,
    ClearZone,
    Command,
    Continue,
    Disable,
    DisableDrives,
    Enable,
    EnableDrives,
    Halt,
    HoldSetup,
    Home,
    Jog,
    MoveAxes,
    ReadObject,
    RecordBus,
    Release,
    Reply,
    ResetDrives,
    ResetEstop,
    ResetRobot,
    Run,
    ScanBus,
    SetEstop,
    SetManual,
    SetOverride,
    Step,
    Who,
    WriteObject,
)
from cell.messages.common import CellTime, Heard, Token, TokenGone
from cell.messages.correction import ConveyorCount, Correction
from cell.messages.drives import AxisStatus, DriveFeedback, PlayoutState
from cell.messages.estop import Estop
from cell.messages.event import Event, Severity
from cell.messages.gateway_state import BusCounters, GatewayState, NodeStatus
from cell.messages.jog import JogFrame, JogHeld
from cell.messages.manager_state import ManagerState, ZoneState, ZoneStatus
from cell.messages.presence import Body, Presence
from cell.messages.robot_state import GovernorStatus, Mode, PaceStatus, ProgramState, ProgramStatus, RobotState
from cell.messages.setpoints import SetpointBlock
from cell.messages.zone import ZoneGeometry

__all__ = [
    "AcceptPosition",
    "AdoptZone",
    "AxisStatus",
    "Body",
    "BusCounters",
    "Call",
    "CellTime",
    "Claim",
    "ClaimGrant",
    "ClearZone",
    "Command",
    "Continue",
    "ConveyorCount",
    "Correction",
    "Disable",
    "DisableDrives",
    "DriveFeedback",
    "Enable",
    "EnableDrives",
    "Estop",
    "Event",
    "GatewayState",
    "GovernorStatus",
    "Halt",
    "Heard",
    "HoldSetup",
    "Home",
    "Jog",
    "JogFrame",
    "JogHeld",
    "ManagerState",
    "Mode",
    "MoveAxes",
    "NodeStatus",
    "PaceStatus",
    "PlayoutState",
    "Presence",
    "ProgramState",
    "ProgramStatus",
    "ReadObject",
    "RecordBus",
    "Release",
    "Reply",
    "ResetDrives",
    "ResetEstop",
    "ResetRobot",
    "RobotState",
    "Run",
    "ScanBus",
    "SetEstop",
    "SetManual",
    "SetOverride",
    "SetpointBlock",
    "Severity",
    "Step",
    "Token",
    "TokenGone",
    "Who",
    "WriteObject",
    "ZoneGeometry",
    "ZoneState",
    "ZoneStatus",
]
