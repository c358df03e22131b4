"""The mode of a robot and all that changes it: one table (docs/architecture.md, section 4.3)."""

from enum import Enum

from cell.messages import Mode


class Event(Enum):
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
    FORGOTTEN = "the interrupted program cannot go on any more"
    RUN = "a program begins"
    PROGRAM_ENDED = "the program is done, or has failed"
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

_RULES: tuple[tuple[Event, tuple[Mode, ...], Mode], ...] = (
    (Event.ESTOP, _ALL, Mode.ESTOP),
    (Event.FAULT, _ALL, Mode.FAULT),
    (Event.CLAIM_LOST, tuple(mode for mode in _ALL if mode is not Mode.FAULT), Mode.STARTING),
    (Event.CLEARED, (Mode.ESTOP,), Mode.DISABLED),
    (Event.ACKNOWLEDGED, (Mode.FAULT,), Mode.DISABLED),
    (Event.HEARD, (Mode.STARTING,), Mode.DISABLED),
    (Event.ENABLE, (Mode.DISABLED,), Mode.ENABLING),
    (Event.NOT_ENABLED, (Mode.ENABLING,), Mode.DISABLED),
    (Event.DISABLE, _STANDING, Mode.READY),
    (Event.DISABLED, (*_WITH_TORQUE, Mode.ENABLING), Mode.DISABLED),
    (Event.FREE, _LEFT_ALONE, Mode.READY),
    (Event.ON_PATH, _LEFT_ALONE, Mode.HALTED),
    (Event.BESIDE_PATH, _LEFT_ALONE, Mode.OFF_PATH),
    (Event.FORGOTTEN, (Mode.HALTED, Mode.OFF_PATH, Mode.RETURNING), Mode.READY),
    (Event.RUN, _STANDING, Mode.RUNNING),
    (Event.PROGRAM_ENDED, (Mode.RUNNING,), Mode.READY),
    (Event.HALT, (Mode.RUNNING,), Mode.HALTED),
    (Event.CONTINUE, (Mode.HALTED,), Mode.RUNNING),
    (Event.GO_BACK, (Mode.HALTED, Mode.OFF_PATH), Mode.RETURNING),
    (Event.RETURNED, (Mode.RETURNING,), Mode.HALTED),
    (Event.RETURNED_TO_GO_ON, (Mode.RETURNING,), Mode.RUNNING),
    (Event.JOG, _STANDING, Mode.JOGGING),
    (Event.JOG_ENDED, (Mode.JOGGING,), Mode.READY),
)
TABLE: dict[tuple[Mode, Event], Mode] = {(mode, event): then for event, modes, then in _RULES for mode in modes}
"""What is not in it changes nothing."""


def after(mode: Mode, event: Event) -> Mode:
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
