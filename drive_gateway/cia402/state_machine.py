"""The CiA 402 state machine as its master sees it: statusword to state, state and wish to controlword.

A controlword is sent in every cycle, as a function of the state that was read back and the state that is wanted. So
there is one transition at a time, and the next one waits until the drive has shown the state before it. Statusword
masks: CiA 402; numbers of transitions as there.
"""

from cell.messages.drives import AxisStatus

DISABLE_VOLTAGE = 0x0000
QUICK_STOP = 0x0002
SHUTDOWN = 0x0006
SWITCH_ON = 0x0007
ENABLE_OPERATION = 0x000F
INTERPOLATE = 1 << 4
"""Enable operation in interpolated position: set points are followed."""
FAULT_RESET = 0x0080

WARNING = 1 << 7
"""Bit 7 of the statusword: no fault, but something is near its limit or blocks one direction."""

FOLLOWS_COMMAND = 1 << 12
"""Bit 12 of the statusword in the modes in which blocks are played: set points are followed (modes 7 and 8)."""

REMOTE = 1 << 9
"""Bit 9 of the statusword: the drive obeys its controlword; without it somebody has it under local control."""

_VOLTAGE_ENABLED = 0x0010

_BY_MASK: tuple[tuple[int, int, AxisStatus], ...] = (
    (0x6F, 0x27, AxisStatus.OPERATION_ENABLED),
    (0x4F, 0x40, AxisStatus.SWITCH_ON_DISABLED),
    (0x6F, 0x21, AxisStatus.READY_TO_SWITCH_ON),
    (0x6F, 0x23, AxisStatus.SWITCHED_ON),
    (0x6F, 0x07, AxisStatus.QUICK_STOP_ACTIVE),
    (0x4F, 0x08, AxisStatus.FAULT),
    (0x4F, 0x00, AxisStatus.NOT_READY_TO_SWITCH_ON),
)


def decode(statusword: int) -> AxisStatus | None:
    """The state that a statusword shows; `None` for one of the patterns that no state has.

    Some drives show xx0x1111 both in the reaction to a fault and in the fault itself: voltage enabled (bit 4) tells,
    where it means the motor's voltage. Where it means the supply it stays set, and only time tells
    (`Drive.judge_reaction`).
    """
    return _STATES[statusword & 0x7F]


def _decode_low_bits(bits: int) -> AxisStatus | None:
    if bits & 0x4F == 0x0F:
        return AxisStatus.FAULT_REACTION_ACTIVE if bits & _VOLTAGE_ENABLED else AxisStatus.FAULT
    for mask, value, status in _BY_MASK:
        if bits & mask == value:
            return status
    return None


_STATES: tuple[AxisStatus | None, ...] = tuple(_decode_low_bits(bits) for bits in range(128))

_S = AxisStatus
_TO_OFF = {
    _S.OPERATION_ENABLED: SWITCH_ON,  # 5
    _S.SWITCHED_ON: SHUTDOWN,  # 6
    _S.READY_TO_SWITCH_ON: DISABLE_VOLTAGE,  # 7
    _S.QUICK_STOP_ACTIVE: DISABLE_VOLTAGE,  # 12
}
_TO_SWITCHED_ON = {
    _S.SWITCH_ON_DISABLED: SHUTDOWN,  # 2
    _S.READY_TO_SWITCH_ON: SWITCH_ON,  # 3
    _S.SWITCHED_ON: SWITCH_ON,
    _S.OPERATION_ENABLED: SWITCH_ON,  # 5
}
_TO_ENABLED = {
    _S.SWITCH_ON_DISABLED: SHUTDOWN,  # 2
    _S.READY_TO_SWITCH_ON: SWITCH_ON,  # 3
    _S.SWITCHED_ON: ENABLE_OPERATION,  # 4
    _S.OPERATION_ENABLED: ENABLE_OPERATION,
}
_TO_QUICK_STOP = {
    _S.OPERATION_ENABLED: QUICK_STOP,  # 11
    _S.QUICK_STOP_ACTIVE: QUICK_STOP,
    _S.SILENT: QUICK_STOP,
}
_TABLE = {
    _S.SWITCH_ON_DISABLED: _TO_OFF,
    _S.SWITCHED_ON: _TO_SWITCHED_ON,
    _S.OPERATION_ENABLED: _TO_ENABLED,
    _S.QUICK_STOP_ACTIVE: _TO_QUICK_STOP,
}


def controlword(status: AxisStatus, target: AxisStatus) -> int:
    """The command that takes a drive one transition nearer to `target`; where none does, voltage off (0000h).

    A fault is never left by this way (`FAULT_RESET` needs a rising edge and an operator), and Operation Enabled is
    never left by transition 9, which would let the motor run out. A silent drive that should stop is told to stop.

    Args:
        status: state read back.
        target: Switch On Disabled, Switched On, Operation Enabled or Quick Stop Active.
    """
    return _TABLE[target].get(status, DISABLE_VOLTAGE)
