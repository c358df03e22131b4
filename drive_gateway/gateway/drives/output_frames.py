"""The frames that tell drives their digital outputs: when one changes, and now and then for a drive that lost them."""

from collections.abc import Iterator, Sequence

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import OUTPUTS, Pdo
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.playout.outputs import Outputs

REPEAT_S = 0.2
"""From one frame to the next while nothing changes."""


class OutputFrames:
    """Those of all drives of one robot that have outputs."""

    def __init__(self, drives: Sequence[Drive], outputs: Outputs) -> None:
        self._outputs = outputs
        self._senders = [_Sender(drive, drive.image.outputs) for drive in drives if drive.image.outputs is not None]

    def due(self, now: float) -> Iterator[CanFrame]:
        """They act with the next SYNC, like the set points of the same cycle."""
        for sender in self._senders:
            frame = sender.due(self._outputs.word(sender.axis), now)
            if frame is not None:
                yield frame


class _Sender:
    def __init__(self, drive: Drive, pdo: Pdo) -> None:
        self.axis = drive.axis.name
        self._drive = drive
        self._cob_id = pdo.cob_id
        self._told: int | None = None
        self._due = 0.0

    def due(self, word: int, now: float) -> CanFrame | None:
        if not self._drive.addressed or (word == self._told and now < self._due):
            return None
        self._told, self._due = word, now + REPEAT_S
        return CanFrame(self._cob_id, OUTPUTS.pack(word))
