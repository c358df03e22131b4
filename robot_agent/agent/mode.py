"""The mode of a robot and all that changes it: one table (docs/architecture.md, section 4.3)."""

from enum import Enum

from cell.messages import Mode


class ModeEvent(Enum):
    """What happens to a robot. The value says it in words."""

    ESTOP = "an emergency stop is in force"
    FAULT = "its drives have a fault, were switched off by themselves, or are not heard"
    CLAIM_LOST = "its claim on the gateway is over"
    CLEARED = "no emergency stop is in force any more"
    ACKNOWLEDGED = "an operator has acknowledged the fault"
    HEARD = "its drives are heard under a claim"
    ENABLE = "the gateway is asked to switch the drives on"
    NOT_ENABLED = "the gateway has refused that"
    DISABLE = "the gateway is asked to switch the drives off"
    DISABLED = "they are off as was asked"
    FREE = "its drives are on, nothing moves it, and no program is interrupted"
    ON_PATH = "the same, and it stands within the window of its interrupted program's path"
    BESIDE_PATH = "the same, and it stands farther away"
    FORGOTTEN = "the interrupted program cannot go on any more, or an operator has ended it"
    RUN = "a program begins"
    PROGRAM_ENDED = "the program is done, has failed, or was stopped"
    HALT = "the program brakes on its path: a call, a step that is done, a set-up, what it follows is lost"
    CONTINUE = "the halted program goes on"
    GO_BACK = "the way back to the path begins"
    RETURNED = "it is back on its path, and halted there"
    RETURNED_TO_GO_ON = "it is back on its path, and goes on"
    JOG = "an operator holds a jog key"
    JOG_ENDED = "the jog has come to rest"


_ALL = tuple(Mode)
_STANDING = (Mode.READY, Mode.HALTED, Mode.OFF_PATH)
_MOVING = (Mode.RUNNING, Mode.RETURNING, Mode.JOGGING)
_WITH_TORQUE = (*_STANDING, *_MOVING)
_LEFT_ALONE = (Mode.DISABLED, Mode.ENABLING, Mode.READY, Mode.RETURNING)

_RULES: tuple[tuple[ModeEvent, tuple[Mode, ...], Mode], ...] = (
    (ModeEvent.ESTOP, _ALL, Mode.ESTOP),
    (ModeEvent.FAULT, _ALL, Mode.FAULT),
    (ModeEvent.CLAIM_LOST, tuple(mode for mode in _ALL if mode is not Mode.FAULT), Mode.STARTING),
    (ModeEvent.CLEARED, (Mode.ESTOP,), Mode.DISABLED),
    (ModeEvent.ACKNOWLEDGED, (Mode.FAULT,), Mode.DISABLED),
    (ModeEvent.HEARD, (Mode.STARTING,), Mode.DISABLED),
    (ModeEvent.ENABLE, (Mode.DISABLED,), Mode.ENABLING),
    (ModeEvent.NOT_ENABLED, (Mode.ENABLING,), Mode.DISABLED),
    (ModeEvent.DISABLE, _STANDING, Mode.READY),
    (ModeEvent.DISABLED, (*_WITH_TORQUE, Mode.ENABLING), Mode.DISABLED),
    (ModeEvent.FREE, _LEFT_ALONE, Mode.READY),
    (ModeEvent.ON_PATH, _LEFT_ALONE, Mode.HALTED),
    (ModeEvent.BESIDE_PATH, (*_LEFT_ALONE, Mode.HALTED), Mode.OFF_PATH),
    (ModeEvent.FORGOTTEN, (Mode.HALTED, Mode.OFF_PATH, Mode.RETURNING), Mode.READY),
    (ModeEvent.RUN, _STANDING, Mode.RUNNING),
    (ModeEvent.PROGRAM_ENDED, (Mode.RUNNING,), Mode.READY),
    (ModeEvent.HALT, (Mode.RUNNING,), Mode.HALTED),
    (ModeEvent.CONTINUE, (Mode.HALTED,), Mode.RUNNING),
    (ModeEvent.GO_BACK, (Mode.HALTED, Mode.OFF_PATH), Mode.RETURNING),
    (ModeEvent.RETURNED, (Mode.RETURNING,), Mode.HALTED),
    (ModeEvent.RETURNED_TO_GO_ON, (Mode.RETURNING,), Mode.RUNNING),
    (ModeEvent.JOG, _STANDING, Mode.JOGGING),
    (ModeEvent.JOG_ENDED, (Mode.JOGGING,), Mode.READY),
)
TABLE: dict[tuple[Mode, ModeEvent], Mode] = {(mode, event): then for event, modes, then in _RULES for mode in modes}
"""What is not in it changes nothing."""


def after(mode: Mode, event: ModeEvent) -> Mode:
    """The mode of a robot in `mode` once this happens to it."""
    return TABLE.get((mode, event), mode)


def has_torque(mode: Mode) -> bool:
    """Whether the drives of a robot in this mode hold or move it."""
    return mode in _WITH_TORQUE


def moves(mode: Mode) -> bool:
    """By its program, back to its path, or by a key; in all other modes it stands or brakes."""
    return mode in _MOVING


def stands(mode: Mode) -> bool:
    """Enabled, and moved by nobody."""
    return mode in _STANDING


def stopped(mode: Mode) -> bool:
    """An operator has to end an emergency stop, or to acknowledge a fault, before anything moves again."""
    return mode in (Mode.ESTOP, Mode.FAULT)
