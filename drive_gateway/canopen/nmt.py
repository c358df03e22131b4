"""Network management (CiA 301): the master's commands and the states its nodes report."""

from enum import IntEnum

from drive_gateway.canopen.cob_id import ERROR_CONTROL, MASTER_NODE_ID, NMT, SYNC
from drive_gateway.canopen.frame import CanFrame

SYNC_FRAME = CanFrame(SYNC, b"")


class NmtCommand(IntEnum):
    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """The byte of a heartbeat; `BOOT_UP` is sent once, at the end of initialising."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F

    @property
    def words(self) -> str:
        """Its name for people, as CiA 301 has it: Pre-operational."""
        return self.name.replace("_", "-").capitalize()


def sync_frames(overflow: int) -> list[CanFrame]:
    """SYNC as it goes round: one frame without data, or with a counter from 1 to `overflow` (1019h, CiA 301)."""
    return [CanFrame(SYNC, bytes((count,))) for count in range(1, overflow + 1)] or [SYNC_FRAME]


def nmt_frame(command: NmtCommand, node_id: int) -> CanFrame:
    """The unconfirmed command to one node (0: all of them); its effect shows in the node's heartbeat."""
    return CanFrame(NMT, bytes((command, node_id)))


def heartbeat_frame(state: NmtState, node_id: int = MASTER_NODE_ID) -> CanFrame:
    return CanFrame(ERROR_CONTROL + node_id, bytes((state,)))


def decode_heartbeat(data: bytes) -> NmtState | None:
    """The state in a boot-up or heartbeat frame; `None` when the frame holds none (bit 7 is the guarding toggle)."""
    if len(data) != 1:
        return None
    try:
        return NmtState(data[0] & 0x7F)
    except ValueError:
        return None
