"""The power state machine of a drive (CiA 402), from the drive's side: which controlword leads from where to where."""

from enum import Enum


class DriveState(Enum):
    """The states; each value is what the state shows in bits 0 to 3, 5 and 6 of the statusword."""

    NOT_READY_TO_SWITCH_ON = 0x00
    SWITCH_ON_DISABLED = 0x40
    READY_TO_SWITCH_ON = 0x21
    SWITCHED_ON = 0x23
    OPERATION_ENABLED = 0x27
    QUICK_STOP_ACTIVE = 0x07
    FAULT_REACTION_ACTIVE = 0x0F
    FAULT = 0x08


class Command(Enum):
    """What bits 0 to 3 of a controlword ask for."""

    DISABLE_VOLTAGE = "xx0x"
    QUICK_STOP = "x01x"
    SHUTDOWN = "x110"
    SWITCH_ON = "0111"
    ENABLE_OPERATION = "1111"


FAULT_RESET = 0x80
"""Bit 7 of the controlword; its rising edge acknowledges a fault."""

_S, _C = DriveState, Command
TRANSITIONS: dict[tuple[DriveState, Command], tuple[int, DriveState]] = {
    (_S.SWITCH_ON_DISABLED, _C.SHUTDOWN): (2, _S.READY_TO_SWITCH_ON),
    (_S.READY_TO_SWITCH_ON, _C.SWITCH_ON): (3, _S.SWITCHED_ON),
    (_S.READY_TO_SWITCH_ON, _C.ENABLE_OPERATION): (3, _S.SWITCHED_ON),
    (_S.READY_TO_SWITCH_ON, _C.QUICK_STOP): (7, _S.SWITCH_ON_DISABLED),
    (_S.READY_TO_SWITCH_ON, _C.DISABLE_VOLTAGE): (7, _S.SWITCH_ON_DISABLED),
    (_S.SWITCHED_ON, _C.ENABLE_OPERATION): (4, _S.OPERATION_ENABLED),
    (_S.SWITCHED_ON, _C.SHUTDOWN): (6, _S.READY_TO_SWITCH_ON),
    (_S.SWITCHED_ON, _C.QUICK_STOP): (10, _S.SWITCH_ON_DISABLED),
    (_S.SWITCHED_ON, _C.DISABLE_VOLTAGE): (10, _S.SWITCH_ON_DISABLED),
    (_S.OPERATION_ENABLED, _C.SWITCH_ON): (5, _S.SWITCHED_ON),
    (_S.OPERATION_ENABLED, _C.SHUTDOWN): (8, _S.READY_TO_SWITCH_ON),
    (_S.OPERATION_ENABLED, _C.DISABLE_VOLTAGE): (9, _S.SWITCH_ON_DISABLED),
    (_S.OPERATION_ENABLED, _C.QUICK_STOP): (11, _S.QUICK_STOP_ACTIVE),
    (_S.QUICK_STOP_ACTIVE, _C.DISABLE_VOLTAGE): (12, _S.SWITCH_ON_DISABLED),
    (_S.QUICK_STOP_ACTIVE, _C.ENABLE_OPERATION): (16, _S.OPERATION_ENABLED),
}
"""Number of the transition and next state. The others are the drive's own: 0, 1, 13, 14, and 15 by an edge."""


def command_of(controlword: int) -> Command:
    """The command in bits 0 to 3."""
    if not controlword & 0x02:
        return Command.DISABLE_VOLTAGE
    if not controlword & 0x04:
        return Command.QUICK_STOP
    if not controlword & 0x01:
        return Command.SHUTDOWN
    return Command.ENABLE_OPERATION if controlword & 0x08 else Command.SWITCH_ON


def commanded(state: DriveState, command: Command, stays: bool) -> DriveState:
    """The state that a command leads to; the same state when it leads nowhere.

    `stays`: the quick stop does not end by itself (605Ah = 5, 6 or 7); only then does transition 16 exist.
    """
    number, target = TRANSITIONS.get((state, command), (0, state))
    if number == 16 and not stays:
        return state
    return target
