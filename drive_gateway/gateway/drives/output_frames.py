"""The frames that tell drives their digital outputs: when one changes, and now and then for a drive that lost them."""

from collections.abc import Iterator, Sequence

from drive_gateway.canopen.frame import CanFrame
from drive_gateway.canopen.pdo_map import Pdo
from drive_gateway.gateway.drives.drive import Drive
from drive_gateway.gateway.playout.outputs import Outputs

REPEAT_S = 0.2
"""From one frame to the next while nothing changes."""


class OutputFrames:
    """Those of all drives of one robot that have outputs."""

    def __init__(self, drives: Sequence[Drive], outputs: Outputs) -> None:
        self._outputs = outputs
        self._senders = [
            (drive, OutputSender(drive.image.outputs)) for drive in drives if drive.image.outputs is not None
        ]

    def due(self, now: float) -> Iterator[CanFrame]:
        """They act with the next SYNC, like the set points of the same cycle."""
        for drive, sender in self._senders:
            frame = sender.due(self._outputs.word(drive.axis.name), now) if drive.addressed else None
            if frame is not None:
                yield frame


class OutputSender:
    """The frames of one PDO that carries outputs."""

    def __init__(self, pdo: Pdo) -> None:
        self._cob_id = pdo.cob_id
        self._bytes = pdo.data_bytes
        self._told: int | None = None
        self._due = 0.0

    def due(self, word: int, now: float) -> CanFrame | None:
        """The frame with the outputs of `word`, bit 0 first, when they have changed or were told long ago."""
        if word == self._told and now < self._due:
            return None
        self._told, self._due = word, now + REPEAT_S
        return CanFrame(self._cob_id, word.to_bytes(self._bytes, "little"))
