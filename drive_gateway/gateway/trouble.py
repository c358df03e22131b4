"""A reason to stop a robot, with its address."""

from dataclasses import dataclass

HARD_WIRED = "use the hard-wired emergency stop now and keep everybody away"
"""What is left to do where software cannot stop a drive."""
EMERGENCY = "emergency"
"""Code of a node's emergency message."""
AXIS_ERROR = "axis_error"
"""Code of the error of one axis of a node with several."""

SECOND_MASTER = "second_master"
"""Code of frames that only this gateway may send, and somebody else sends."""
_REPEAT = (EMERGENCY, AXIS_ERROR, SECOND_MASTER, "moves_without_torque")


@dataclass(frozen=True, slots=True)
class Trouble:
    """What went wrong: a stable code, what was found and where, what to do next, and the node it is about."""

    code: str
    text: str
    remedy: str
    node_id: int | None = None
    emergency_code: int | None = None
    stops: bool = True
    """Else it is told and nothing more."""
    again: bool = False
    """An error that was told before and is not gone: another is, and the node tells what is left (CiA 301, 7.2.7)."""

    @property
    def repeats(self) -> bool:
        """It may come in each cycle."""
        return self.code in _REPEAT

    def instead_of(self, first: "Trouble | None") -> "Trouble":
        """Which is the cause to be shown: the first, but for one that says which axis of a node the first was about."""
        if first is None or (self.code == AXIS_ERROR and first.code == EMERGENCY and first.node_id == self.node_id):
            return self
        return first
