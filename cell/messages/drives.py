"""What a gateway tells about one robot's drives, once per bus cycle."""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from cell.messages.state import Urgency, state


class PlayoutState(IntEnum):
    """What the gateway does with set-point blocks."""

    FOLLOWING = 0
    """Drives are disabled: the command follows the measured position."""
    PLAYING = 1
    """The nominal part of a block, or its hold at standstill, is played."""
    RAMP = 2
    """The braking ramp of the newest block is played: newer blocks did not come."""
    STARVED = 3
    """The newest block is played out; the robot stands at its end and waits for the same owner."""
    STOPPING = 4
    """Quick stop: the drives brake by themselves, off the path."""
    FAULT = 5


class AxisStatus(IntEnum):
    """CiA 402 state of an axis' drive, plus the lack of news."""

    NOT_READY_TO_SWITCH_ON = 0
    SWITCH_ON_DISABLED = 1
    READY_TO_SWITCH_ON = 2
    SWITCHED_ON = 3
    OPERATION_ENABLED = 4
    QUICK_STOP_ACTIVE = 5
    FAULT_REACTION_ACTIVE = 6
    FAULT = 7
    SILENT = 8
    """No TPDO within its time."""

    @property
    def has_torque(self) -> bool:
        """The power stage is on."""
        return self in _WITH_TORQUE

    @property
    def words(self) -> str:
        """Its name for people, as CiA 402 has it: Switch On Disabled."""
        return self.name.replace("_", " ").title().replace(" To ", " to ")


_WITH_TORQUE = frozenset(
    {
        AxisStatus.SWITCHED_ON,
        AxisStatus.OPERATION_ENABLED,
        AxisStatus.QUICK_STOP_ACTIVE,
        AxisStatus.FAULT_REACTION_ACTIVE,
    }
)


@state("robot/{robot}/drives", Urgency.REAL_TIME)
@dataclass(frozen=True, slots=True, eq=False)
class DriveFeedback:
    """Measured and commanded axes at one tick. Arrays are `(n,)` in the axis order of the claim, SI units."""

    robot: str
    boot: str
    """The gateway's boot."""
    sequence: int
    tick: int
    """SYNCs sent so far: the clock by which blocks are joined."""
    owner: int
    """Number of the present claim; 0 when nobody owns the robot."""
    block: int
    """Sequence of the newest accepted block of this owner; 0 when none yet."""
    state: PlayoutState
    level: int
    """Samples left before the newest block is played out."""
    refused: int
    """Blocks refused since the gateway started."""
    referenced: bool
    """All axes know where they are."""
    enabled: bool
    """All axes are in Operation Enabled and the playout is live."""
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    commanded: NDArray[np.float64]
    """The sample sent for this tick."""
    axes: tuple[AxisStatus, ...]
    torque: NDArray[np.float64] | None = None
    """[Nm or N] what each axis' motor gives behind its gear; None: not every drive tells."""
    outputs: int = 0
    """Bit i: the i-th of `ClaimGrant.outputs` is switched on at this tick. A stop may have switched it off."""
    event: int = 0
    """Number of the newest event of this owner whose tick was played; 0 when none yet. All up to it are executed. What
    a stop made the gateway forget is not."""
